/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dlpc900.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>

#include "base/text.h"
#include "dmd/dlp_controller.h"
#include "dmd/dlpc900_protocol.h"
#include "dmd/plane_image.h"

namespace codedexposure
{

namespace
{

using namespace dlpc900;

constexpr Nanoseconds kPacketTime = 1'000'000; // full-speed interrupt transfer
constexpr std::uint32_t kLongestTime = 0xFFFFFF;
/** Black that it puts before a mask that waits for the camera, us. */
constexpr std::uint32_t kTriggerDark = 105;
constexpr int kShortestTriggerDelay = 104;
/** Entries whose order fits in one message. */
constexpr int kMaxOrder = int (kHidRequestData - 6) / 2;
/** Of the hardware status: DMD of another kind, resets, forced swap, sequencer.
 */
constexpr std::uint8_t kFailures = 0xCE;

/** The reason of a refusal: a number, and a text if the board has one. */
std::string
explain (DlpController &board)
{
  const auto code = board.link ().read (kErrorCode);
  if (!code || code->refused || code->data.empty ())
    return "refused, for a reason that it does not tell";
  std::string reason = error_text (code->data.front ());
  const auto text = board.link ().read (kErrorText);
  if (text && !text->refused) {
    const std::string own (text->data.begin (),
        std::find (text->data.begin (), text->data.end (), 0));
    if (!own.empty ())
      reason += ", " + in_quotes (own);
  }
  return reason;
}

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
  std::vector<int> images = {}; ///< that are sent
};

/** Which of the masks that a board has is each of those that are wanted, where
 * they are the same ones in another order that fits in one message. */
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

/** An encoded image: one half for each of the board's controllers. */
using Halves = std::vector<PiecedBytes>;

Halves
encode_halves (const MirrorRows<PlanePixel> &image, int count, std::size_t unit)
{
  const int width = image.width () / count;
  Halves halves;
  for (int half = 0; half < count; half++)
    halves.push_back (encode_image (image, half * width, width, unit));
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

/** The images of one schedule, each rendered and encoded once: for the time
 * that they take, and to be sent. */
class EncodedImages
{
public:
  EncodedImages (const Schedule &schedule, Extent size, int controllers,
      const DmdOptions &options)
      : renderer_ (schedule, size, options.placement),
        plan_ (plan_planes (schedule)), controllers_ (controllers),
        unit_ (options.erle_unit)
  {
  }

  const Schedule &schedule () const { return renderer_.schedule (); }
  const Halves &get (int image)
  {
    const auto [found, is_new] = images_.try_emplace (image);
    if (is_new)
      found->second =
          encode_halves (renderer_.render<PlanePixel> (plan_.of_image (image)),
              controllers_, unit_);
    return found->second;
  }

private:
  MaskRenderer renderer_;
  PlanePlan plan_;
  int controllers_;
  std::size_t unit_;
  std::map<int, Halves> images_;
};

class Dlpc900 : public Dmd
{
public:
  Dlpc900 (std::unique_ptr<HidLink> link, const DmdOptions &options)
      : options_ (options), board_ (std::move (link), kFailures, explain)
  {
  }
  ~Dlpc900 () override;

  Result<void> open ();

  const DmdInfo &info () const override { return info_; }
  Result<DmdStatus> status () override;
  Nanoseconds upload_time (
      const Schedule &schedule, std::stop_token stop) override;
  Result<void> upload (const Schedule &schedule, std::stop_token stop,
      const UploadProgress &progress) override;
  Result<void> start (const SlotPlan &plan, std::stop_token stop) override;
  Result<void> show (const StillMask &mask, const SlotPlan &plan,
      std::stop_token stop) override;
  void stop () override;
  bool running () const override { return running_; }

private:
  PatternLimits limits () const;
  bool dual () const { return (hardware_status_ & kSecondController) != 0; }
  int controllers () const { return dual () ? 2 : 1; }
  UploadPlan plan_upload (const Schedule &schedule) const;
  EncodedImages &images_of (const Schedule &schedule);

  void forget ();
  void begin (std::stop_token stop = {});
  Result<void> prepare ();
  Result<void> send (const Schedule &schedule, const UploadPlan &plan,
      const UploadProgress &progress);
  Result<void> send_table (const std::vector<PatternTime> &times);
  Result<void> send_still (
      const StillMask &mask, const std::vector<PatternTime> &times);
  Result<void> send_images (const std::vector<int> &images,
      const std::function<const Halves &(int image)> &encoded,
      const UploadProgress &progress);
  Result<void> send_half (const HidCommand &load, const HidCommand &data,
      int index, const Bytes &half,
      const std::function<void (std::size_t)> &sent);
  Result<void> run (
      const std::vector<PatternTime> &times, const SlotPlan &plan);

  DmdOptions options_;
  DlpController board_;
  DmdInfo info_;
  Board kind_ = {};
  Version version_;
  std::uint8_t hardware_status_ = 0;

  bool touched_ = false; // it shows, or may show, what it was told here
  bool running_ = false;
  bool prepared_ = false;
  Residents residents_;    // empty when unknown
  std::vector<int> order_; // line of the table for each mask, empty: no masks
  int slots_ = 1;
  std::vector<PatternTime> times_;      // in the table, empty: other ones
  std::optional<EncodedImages> images_; // until they are sent
};

Dlpc900::~Dlpc900 ()
{
  if (!touched_)
    return;
  stop ();
  // Mirrors live longer when they move while nothing is shown.
  if (!running_ && !board_.link ().gone ())
    (void)board_.write_byte (kIdle, 1);
}

Result<void>
Dlpc900::open ()
{
  begin ();
  const auto version = board_.read (kVersion);
  if (!version)
    return version.error ();
  const auto parsed = parse_version (*version);
  const auto hardware = board_.read_byte (kHardware);
  if (!hardware)
    return hardware.error ();
  const auto kind = find_board (*hardware);
  for (const auto &wrong : {parsed ? "" : parsed.error ().message,
           kind ? "" : kind.error ().message})
    if (!wrong.empty ())
      return board_.link ().error ("open it", wrong);
  version_ = *parsed;
  kind_ = *kind;
  const auto status = board_.read_byte (kHardwareStatus);
  if (!status)
    return status.error ();
  hardware_status_ = *status;

  info_.name = board_.link ().name () + " (" + kind_.name + ")";
  info_.size = kind_.size;
  info_.minimum_active = Nanoseconds (kind_.minimum_exposure) * 1000;
  info_.resident_masks = std::min (kind_.planes, kMaxEntries);
  info_.triggers_camera = options_.master == Master::dmd;
  info_.still_masks = true;
  info_.trigger_in = info_.trigger_out = true;
  info_.minimum_dark = Nanoseconds (kind_.minimum_exposure) * 1000;
  // Firmware without this command has the minima of the table.
  if (const auto minima = board_.read (kMinimumExposures))
    if (const auto exposures = parse_minimum_exposures (*minima))
      info_.minimum_active = Nanoseconds (exposures->front ()) * 1000;

  if (options_.trigger_delay < kShortestTriggerDelay * 1000 ||
      options_.trigger_delay > 0xFFFF * 1000)
    return Error{info_.name + ": a trigger-delay of " +
                 time_text (options_.trigger_delay) +
                 " cannot be had; give it 104us to 65535us"};
  if (!options_.images.empty ())
    return Error{info_.name + ": takes its masks over USB; leave out images="};
  if (options_.placement.region)
    info_.region = {
        options_.placement.region->width, options_.placement.region->height};
  return check_placement (options_.placement, info_.array, info_.size);
}

PatternLimits
Dlpc900::limits () const
{
  return {std::uint32_t (info_.minimum_active / 1000), kLongestTime,
      kind_.minimum_exposure, std::uint32_t (options_.trigger_delay / 1000),
      kTriggerDark};
}

Result<DmdStatus>
Dlpc900::status ()
{
  begin ();
  auto status = board_.status ();
  if (status)
    status->details.insert (status->details.begin (),
        {{"controller", "DLPC900"}, {"mirrors", kind_.name},
            {"firmware", version_.text ()},
            {"controllers", std::to_string (controllers ())}});
  return status;
}

EncodedImages &
Dlpc900::images_of (const Schedule &schedule)
{
  if (!images_ || !(images_->schedule () == schedule))
    images_.emplace (schedule, info_.size, controllers (), options_);
  return *images_;
}

UploadPlan
Dlpc900::plan_upload (const Schedule &schedule) const
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
      order && version_.major >= 5) {
    plan.order = *order;
    plan.residents = residents_;
    plan.new_table = false;
    return plan;
  }

  // Images stay as they are only under a table of the same planes.
  const bool same_planes = residents_.planes == plan.residents.planes;
  for (int image = planes.images - 1; image >= 0; image--) {
    bool same = same_planes;
    for (std::size_t mask = 0; same && mask < wants.size (); mask++)
      same = planes.masks[mask].image != image || has[mask] == wants[mask];
    if (!same)
      plan.images.push_back (image); // the highest first
  }
  return plan;
}

Nanoseconds
Dlpc900::upload_time (const Schedule &schedule, std::stop_token stop_token)
{
  std::size_t packets = 0;
  for (const int image : plan_upload (schedule).images)
    if (!stop_token.stop_requested ())
      packets += packets_of (images_of (schedule).get (image));
  return Nanoseconds (packets) * kPacketTime;
}

Result<void>
Dlpc900::upload (const Schedule &schedule, std::stop_token stop_token,
    const UploadProgress &progress)
{
  if (schedule.masks () > info_.resident_masks)
    return Error{info_.name + " holds " +
                 std::to_string (info_.resident_masks) + " masks, not " +
                 std::to_string (schedule.masks ())};
  const UploadPlan plan = plan_upload (schedule);
  touched_ = true;
  begin (stop_token);
  const auto sent = send (schedule, plan, progress);
  images_.reset ();
  if (!sent) {
    forget ();
    prepared_ = false;
    stop ();
  }
  return sent;
}

Result<void>
Dlpc900::send (const Schedule &schedule, const UploadPlan &plan,
    const UploadProgress &progress)
{
  forget (); // until all is sent, nobody knows what the board holds
  if (const auto ready = prepare (); !ready)
    return ready;
  residents_ = plan.residents;
  order_ = plan.order;
  slots_ = schedule.slots ();
  if (plan.new_table && options_.table_first) {
    // Times that every board keeps, until start () knows better.
    const std::vector<PatternTime> times (
        std::size_t (slots_), PatternTime{10'000, 0});
    if (const auto table = send_table (times); !table)
      return table;
  }
  const auto encoded = [this, &schedule] (int image) -> const Halves & {
    return images_of (schedule).get (image);
  };
  return send_images (plan.images, encoded, progress);
}

/** There are no masks to start or to use again. */
void
Dlpc900::forget ()
{
  residents_ = {};
  order_.clear ();
  times_.clear ();
}

void
Dlpc900::begin (std::stop_token stop_token)
{
  board_.link ().begin (std::move (stop_token), options_.patience);
}

/** Brings the board into the mode in which it takes masks. */
Result<void>
Dlpc900::prepare ()
{
  if (const auto stopped = board_.halt (); !stopped || prepared_)
    return stopped;
  running_ = false;
  if (const auto awake = board_.write_byte (kIdle, 0); !awake)
    return awake;
  if (const auto entered = board_.enter (kModeOnTheFly); !entered)
    return entered;
  constexpr int kPulse = 20; // us
  const Bytes pulse = options_.pulse_low
                          ? encode_trigger_out (true, kPulse, 0)
                          : encode_trigger_out (false, 0, kPulse);
  std::vector<std::pair<HidCommand, Bytes>> steps;
  if (needs_park_cycle (version_)) {
    steps.push_back ({kPark, {1}});
    steps.push_back ({kPark, {0}});
  }
  steps.push_back ({kTriggerOut2, pulse});
  steps.push_back (
      {kTriggerIn1, encode_trigger_in (int (options_.trigger_delay / 1000),
                        options_.falling_edge)});
  for (const auto &[command, data] : steps)
    if (const auto done = board_.write (command, data); !done)
      return done;
  prepared_ = true;
  return {};
}

Result<void>
Dlpc900::send_table (const std::vector<PatternTime> &times)
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
        .trigger_out_2 = pulse == options_.trigger2_bit_disables,
        .plane = residents_.planes[line]};
  }
  for (const Entry &entry : entries)
    if (const auto done = board_.write (kDefine, encode_entry (entry)); !done)
      return done;
  const auto taken = board_.write (
      kConfigure, encode_configuration (int (entries.size ()), 0));
  if (!taken)
    return taken;
  if (!std::is_sorted (order_.begin (), order_.end ()))
    if (const auto moved =
            board_.link ().post (kReorder, encode_order (order_, 0));
        !moved)
      return moved;
  times_ = times;
  return {};
}

Result<void>
Dlpc900::send_images (const std::vector<int> &images,
    const std::function<const Halves &(int image)> &encoded,
    const UploadProgress &progress)
{
  const Error cancelled{info_.name + ": upload cancelled"};
  std::size_t total = 0, done = 0, told = 0;
  for (const int index : images) {
    if (board_.link ().cancelled ())
      return cancelled;
    total += packets_of (encoded (index));
  }
  total = std::max<std::size_t> (total, 1); // there is an end to tell of
  const auto sent = [&] (std::size_t packets) {
    constexpr std::size_t kSteps = 200;
    done += packets;
    if (done - told > total / kSteps && done < total) {
      told = done;
      progress (int (done), int (total));
    }
  };

  progress (0, int (total));
  for (const int index : images) {
    const Halves &halves = encoded (index);
    auto half = send_half (
        kLoadImage, kImageData, index, halves.front ().joined (), sent);
    if (half && dual ())
      half = send_half (
          kLoadSecond, kSecondData, index, halves.back ().joined (), sent);
    if (!half)
      return board_.link ().cancelled () ? cancelled : half;
  }
  progress (int (total), int (total));
  return {};
}

Result<void>
Dlpc900::send_half (const HidCommand &load, const HidCommand &data, int index,
    const Bytes &half, const std::function<void (std::size_t)> &sent)
{
  if (const auto announced =
          board_.write (load, encode_load (index, half.size ()));
      !announced)
    return announced;
  sent (1);
  for (std::size_t at = 0; at < half.size (); at += kImageChunk) {
    if (board_.link ().cancelled ())
      return Error{"cancelled", ErrorCode::cancelled};
    const auto chunk =
        ByteView (half).subspan (at, std::min (kImageChunk, half.size () - at));
    if (const auto posted = board_.link ().post (data, encode_chunk (chunk));
        !posted)
      return posted;
    sent ((chunk.size () + 8 + kHidPacketSize - 1) / kHidPacketSize);
  }
  // Data is not acknowledged; whether it could be unpacked is in the code.
  const auto code = board_.read_byte (kErrorCode);
  if (!code)
    return code.error ();
  if (*code != 0)
    return board_.link ().error ("upload masks", error_text (*code));
  return {};
}

Result<void>
Dlpc900::start (const SlotPlan &plan, std::stop_token stop_token)
{
  if (order_.empty ())
    return Error{info_.name + ": no masks to start; upload first"};
  if (plan.slots () != slots_)
    return Error{info_.name + ": the masks are for " + std::to_string (slots_) +
                 " slots, not for " + std::to_string (plan.slots ())};
  const auto times = fit_patterns (plan, limits (), options_.master);
  if (!times)
    return times.error ().with_prefix (info_.name + ": ");
  begin (std::move (stop_token));
  return run (*times, plan);
}

/** @p times  of the lines of one frame; @p plan  of that frame. */
Result<void>
Dlpc900::run (const std::vector<PatternTime> &times, const SlotPlan &plan)
{
  if (const auto stopped = board_.halt (); !stopped)
    return stopped;
  running_ = false;
  if (times != times_)
    if (const auto table = send_table (times); !table)
      return table;
  // A whole exposure without masks, or without a trigger.
  if (const auto passed = board_.link ().pause (
          std::chrono::milliseconds (plan.frame_period () / 1'000'000 + 1));
      !passed)
    return passed;
  running_ = true;
  if (const auto asked = board_.write_byte (kRun, kRunStart); !asked)
    return asked;
  if (const auto runs = board_.await (
          kMainStatus, kSequencerRuns, kSequencerRuns, "start the patterns");
      !runs)
    return runs;
  return board_.check_health ();
}

Result<void>
Dlpc900::show (
    const StillMask &mask, const SlotPlan &plan, std::stop_token stop_token)
{
  const auto times = fit_patterns (plan, limits (), options_.master);
  if (!times)
    return times.error ().with_prefix (info_.name + ": ");
  touched_ = true;
  const std::vector<PatternTime> still{
      first_patterns (*times, mask.slots, limits ().minimum_dark)};
  begin (std::move (stop_token));
  const auto sent = send_still (mask, still);
  if (!sent) {
    forget ();
    prepared_ = false;
    stop ();
    return sent;
  }
  return run (still, plan);
}

Result<void>
Dlpc900::send_still (
    const StillMask &mask, const std::vector<PatternTime> &times)
{
  forget ();
  if (const auto ready = prepare (); !ready)
    return ready;
  residents_.planes = {{0, 0}}; // no schedule has one mask: it stays unknown
  order_ = {0};
  slots_ = 1;
  if (options_.table_first)
    if (const auto table = send_table (times); !table)
      return table;
  const Halves image = encode_halves (
      render_still<PlanePixel> (mask, info_.size, options_.placement),
      controllers (), options_.erle_unit);
  return send_images (
      {0}, [&] (int) -> const Halves & { return image; }, [] (int, int) {});
}

void
Dlpc900::stop ()
{
  running_ = !board_.stop () && running_;
}

} // namespace

Result<std::unique_ptr<Dmd>>
open_dlpc900 (std::unique_ptr<HidLink> link, const DmdOptions &options)
{
  auto dmd = std::make_unique<Dlpc900> (std::move (link), options);
  if (const auto opened = dmd->open (); !opened)
    return opened.error ();
  return std::unique_ptr<Dmd> (std::move (dmd));
}

} // namespace codedexposure
