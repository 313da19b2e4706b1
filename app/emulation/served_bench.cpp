/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/served_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/text.h"
#include "base/try.h"
#include "bench/simulated_rig.h"
#include "emulation/live_bench.h"
#include "emulation/usb_board.h"

namespace codedexposure
{

namespace
{

const char *
fault_text (Fault::Kind kind)
{
  static constexpr const char *names[] = {
      "sent", "lose", "incomplete", "delay", "duplicate", "late", "stop"};
  return names[int (kind)];
}

/* Words with '@' are faults of frames; the others are of the bench. */
Result<SickBenchOptions>
bench_of (const std::string &faults, Extent size, GigeCameraOptions &camera)
{
  std::string frames, bench;
  for (const std::string_view word : split (faults, ' '))
    (word.find ('@') == word.npos ? bench : frames) += std::string (word) + " ";
  RETURN_IF_ERROR (camera.faults.add (frames));
  SickBenchOptions options;
  options.camera = size;
  options.rate = {int (std::lround (camera.trigger_rate * 1000)), 1000};
  options.bits = camera.bits;
  options.seed = camera.seed;
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

class Served final : public ServedBench
{
public:
  Result<void> set_up (const std::string &board, const std::string &faults,
      Extent size, GigeCameraOptions camera)
  {
    ASSIGN_OR_RETURN (const int kind, board_kind (board));
    ASSIGN_OR_RETURN (
        SickBenchOptions options, bench_of (faults, size, camera));
    const bool dark = options.has ("camera-missing");
    slow_disk_ = options.has ("slow-disk");
    ASSIGN_OR_RETURN (bench_, LiveBench::make (std::move (options), kind));
    ASSIGN_OR_RETURN (board_, UsbBoard::plug (*bench_));
    look_at (*bench_, camera);
    options_ = camera;
    if (!dark) {
      ASSIGN_OR_RETURN (camera_, GigeCamera::open (std::move (camera), {}));
    }
    return {};
  }

  const GigeCameraOptions &camera_options () const override { return options_; }
  std::vector<std::pair<std::string, std::string>> environment () const override
  {
    auto variables = board_->environment ();
    if (slow_disk_)
      variables.emplace_back ("CODEDEXPOSURE_SLOW_DISK", "1");
    return variables;
  }

private:
  bool slow_disk_ = false;
  GigeCameraOptions options_;
  std::unique_ptr<LiveBench> bench_;
  std::unique_ptr<UsbBoard> board_;
  std::unique_ptr<GigeCamera> camera_;
};

} // namespace

Result<std::unique_ptr<ServedBench>>
ServedBench::open (const std::string &board, const std::string &faults,
    Extent size, GigeCameraOptions camera)
{
  auto served = std::make_unique<Served> ();
  RETURN_IF_ERROR (served->set_up (board, faults, size, std::move (camera)));
  return std::unique_ptr<ServedBench> (std::move (served));
}

void
print_sent (const SentFrame &sent)
{
  std::printf ("{\"frame\":%llu,\"device_ns\":%lld,\"host_ns\":%lld,"
               "\"fault\":\"%s\"}\n",
      static_cast<unsigned long long> (sent.frame),
      static_cast<long long> (sent.device_time),
      static_cast<long long> (sent.host_time), fault_text (sent.fault.kind));
  std::fflush (stdout);
}

} // namespace codedexposure
