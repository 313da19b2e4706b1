/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The LightCrafter 4500. */
#include <algorithm>

#include "base/try.h"
#include "dmd/dlpc350_protocol.h"
#include "dmd/dlpc_board.h"
#include "dmd/plane_image.h"

namespace codedexposure
{

namespace
{

using namespace dlpc350;
using namespace std::chrono_literals;

/** Of the hardware status: resets, forced swap, sequencer. */
constexpr std::uint8_t kFailures = 0xCC;
constexpr int kStartAttempts = 3;

class Dlpc350 final : public DlpcBoard
{
public:
  Dlpc350 (std::unique_ptr<HidLink> link, const DmdOptions &options)
      : DlpcBoard (std::move (link), options, kFailures)
  {
  }
  ~Dlpc350 () override
  {
    if (touched_)
      stop ();
  }

  Result<void> open ()
  {
    RETURN_IF_ERROR (greet ());
    RETURN_IF_ERROR (read_byte (kHardwareStatus));
    return set_info (*find_board ("dlp4500"));
  }

  Result<DmdStatus> status () override
  {
    begin ();
    ASSIGN_OR_RETURN (const std::uint8_t images, read_byte (kFlashImages));
    return state ({{"controller", "DLPC350"}, {"mirrors", "DLP4500"},
        {"images-in-flash", std::to_string (images)}});
  }

  Result<void> upload (const Schedule &schedule, std::stop_token stop_token,
      const UploadProgress &progress) override
  {
    masks_.clear ();
    begin (std::move (stop_token));
    RETURN_IF_ERROR (check_images (schedule));
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

  Result<void> start (const SlotPlan &plan, std::stop_token stop_token) override
  {
    if (masks_.empty ())
      return Error{info_.name + ": no masks to start; upload first"};
    ASSIGN_OR_RETURN (const PatternTime time,
        with_prefix (
            fit_equal_patterns (plan, *info_.patterns), info_.name + ": "));
    RETURN_IF_ERROR (watch ());
    begin (std::move (stop_token));
    // After every stop, the board needs its tables and their validation again.
    RETURN_IF_ERROR (halt ());
    RETURN_IF_ERROR (send_tables (time));
    RETURN_IF_ERROR (validate ());
    RETURN_IF_ERROR (pause_frame (plan));
    return run ();
  }

private:
  std::string explain () override
  {
    return "refused; the board is in another mode, or its firmware does not "
           "know this";
  }
  bool video () const { return options_.source == Source::video; }
  /** Checks the options that name the images of the masks. */
  Result<void> check_images (const Schedule &schedule)
  {
    RETURN_IF_ERROR (check_masks (info_, schedule));
    if (video ())
      return {};
    const int needed = plan_planes (schedule).images;
    if (int (options_.images.size ()) != needed)
      return Error{
          info_.name +
              " takes no masks over USB. Write them as images with "
              "'codedexposure schedule render --planes', put these into its "
              "flash with TI's LightCrafter 4500 software and name them: "
              "images=0" +
              (needed > 1 ? "/1" : "") +
              "; or show them over HDMI and add source=video",
          ErrorCode::unsupported};
    ASSIGN_OR_RETURN (const int in_flash, read_byte (kFlashImages));
    for (const int image : options_.images)
      if (image >= in_flash)
        return Error{info_.name + " has " + std::to_string (in_flash) +
                     " images in flash, there is no image " +
                     std::to_string (image)};
    return {};
  }

  Result<void> prepare ()
  {
    RETURN_IF_ERROR (wake ());
    RETURN_IF_ERROR (halt ());
    RETURN_IF_ERROR (enter (kModePattern));
    RETURN_IF_ERROR (write (kTriggerOut2,
        encode_pulse (options_.pulse_low, options_.polarity_bit)));
    return write_byte (kSource, std::uint8_t (options_.source));
  }

  std::vector<Entry> entries () const
  {
    const Trigger edge =
        options_.falling_edge && !video () ? Trigger::falling : Trigger::rising;
    const bool camera = options_.master == Master::camera;
    std::vector<Entry> entries;
    int image = -1;
    for (std::size_t mask = 0; mask < masks_.size (); mask++) {
      const PlaneSlot at = masks_[mask];
      Entry entry{.plane = at.plane, .next_image = at.image != image};
      image = at.image;
      if (video ())
        entry.trigger = mask == 0 ? edge : Trigger::none;
      else if (camera) {
        const std::size_t slot = mask % std::size_t (slots_);
        entry.trigger = slot == 0 ? edge : Trigger::none;
        entry.black_after = int (slot) == slots_ - 1;
      }
      entries.push_back (entry);
    }
    return entries;
  }

  Result<void> fill_mailbox (std::uint8_t mailbox, const Bytes &data)
  {
    RETURN_IF_ERROR (write_byte (kMailbox, mailbox));
    const auto filled =
        write_all ({{kMailboxOffset, {0}}, {kMailboxData, data}});
    // A mailbox left open would swallow the next table.
    const auto closed = write_byte (kMailbox, kMailboxClosed);
    return filled ? closed : filled;
  }

  Result<void> send_tables (const PatternTime &time)
  {
    std::vector<Entry> patterns = entries ();
    Bytes images;
    for (std::size_t mask = 0; mask < patterns.size (); mask++)
      if (patterns[mask].next_image && !video ())
        images.push_back (
            std::uint8_t (options_.images[std::size_t (masks_[mask].image)]));

    const TriggerMode mode =
        video () ? TriggerMode::video : TriggerMode::timer_or_input;
    const std::size_t image_entries = std::max<std::size_t> (1, images.size ());
    RETURN_IF_ERROR (write_all ({{kConfigure, encode_configuration (
                                                  int (patterns.size ()),
                                                  slots_, int (image_entries))},
        {kTriggerMode, {std::uint8_t (mode)}}, {kTimes, encode_times (time)}}));
    if (!video ())
      RETURN_IF_ERROR (fill_mailbox (kMailboxImages, images));
    return fill_mailbox (kMailboxPatterns, encode_entries (patterns));
  }

  Result<void> validate ()
  {
    RETURN_IF_ERROR (write_byte (kValidate, 0));
    do {
      ASSIGN_OR_RETURN (const std::uint8_t byte, read_byte (kValidate));
      const Verdict verdict =
          parse_verdict (byte, options_.master == Master::camera && !video ());
      if (!verdict.busy && !verdict.good)
        return error ("show these masks", verdict.text);
      if (!verdict.busy)
        return {};
    } while (link_->wait (10ms));
    return error (kValidate.name, "it does not finish");
  }

  Result<void> run ()
  {
    // After video mode, the board may ignore the first start.
    for (int attempt = 0; attempt < kStartAttempts; attempt++) {
      RETURN_IF_ERROR (launch ());
      ASSIGN_OR_RETURN (const std::uint8_t status, read_byte (kMainStatus));
      if ((status & kSequencerRuns) != 0)
        return check_health ();
      if (!link_->wait (100ms))
        break;
    }
    return error ("start the patterns",
        video () ? "it does not run; is a 912x1140 signal on its HDMI input?"
                 : "it does not run");
  }

  std::vector<PlaneSlot> masks_; // empty: nothing to start
  int slots_ = 1;
};

} // namespace

Result<std::unique_ptr<Dmd>>
open_dlpc350 (std::unique_ptr<HidLink> link, const DmdOptions &options)
{
  auto dmd = std::make_unique<Dlpc350> (std::move (link), options);
  RETURN_IF_ERROR (dmd->open ());
  return std::unique_ptr<Dmd> (std::move (dmd));
}

} // namespace codedexposure
