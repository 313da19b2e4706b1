/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/served_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "base/text.h"
#include "base/try.h"
#include "bench/simulated_rig.h"
#include "dmd/boards.h"
#include "emulation/live_bench.h"
#ifdef HAVE_USB_BED
#include "emulation/usb_bed.h"
#endif

namespace codedexposure
{

namespace
{

/* Words with '@' are faults of frames; the others are of the bench. */
Result<SickBenchOptions>
bench_of (const std::string &faults, Extent size,
    std::vector<GigeCameraOptions> &cameras)
{
  GigeCameraOptions &camera = cameras.front ();
  std::string frames, bench;
  for (const std::string_view word : split (faults, ' '))
    (word.find ('@') == word.npos ? bench : frames) += std::string (word) + " ";
  RETURN_IF_ERROR (camera.faults.add (frames));
  SickBenchOptions options;
  options.camera = size;
  options.rate = {int (std::lround (camera.trigger_rate * 1000)), 1000};
  options.bits = camera.bits;
  options.seed = camera.seed;
  if (cameras.size () > 1)
    options.second = {second_camera_of (options)};
  RETURN_IF_ERROR (inflict (options, bench));
  return options;
}

/* The camera's side of a bench. */
void
look_at (LiveBench &bench, GigeCameraOptions &camera)
{
  const SickBenchOptions &options = bench.truth ().options;
  camera.width = options.camera.width;
  camera.height = options.camera.height;
  camera.bits = options.bits;
  camera.packet_loss = std::max (camera.packet_loss, options.packet_loss);
  camera.jitter = std::max (camera.jitter, options.frame_jitter);
  camera.features = camera_features (options);
  camera.deep = options.has ("pixel-format");
  if (options.trigger == SickBenchOptions::Trigger::double_rate)
    camera.trigger_rate *= 2;
  camera.shoot = [&bench] (ImageView<std::uint16_t> picture) {
    return bench.take (picture);
  };
  camera.started = [&bench] { bench.skip (); };
  camera.set_up = [&bench, say_set_up = camera.set_up] (
                      const CameraSettings &settings) {
    const double period = 1e6 / settings.frame_rate;
    bench.expose (settings.exposure_us < period
                      ? std::optional (Nanoseconds (settings.exposure_us * 1e3))
                      : std::nullopt);
    say_set_up (settings);
  };
}

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

} // namespace

#ifndef HAVE_USB_BED

struct ServedBench::Usb {
  Result<void> plug (const LiveBench &)
  {
    return Error{"this build has no emulated USB; install libumockdev-dev and "
                 "build again",
        ErrorCode::unsupported};
  }
};

std::vector<std::pair<std::string, std::string>>
ServedBench::environment () const
{
  return {};
}

#else

namespace
{

std::string
usb_folder ()
{
  const char *found = std::getenv ("UMOCKDEV_DIR");
  return found ? found : "";
}

void
set_firmware (emulated::EmulatedDlpc900 &board, const std::string &version)
{
  const auto numbers = split (version, '.');
  board.firmware_major = parse_int (numbers[0]).value_or (6);
  if (numbers.size () > 1)
    board.firmware_minor = parse_int (numbers[1]).value_or (0);
}

/* Nobody may open the node, not even root: a variable of the kernel that cannot
 * be written takes its place. */
Result<void>
lock_node ()
{
  const std::filesystem::path node = usb_folder () + "/dev/bus/usb/001/002";
  std::error_code failed;
  std::filesystem::remove (node, failed);
  std::filesystem::create_symlink ("/proc/sys/kernel/version", node, failed);
  if (failed)
    return Error{"cannot lock " + node.string () + ": " + failed.message ()};
  return {};
}

} // namespace

/* The bus, with the board of a bench and its faults. */
struct ServedBench::Usb {
  Result<void> plug (const LiveBench &bench)
  {
    constexpr const char *kPort = "1-2";
    const SickBenchOptions &faults = bench.truth ().options;
    if (faults.has ("firmware"))
      set_firmware (*bench.board (), faults.parts.at ("firmware"));
    if (faults.has ("dmd-missing"))
      return {};
    bed.plug (kPort, kUsbDlpc900, "LCR1", bench.board ());
    if (faults.has ("dmd-busy"))
      bed.occupy (kPort);
    return faults.has ("dmd-permission") ? lock_node () : Result<void> ();
  }

  emulated::UsbBed bed;
};

std::vector<std::pair<std::string, std::string>>
ServedBench::environment () const
{
  std::vector<std::pair<std::string, std::string>> variables = {
      {"LD_PRELOAD", emulated::kPreload}, {"UMOCKDEV_DIR", usb_folder ()}};
  if (slow_disk_)
    variables.emplace_back ("CODEDEXPOSURE_SLOW_DISK", "1");
  return variables;
}

#endif

ServedBench::ServedBench () = default;
ServedBench::~ServedBench () = default;

Result<std::unique_ptr<ServedBench>>
ServedBench::open (const std::string &board, const std::string &faults,
    Extent size, std::vector<GigeCameraOptions> cameras)
{
  ASSIGN_OR_RETURN (const int kind, board_kind (board));
  ASSIGN_OR_RETURN (SickBenchOptions options, bench_of (faults, size, cameras));
  bool dark = options.has ("camera-missing");
  std::unique_ptr<ServedBench> served (new ServedBench);
  served->slow_disk_ = options.has ("slow-disk");
  ASSIGN_OR_RETURN (
      served->bench_, LiveBench::make (std::move (options), kind));
  served->usb_ = std::make_unique<Usb> ();
  RETURN_IF_ERROR (served->usb_->plug (*served->bench_));
  LiveBench *seen = served->bench_.get ();
  for (GigeCameraOptions &camera : cameras) {
    look_at (*seen, camera);
    seen = served->bench_->second ();
    if (std::exchange (dark, false))
      continue;
    ASSIGN_OR_RETURN (
        served->cameras_.emplace_back (), GigeCamera::open (camera, {}));
  }
  served->options_ = std::move (cameras);
  return served;
}

void
print_sent (const std::string &address, const SentFrame &sent)
{
  std::printf ("{\"camera\":\"%s\",\"frame\":%llu,\"device_ns\":%lld,"
               "\"host_ns\":%lld,\"fault\":\"%s\"}\n",
      address.c_str (), static_cast<unsigned long long> (sent.frame),
      static_cast<long long> (sent.device_time),
      static_cast<long long> (sent.host_time), fault_text (sent.fault.kind));
  std::fflush (stdout);
}

} // namespace codedexposure
