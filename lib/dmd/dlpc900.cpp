/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The LightCrafter 6500 and 9000. */
#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <optional>

#include "base/text.h"
#include "base/try.h"
#include "dmd/dlpc900_protocol.h"
#include "dmd/dlpc_board.h"
#include "dmd/plane_image.h"

namespace codedexposure
{

namespace
{

using namespace dlpc900;

constexpr Nanoseconds kPacketTime = 1'000'000; // full-speed interrupt transfer
/** Masks whose order fits in one message. */
constexpr int kMaxOrder = int (kHidRequestData - 6) / 2;
/** Of the hardware status: DMD of another kind, resets, forced swap, sequencer.
 */
constexpr std::uint8_t kFailures = 0xCE;

/** Where the masks of a schedule are on the board. */
struct Residents {
  std::vector<PlaneDigest> masks; ///< by line of the pattern table
  std::vector<PlaneSlot> planes;  ///< by line of the pattern table

  bool operator== (const Residents &) const = default;
};

/** What an upload has to do. */
struct UploadPlan {
  bool new_table = true;
  std::vector<int> order = {};  ///< line of the table for each mask
  Residents residents = {};     ///< after the upload
  std::vector<int> images = {}; ///< to send, the highest first
};

/** The line of the table with each of the masks @p wants, if the board @p has
 * the same masks in another order that fits in one message. */
std::optional<std::vector<int>>
find_order (
    const std::vector<PlaneDigest> &has, const std::vector<PlaneDigest> &wants)
{
  if (has.size () != wants.size () || int (wants.size ()) > kMaxOrder)
    return std::nullopt;
  std::vector<int> order;
  std::vector<bool> taken (has.size ());
  for (const PlaneDigest &mask : wants) {
    const auto found = std::find (has.begin (), has.end (), mask);
    const auto line = std::size_t (found - has.begin ());
    if (found == has.end () || taken[line])
      return std::nullopt;
    taken[line] = true;
    order.push_back (int (line));
  }
  return order;
}

/** Whether black still comes before each line that waits for the camera, the
 * first of @p slots each. It belongs to the line before it in the table: in
 * another place, it would be within the exposure, and there would be light
 * while the board waits. */
bool
keeps_black (const std::vector<int> &order, int slots)
{
  const int lines = int (order.size ());
  for (int first = 0; first < lines; first += slots) {
    const int shown = order[std::size_t ((first + lines - 1) % lines)];
    if (order[std::size_t (first)] != (shown + 1) % lines)
      return false;
  }
  return true;
}

/** An encoded image: one half for each of the board's controllers. */
using Halves = std::vector<PiecedBytes>;

Halves
encode_halves (const MirrorRows<PlanePixel> &image, int count)
{
  const int width = image.width () / count;
  Halves halves;
  for (int half = 0; half < count; half++)
    halves.push_back (encode_image (image, half * width, width));
  return halves;
}

std::size_t
packets_of (const Halves &halves)
{
  std::size_t packets = 0;
  for (const PiecedBytes &half : halves)
    packets += image_packets (half.size);
  return packets;
}

class Dlpc900 final : public DlpcBoard
{
public:
  Dlpc900 (std::unique_ptr<HidLink> link, const DmdOptions &options)
      : DlpcBoard (std::move (link), options, kFailures)
  {
  }
  ~Dlpc900 () override
  {
    if (!touched_)
      return;
    stop ();
    // Mirrors last longer if they move while nothing is shown.
    if (!running_ && !link_->gone ())
      (void)write_byte (kIdle, 1);
  }

  Result<void> open ()
  {
    ASSIGN_OR_RETURN (const Bytes version, greet ());
    version_ = parse_version (version);
    ASSIGN_OR_RETURN (const std::uint8_t type, read_byte (kHardware));
    facts_ = find_dlpc900 (type);
    if (!facts_)
      return error ("open it", "hardware type " + std::to_string (type) +
                                   " is not a known DMD (1..5)");
    ASSIGN_OR_RETURN (const std::uint8_t status, read_byte (kHardwareStatus));
    controllers_ = (status & kSecondController) != 0 ? 2 : 1;

    // Firmware without this command has the minimum of the table.
    BoardFacts unit = *facts_;
    const auto minima = read (kMinimumExposures, kMinimumExposuresSize);
    if (const auto binary = minima ? read_le (*minima, 0, 2) : 0; binary > 0)
      unit.limits.minimum_exposure = unit.limits.minimum_dark = binary;
    return set_info (unit);
  }

  Result<DmdStatus> status () override
  {
    begin ();
    return state ({{"controller", "DLPC900"}, {"mirrors", facts_->mirrors},
        {"firmware", version_.text ()},
        {"controllers", std::to_string (controllers_)}});
  }

  Nanoseconds upload_time (
      const Schedule &schedule, std::stop_token stop_token) override
  {
    std::size_t packets = 0;
    for (const Halves &image :
        encode (schedule, plan_upload (schedule).images, stop_token))
      packets += packets_of (image);
    return Nanoseconds (packets) * kPacketTime;
  }

  Result<void> upload (const Schedule &schedule, std::stop_token stop_token,
      const UploadProgress &progress) override
  {
    RETURN_IF_ERROR (check_masks (info_, schedule));
    touched_ = true;
    begin (stop_token);
    const auto sent = send (schedule, stop_token, progress);
    return sent ? sent : stop_after (sent);
  }

  Result<void> start (const SlotPlan &plan, std::stop_token stop_token) override
  {
    if (order_.empty ())
      return Error{info_.name + ": no masks to start; upload first"};
    if (plan.slots () != slots_)
      return Error{info_.name + ": the masks are for " +
                   std::to_string (slots_) + " slots, not for " +
                   std::to_string (plan.slots ())};
    ASSIGN_OR_RETURN (const auto times,
        with_prefix (fit_patterns (plan, *info_.patterns), info_.name + ": "));
    RETURN_IF_ERROR (watch ());
    begin (std::move (stop_token));
    const auto started = run (times, plan);
    return started || link_->cancelled () ? started : stop_after (started);
  }

  Result<void> show (const StillMask &mask, const SlotPlan &plan,
      std::stop_token stop_token) override
  {
    ASSIGN_OR_RETURN (const StillTimes still,
        with_prefix (
            fit_still (plan, mask, *info_.patterns), info_.name + ": "));
    RETURN_IF_ERROR (watch ());
    touched_ = true;
    std::vector<PatternTime> times{still.lit};
    if (still.before > 0)
      times.insert (times.begin (), {still.before, 0});
    begin (std::move (stop_token));
    auto shown = send_still (mask, times);
    if (shown)
      shown = run (times, plan);
    return shown ? shown : stop_after (shown);
  }

private:
  /** An error number, and a text if the board has one. */
  std::string explain () override
  {
    const auto code = link_->read (kErrorCode);
    if (!code || code->refused || code->data.empty ())
      return "refused, without a reason";
    std::string reason = error_text (code->data.front ());
    const auto text = link_->read (kErrorText);
    if (text && !text->refused) {
      const std::string own (text->data.begin (),
          std::find (text->data.begin (), text->data.end (), 0));
      if (!own.empty ())
        reason += ", " + in_quotes (own);
    }
    return reason;
  }

  UploadPlan plan_upload (const Schedule &schedule) const
  {
    const PlanePlan planes = plan_planes (schedule);
    UploadPlan plan;
    for (int mask = 0; mask < schedule.masks (); mask++)
      plan.residents.masks.push_back (digest_mask (schedule, mask));
    plan.residents.planes = planes.masks;
    plan.order.resize (planes.masks.size ());
    std::iota (plan.order.begin (), plan.order.end (), 0);
    if (plan.residents == residents_) {
      plan.new_table = false;
      return plan;
    }
    const auto &has = residents_.masks;
    const auto &wants = plan.residents.masks;
    if (const auto order = find_order (has, wants);
        order && version_.major >= 5 &&
        (options_.master == Master::dmd ||
            keeps_black (*order, schedule.slots ()))) {
      plan.order = *order;
      plan.residents = residents_;
      plan.new_table = false;
      return plan;
    }

    // Images stay as they are only under a table of the same planes.
    const bool same_planes = has.size () == wants.size () &&
                             residents_.planes == plan.residents.planes;
    for (int image = planes.images - 1; image >= 0; image--) {
      bool same = same_planes;
      for (std::size_t mask = 0; same && mask < wants.size (); mask++)
        same = planes.masks[mask].image != image || has[mask] == wants[mask];
      if (!same)
        plan.images.push_back (image);
    }
    return plan;
  }

  /** The @p images of @p schedule, but for those after a request to @p stop. */
  std::vector<Halves> encode (const Schedule &schedule,
      const std::vector<int> &images, const std::stop_token &stop) const
  {
    const MaskRenderer renderer (schedule, info_.size, options_.placement);
    const PlanePlan planes = plan_planes (schedule);
    std::vector<Halves> encoded;
    for (std::size_t i = 0; i < images.size () && !stop.stop_requested (); i++)
      encoded.push_back (encode_halves (
          renderer.render<PlanePixel> (planes.of_image (images[i])),
          controllers_));
    return encoded;
  }

  Error cancelled () const
  {
    return Error{info_.name + ": upload cancelled", ErrorCode::cancelled};
  }

  /** Leaves no masks to start or to use again. */
  void forget ()
  {
    residents_ = {};
    order_.clear ();
    times_.clear ();
  }

  Result<void> stop_after (Result<void> failed)
  {
    forget ();
    prepared_ = false;
    stop ();
    return failed;
  }

  /** Fails if the board reports that it could not do @p what, which it did not
   * have to acknowledge. */
  Result<void> check_code (const char *what)
  {
    ASSIGN_OR_RETURN (const std::uint8_t code, read_byte (kErrorCode));
    if (code != 0)
      return error (what, error_text (code));
    return {};
  }

  /** Brings the board into the mode in which it takes masks. */
  Result<void> prepare ()
  {
    RETURN_IF_ERROR (wake ());
    RETURN_IF_ERROR (halt ());
    if (prepared_) {
      ASSIGN_OR_RETURN (const std::uint8_t mode, read_byte (kDisplayMode));
      if (mode == kModeOnTheFly)
        return {};
    }
    forget (); // a board that lost its power has no masks
    RETURN_IF_ERROR (write_byte (kIdle, 0));
    RETURN_IF_ERROR (enter (kModeOnTheFly));
    constexpr int kPulse = 20; // us
    std::vector<Setting> settings;
    if (needs_park_cycle (version_))
      settings = {{kPark, {1}}, {kPark, {0}}};
    settings.emplace_back (kTriggerOut2,
        options_.pulse_low ? encode_trigger_out (true, kPulse, 0)
                           : encode_trigger_out (false, 0, kPulse));
    settings.emplace_back (kTriggerIn1,
        encode_trigger_in (
            int (info_.patterns->limits.trigger_delay), options_.falling_edge));
    RETURN_IF_ERROR (write_all (settings));
    prepared_ = true;
    return {};
  }

  Result<void> send (const Schedule &schedule,
      const std::stop_token &stop_token, const UploadProgress &progress)
  {
    RETURN_IF_ERROR (prepare ());
    const UploadPlan plan = plan_upload (schedule);
    forget (); // until all is sent, it is unknown what the board holds
    residents_ = plan.residents;
    order_ = plan.order;
    slots_ = schedule.slots ();
    if (plan.new_table) {
      // Times that every board accepts, until start () knows the real ones.
      const std::vector<PatternTime> times (
          std::size_t (slots_), PatternTime{10'000, 0});
      RETURN_IF_ERROR (send_table (times));
    }
    const auto images = encode (schedule, plan.images, stop_token);
    if (link_->cancelled ())
      return cancelled ();
    return send_images (plan.images, images, progress);
  }

  Result<void> send_table (const std::vector<PatternTime> &times)
  {
    times_.clear ();
    std::vector<Entry> entries (order_.size ());
    for (std::size_t mask = 0; mask < order_.size (); mask++) {
      const std::size_t line = std::size_t (order_[mask]);
      const std::size_t slot = mask % std::size_t (slots_);
      const bool begins_frame = slot == 0;
      const bool pulse = options_.master == Master::camera || begins_frame;
      entries[line] = {.index = std::uint16_t (line),
          .time = times[slot],
          .wait_for_trigger = options_.master == Master::camera && begins_frame,
          .trigger_out_2 = pulse,
          .plane = residents_.planes[line]};
    }
    for (const Entry &entry : entries)
      RETURN_IF_ERROR (write (kDefine, encode_entry (entry)));
    RETURN_IF_ERROR (
        write (kConfigure, encode_configuration (int (entries.size ()))));
    if (!std::is_sorted (order_.begin (), order_.end ())) {
      RETURN_IF_ERROR (link_->post (kReorder, encode_order (order_)));
      RETURN_IF_ERROR (check_code (kReorder.name));
    }
    times_ = times;
    return {};
  }

  /** @p times  of the mask, or of dark mirrors and the mask. */
  Result<void> send_still (
      const StillMask &mask, const std::vector<PatternTime> &times)
  {
    forget ();
    RETURN_IF_ERROR (prepare ());
    // Plane 1 of the image is empty. It stays unknown which masks these are.
    constexpr PlaneSlot kMask{0, 0}, kDark{0, 1};
    residents_.planes = {kMask};
    if (times.size () > 1)
      residents_.planes = {kDark, kMask};
    slots_ = int (times.size ());
    order_.resize (times.size ());
    std::iota (order_.begin (), order_.end (), 0);
    RETURN_IF_ERROR (send_table (times));
    const Halves image = encode_halves (
        render_still<PlanePixel> (mask, info_.size, options_.placement),
        controllers_);
    return send_images ({0}, {image}, [] (int, int) {});
  }

  Result<void> send_images (const std::vector<int> &places,
      const std::vector<Halves> &images, const UploadProgress &progress)
  {
    std::size_t total = 0, done = 0, told = 0;
    for (const Halves &image : images)
      total += packets_of (image);
    total = std::max<std::size_t> (total, 1); // the end is always reported
    const auto sent = [&] (std::size_t packets) {
      constexpr std::size_t kSteps = 200;
      done += packets;
      if (done - told > total / kSteps && done < total) {
        told = done;
        progress (int (done), int (total));
      }
    };

    constexpr std::array<HidCommand, 2> kLoad{kLoadImage, kLoadSecond};
    constexpr std::array<HidCommand, 2> kData{kImageData, kSecondData};
    progress (0, int (total));
    for (std::size_t i = 0; i < images.size (); i++)
      for (std::size_t half = 0; half < images[i].size (); half++)
        if (const auto result = send_half (kLoad[half], kData[half], places[i],
                images[i][half].joined (), sent);
            !result)
          return link_->cancelled () ? cancelled () : result.error ();
    progress (int (total), int (total));
    return {};
  }

  Result<void> send_half (const HidCommand &load, const HidCommand &data,
      int index, const Bytes &half,
      const std::function<void (std::size_t)> &sent)
  {
    RETURN_IF_ERROR (write (load, encode_load (index, half.size ())));
    sent (1);
    for (std::size_t at = 0; at < half.size (); at += kImageChunk) {
      if (link_->cancelled ())
        return cancelled ();
      const auto chunk = ByteView (half).subspan (
          at, std::min (kImageChunk, half.size () - at));
      RETURN_IF_ERROR (link_->post (data, encode_chunk (chunk)));
      sent (hid_packets (kChunkHead + chunk.size ()));
    }
    // The board does not acknowledge data; the code tells if it was unpacked.
    return check_code ("upload masks");
  }

  /** @p times  of the lines of one frame; @p plan  of that frame. */
  Result<void> run (const std::vector<PatternTime> &times, const SlotPlan &plan)
  {
    RETURN_IF_ERROR (halt ());
    if (times != times_)
      RETURN_IF_ERROR (send_table (times));
    RETURN_IF_ERROR (pause_frame (plan));
    RETURN_IF_ERROR (launch ());
    RETURN_IF_ERROR (await (
        kMainStatus, kSequencerRuns, kSequencerRuns, "start the patterns"));
    RETURN_IF_ERROR (check_health ());
    return check_code ("start the patterns");
  }

  const BoardFacts *facts_ = nullptr;
  Version version_;
  int controllers_ = 1;

  bool prepared_ = false;
  Residents residents_;    // empty when unknown
  std::vector<int> order_; // line of the table for each mask, empty: no masks
  int slots_ = 1;
  std::vector<PatternTime> times_; // in the table, empty: other ones
};

} // namespace

Result<std::unique_ptr<Dmd>>
open_dlpc900 (std::unique_ptr<HidLink> link, const DmdOptions &options)
{
  auto dmd = std::make_unique<Dlpc900> (std::move (link), options);
  RETURN_IF_ERROR (dmd->open ());
  return std::unique_ptr<Dmd> (std::move (dmd));
}

} // namespace codedexposure
