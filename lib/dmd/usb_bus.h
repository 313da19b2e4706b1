/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* DMD boards on the USB. */
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "dmd/dmd.h"

namespace codedexposure
{

enum class UsbController { dlpc350, dlpc900 };

/** A board that is connected. */
struct UsbBoard {
  UsbController controller = UsbController::dlpc900;
  std::string port;   ///< bus and ports on the way to it: "1-2.3"
  std::string serial; ///< often empty or the same on several boards
  /** Why it cannot be opened, such as missing rights; or "". */
  std::string trouble;
};

/** "DLPC350" or "DLPC900". */
const char *controller_text (UsbController controller);

/** The boards that are connected, in the order of their ports. */
Result<std::vector<UsbBoard>> list_usb_boards ();

/**
 * Opens "usb:[PORT|SERIAL][,key=value...]", see options.h; "usb:" is the
 * only board that is connected. The kernel's driver is detached from the board
 * until the Dmd is destroyed.
 */
Result<std::unique_ptr<Dmd>> open_usb_dmd (std::string_view device);

} // namespace codedexposure
