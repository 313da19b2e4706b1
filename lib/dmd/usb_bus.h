/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* DMD boards on the USB. */
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "dmd/boards.h"
#include "dmd/dmd.h"

namespace codedexposure
{

/** A board that is connected. */
struct UsbBoard {
  Controller controller = Controller::dlpc900;
  std::string port;   ///< bus and ports on the way to it: "1-2.3"
  std::string serial; ///< often empty or the same on several boards
  /** Why it cannot be opened, such as missing rights; or "". */
  std::string trouble;
};

/** The boards that are connected, in the order of their ports. */
Result<std::vector<UsbBoard>> list_usb_boards ();

/**
 * Opens "usb:[PORT|SERIAL][,key=value...]", see options.h; "usb:" is the
 * only board that is connected. The kernel's driver is detached from the board
 * until the Dmd is destroyed.
 */
Result<std::unique_ptr<Dmd>> open_usb_dmd (std::string_view device);

} // namespace codedexposure
