/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/usb_board.h"

#include <cstdlib>
#include <filesystem>

#include "base/text.h"
#include "dmd/boards.h"
#ifdef HAVE_USB_BED
#include "emulation/usb_bed.h"
#endif

namespace codedexposure
{

Result<int>
board_kind (const std::string &name)
{
  const BoardFacts *facts = find_board (name);
  if (facts && facts->controller == Controller::dlpc900)
    return int (facts->type);
  return Error{"board " + in_quotes (name) +
               " cannot be emulated; use one with a DLPC900, such as dlp6500 "
               "or dlp5500"};
}

#ifndef HAVE_USB_BED

Result<std::unique_ptr<UsbBoard>>
UsbBoard::plug (const LiveBench &)
{
  return Error{"this build has no emulated USB; install libumockdev-dev and "
               "build again",
      ErrorCode::unsupported};
}

#else

namespace
{

constexpr const char *kPort = "1-2";

class PluggedBoard final : public UsbBoard
{
public:
  Result<void> plug (const LiveBench &bench)
  {
    const SickBenchOptions &faults = bench.truth ().options;
    if (const auto firmware = faults.parts.find ("firmware");
        firmware != faults.parts.end ())
      set_firmware (*bench.board (), firmware->second);
    if (faults.has ("dmd-missing"))
      return {};
    bed_.plug (kPort, kUsbDlpc900, "LCR1", bench.board ());
    if (faults.has ("dmd-busy"))
      bed_.occupy (kPort);
    return faults.has ("dmd-permission") ? lock () : Result<void> ();
  }

  std::vector<std::pair<std::string, std::string>> environment () const override
  {
    return {{"LD_PRELOAD", emulated::kPreload}, {"UMOCKDEV_DIR", folder ()}};
  }

private:
  static std::string folder ()
  {
    const char *found = std::getenv ("UMOCKDEV_DIR");
    return found ? found : "";
  }

  static void set_firmware (
      emulated::EmulatedDlpc900 &board, const std::string &version)
  {
    const auto numbers = split (version, '.');
    board.firmware_major = parse_int (numbers[0]).value_or (6);
    if (numbers.size () > 1)
      board.firmware_minor = parse_int (numbers[1]).value_or (0);
  }

  /** Nobody may open the node, not even root: a variable of the kernel that
   * cannot be written takes its place. */
  Result<void> lock ()
  {
    const std::filesystem::path node = folder () + "/dev/bus/usb/001/002";
    std::error_code failed;
    std::filesystem::remove (node, failed);
    std::filesystem::create_symlink ("/proc/sys/kernel/version", node, failed);
    if (failed)
      return Error{"cannot lock " + node.string () + ": " + failed.message ()};
    return {};
  }

  emulated::UsbBed bed_;
};

} // namespace

Result<std::unique_ptr<UsbBoard>>
UsbBoard::plug (const LiveBench &bench)
{
  auto board = std::make_unique<PluggedBoard> ();
  if (const auto plugged = board->plug (bench); !plugged)
    return plugged.error ();
  return std::unique_ptr<UsbBoard> (std::move (board));
}

#endif

} // namespace codedexposure
