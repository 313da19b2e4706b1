/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dlpc350.h"

#include <algorithm>
#include <optional>

#include "dmd/dlp_controller.h"
#include "dmd/plane_image.h"

namespace codedexposure
{

namespace
{

using namespace dlpc350;

constexpr Extent kMirrors{912, 1140};
/** Of the hardware status: resets, forced swap, sequencer. */
constexpr std::uint8_t kFailures = 0xCC;
constexpr int kStartAttempts = 3;
/** Masks in one frame of video. */
constexpr int kVideoPlanes = kPlanesPerImage;

class Dlpc350 : public Dmd
{
public:
  Dlpc350 (std::unique_ptr<HidLink> link, const DmdOptions &options)
      : options_ (options),
        board_ (std::move (link), kFailures, [] (DlpController &) {
          return std::string ("refused; the board is in another mode, or its "
                              "firmware does not know this");
        })
  {
  }
  ~Dlpc350 () override
  {
    if (touched_)
      stop ();
  }

  Result<void> open ();

  const DmdInfo &info () const override { return info_; }
  Result<DmdStatus> status () override;
  Result<void> upload (const Schedule &schedule, std::stop_token stop,
      const UploadProgress &progress) override;
  Result<void> start (const SlotPlan &plan, std::stop_token stop) override;
  void stop () override { running_ = !board_.stop () && running_; }
  bool running () const override { return running_; }

private:
  void begin (std::stop_token stop = {})
  {
    board_.link ().begin (std::move (stop), options_.patience);
  }
  Result<void> check_images (const Schedule &schedule);
  Result<void> prepare ();
  std::vector<Entry> entries () const;
  Result<void> fill_mailbox (std::uint8_t mailbox, const Bytes &data);
  Result<void> send_tables (const PatternTime &time);
  Result<void> validate ();
  Result<void> run ();

  DmdOptions options_;
  DlpController board_;
  DmdInfo info_;
  std::vector<PlaneSlot> masks_; // empty: nothing to start
  int slots_ = 1;
  bool touched_ = false;
  bool running_ = false;
};

Result<void>
Dlpc350::open ()
{
  begin ();
  const auto version = board_.read (kVersion, 16);
  if (!version)
    return version.error ();
  const auto status = board_.read_byte (kHardwareStatus);
  if (!status)
    return status.error ();
  info_.name = board_.link ().name () + " (DLP4500)";
  info_.size = kMirrors;
  info_.array = Array::diamond;
  info_.minimum_active = Nanoseconds (kMinimumExposure) * 1000;
  info_.resident_masks =
      options_.source == Source::flash ? kPreloadedPlanes : kVideoPlanes;
  info_.triggers_camera = options_.master == Master::dmd;
  info_.trigger_in = info_.trigger_out = true;
  info_.minimum_dark = Nanoseconds (kMinimumDark) * 1000;
  return check_placement (options_.placement, info_.array, info_.size);
}

Result<DmdStatus>
Dlpc350::status ()
{
  begin ();
  const auto images = board_.read_byte (kFlashImages);
  if (!images)
    return images.error ();
  auto status = board_.status ();
  if (status)
    status->details.insert (status->details.begin (),
        {{"controller", "DLPC350"}, {"mirrors", "DLP4500"},
            {"images-in-flash", std::to_string (*images)}});
  return status;
}

/** Whether the user said where the masks are, and it can be so. */
Result<void>
Dlpc350::check_images (const Schedule &schedule)
{
  if (schedule.masks () > info_.resident_masks)
    return Error{info_.name + " shows " +
                 std::to_string (info_.resident_masks) + " masks, not " +
                 std::to_string (schedule.masks ()) +
                 "; take a tile with fewer elements"};
  if (options_.source == Source::video)
    return {};
  const int needed = plan_planes (schedule).images;
  if (int (options_.images.size ()) != needed)
    return Error{
        info_.name +
            " takes no masks over USB. Write them as images with "
            "'codedexposure schedule render --planes', put these into its "
            "flash with TI's LightCrafter 4500 software and say which they "
            "are: "
            "images=0" +
            (needed > 1 ? "/1" : "") +
            "; or show them over HDMI and add source=video",
        ErrorCode::unsupported};
  const auto in_flash = board_.read_byte (kFlashImages);
  if (!in_flash)
    return in_flash.error ();
  for (const int image : options_.images)
    if (image >= *in_flash)
      return Error{info_.name + " has " + std::to_string (*in_flash) +
                   " images in flash, there is no image " +
                   std::to_string (image)};
  return {};
}

Result<void>
Dlpc350::upload (const Schedule &schedule, std::stop_token stop_token,
    const UploadProgress &progress)
{
  masks_.clear ();
  begin (std::move (stop_token));
  if (const auto there = check_images (schedule); !there)
    return there;
  progress (0, 1);
  touched_ = true;
  if (const auto ready = prepare (); !ready) {
    stop ();
    return ready;
  }
  masks_ = plan_planes (schedule).masks;
  slots_ = schedule.slots ();
  progress (1, 1);
  return {};
}

Result<void>
Dlpc350::prepare ()
{
  if (const auto stopped = board_.halt (); !stopped)
    return stopped;
  running_ = false;
  if (const auto entered = board_.enter (kModePattern); !entered)
    return entered;
  // After a reset, pulses are high and come without delay.
  if (options_.pulse_low)
    if (const auto set = board_.write (
            kTriggerOut2, encode_low_pulse (options_.polarity_bit));
        !set)
      return set;
  return board_.write_byte (kSource, std::uint8_t (options_.source));
}

std::vector<Entry>
Dlpc350::entries () const
{
  const bool video = options_.source == Source::video;
  const Trigger edge =
      options_.falling_edge && !video ? Trigger::falling : Trigger::rising;
  const bool camera = options_.master == Master::camera;
  std::vector<Entry> entries;
  int image = -1;
  for (std::size_t mask = 0; mask < masks_.size (); mask++) {
    const PlaneSlot at = masks_[mask];
    Entry entry{.plane = at.plane, .next_image = at.image != image};
    image = at.image;
    if (video)
      entry.trigger = mask == 0 ? edge : Trigger::none;
    else if (camera)
      entry.trigger = mask % std::size_t (slots_) == 0 ? edge : Trigger::none;
    entries.push_back (entry);
  }
  return entries;
}

Result<void>
Dlpc350::fill_mailbox (std::uint8_t mailbox, const Bytes &data)
{
  if (const auto opened = board_.write_byte (kMailbox, mailbox); !opened)
    return opened;
  auto filled = board_.write_byte (kMailboxOffset, 0);
  if (filled)
    filled = board_.write (kMailboxData, data);
  // A mailbox left open would swallow the next table.
  const auto closed = board_.write_byte (kMailbox, kMailboxClosed);
  return filled ? closed : filled;
}

Result<void>
Dlpc350::send_tables (const PatternTime &time)
{
  const bool video = options_.source == Source::video;
  std::vector<Entry> patterns = entries ();
  Bytes images;
  for (std::size_t mask = 0; mask < patterns.size (); mask++)
    if (patterns[mask].next_image && !video)
      images.push_back (
          std::uint8_t (options_.images[std::size_t (masks_[mask].image)]));
  if (options_.swap_image_pair && images.size () == 2)
    std::swap (images[0], images[1]);

  const TriggerMode mode =
      video ? TriggerMode::video : TriggerMode::timer_or_input;
  const std::size_t image_entries = std::max<std::size_t> (1, images.size ());
  if (image_entries > std::size_t (kMaxImages))
    return Error{info_.name + ": the masks alternate between images more "
                              "often than its image table allows"};
  const std::pair<HidCommand, Bytes> settings[] = {
      {kConfigure, encode_configuration (int (patterns.size ()), true, slots_,
                       int (image_entries))},
      {kTriggerMode, {std::uint8_t (mode)}},
      {kTimes, encode_times (time)},
  };
  for (const auto &[command, data] : settings)
    if (const auto set = board_.write (command, data); !set)
      return set;
  if (!video)
    if (const auto filled = fill_mailbox (kMailboxImages, images); !filled)
      return filled;
  return fill_mailbox (kMailboxPatterns, encode_entries (patterns));
}

Result<void>
Dlpc350::validate ()
{
  if (const auto asked = board_.write_byte (kValidate, 0); !asked)
    return asked;
  do {
    const auto data = board_.read (kValidate);
    if (!data)
      return data.error ();
    const auto verdict = parse_verdict (*data);
    if (!verdict)
      return board_.link ().error (kValidate.name, verdict.error ().message);
    if (!verdict->busy && !verdict->good)
      return board_.link ().error ("show these masks", verdict->text);
    if (!verdict->busy)
      return {};
  } while (board_.link ().wait (std::chrono::milliseconds (10)));
  return board_.link ().error (kValidate.name, "it is busy with it for ever");
}

/** Out of video mode, the first start may be ignored. */
Result<void>
Dlpc350::run ()
{
  running_ = true;
  for (int attempt = 0; attempt < kStartAttempts; attempt++) {
    if (const auto asked = board_.write_byte (kRun, kRunStart); !asked)
      return asked;
    const auto status = board_.read_byte (kMainStatus);
    if (!status)
      return status.error ();
    if ((*status & kSequencerRuns) != 0)
      return board_.check_health ();
    if (!board_.link ().wait (std::chrono::milliseconds (100)))
      break;
  }
  return board_.link ().error ("start the patterns",
      options_.source == Source::video
          ? "it does not; is a 912x1140 signal on its HDMI input?"
          : "it does not");
}

Result<void>
Dlpc350::start (const SlotPlan &plan, std::stop_token stop_token)
{
  if (masks_.empty ())
    return Error{info_.name + ": no masks to start; upload first"};
  const auto time = fit_equal_patterns (plan,
      {kMinimumExposure, kMaximumExposure, kMinimumDark, 0, kMinimumDark},
      options_.master);
  if (!time)
    return time.error ().with_prefix (info_.name + ": ");
  if (options_.source == Source::video && time->dark != 0)
    return Error{info_.name + ": masks from video follow each other without "
                              "dark time; give the schedule switching=0"};
  // After every stop, it wants its tables anew, and validated.
  begin (std::move (stop_token));
  if (const auto stopped = board_.halt (); !stopped)
    return stopped;
  running_ = false;
  if (const auto sent = send_tables (*time); !sent)
    return sent;
  if (const auto valid = validate (); !valid)
    return valid;
  if (const auto passed = board_.link ().pause (
          std::chrono::milliseconds (plan.frame_period () / 1'000'000 + 1));
      !passed)
    return passed;
  return run ();
}

} // namespace

Result<std::unique_ptr<Dmd>>
open_dlpc350 (std::unique_ptr<HidLink> link, const DmdOptions &options)
{
  auto dmd = std::make_unique<Dlpc350> (std::move (link), options);
  if (const auto opened = dmd->open (); !opened)
    return opened.error ();
  return std::unique_ptr<Dmd> (std::move (dmd));
}

} // namespace codedexposure
