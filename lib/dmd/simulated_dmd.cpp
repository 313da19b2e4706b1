/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/simulated_dmd.h"

#include <chrono>
#include <map>
#include <utility>
#include <vector>

#include "base/text.h"
#include "base/try.h"
#include "base/wait.h"
#include "dmd/options.h"

namespace codedexposure
{

std::shared_ptr<SimulatedMirrors>
SimulatedMirrors::find (const std::string &name)
{
  static std::mutex lock;
  static std::map<std::string, std::weak_ptr<SimulatedMirrors>> known;

  const std::lock_guard guard (lock);
  std::weak_ptr<SimulatedMirrors> &slot = known[name];
  std::shared_ptr<SimulatedMirrors> mirrors = slot.lock ();
  if (!mirrors) {
    mirrors = std::make_shared<SimulatedMirrors> ();
    slot = mirrors;
  }
  return mirrors;
}

void
SimulatedMirrors::release ()
{
  stop ();
  const std::lock_guard guard (lock_);
  is_claimed_ = false;
}

void
SimulatedMirrors::program (const Schedule &schedule)
{
  stop ();
  const std::lock_guard guard (lock_);
  schedule_ = schedule;
  slots_ = schedule.slots ();
  hold_.reset ();
}

void
SimulatedMirrors::hold (StillMask mask, int slots)
{
  stop ();
  const std::lock_guard guard (lock_);
  slots_ = slots;
  hold_ = std::make_shared<const StillMask> (std::move (mask));
}

void
SimulatedMirrors::start ()
{
  const std::lock_guard guard (lock_);
  if (motion_ == Motion::parked)
    motion_ = Motion::armed;
}

void
SimulatedMirrors::stop ()
{
  const std::lock_guard guard (lock_);
  owes_dark_exposure_ |= motion_ == Motion::stepping;
  motion_ = Motion::parked;
}

void
SimulatedMirrors::begin_exposure ()
{
  if (motion_ == Motion::stepping)
    return;
  if (motion_ == Motion::armed && !owes_dark_exposure_) {
    motion_ = Motion::stepping;
    held_ = hold_;
    offset_ = 0;
  }
  owes_dark_exposure_ = false;
}

std::optional<int>
SimulatedMirrors::mask_in_slot (std::int64_t slot)
{
  const std::lock_guard guard (lock_);
  return decide (slot);
}

SimulatedMirrors::View::View (
    std::shared_ptr<SimulatedMirrors> mirrors, bool leads)
    : mirrors_ (std::move (mirrors)), leads_ (leads)
{
  const std::lock_guard guard (mirrors_->lock_);
  mirrors_->leading_ += leads_;
}

SimulatedMirrors::View::~View ()
{
  {
    const std::lock_guard guard (mirrors_->lock_);
    mirrors_->leading_ -= leads_;
    mirrors_->seen_.clear ();
  }
  mirrors_->moved_.notify_all ();
}

std::optional<int>
SimulatedMirrors::View::mask_in_slot (std::int64_t slot)
{
  constexpr std::size_t kMost = 4096;
  /* For a leading view that stands still. */
  constexpr std::chrono::seconds kPatience (2);
  std::unique_lock guard (mirrors_->lock_);
  auto &seen = mirrors_->seen_;
  if (slot <= last_)
    seen.clear (); // it counts anew
  last_ = slot;
  if (!leads_)
    mirrors_->moved_.wait_for (guard, kPatience,
        [&] { return mirrors_->leading_ == 0 || seen.contains (slot); });
  if (leads_ || !seen.contains (slot)) {
    const auto mask = mirrors_->decide (slot);
    seen.insert_or_assign (slot, Seen{mask, mirrors_->held_});
  }
  const Seen found = seen.at (slot);
  while (seen.size () > kMost)
    seen.erase (seen.begin ());
  held_ = found.held;
  guard.unlock ();
  mirrors_->moved_.notify_all ();
  return found.mask;
}

/* Under the lock. */
std::optional<int>
SimulatedMirrors::decide (std::int64_t slot)
{
  if (slots_ == 0)
    return std::nullopt;
  if (slot % slots_ == 0)
    begin_exposure ();
  for (; !slips_.empty () && slips_.front ().slot <= slot; slips_.pop_front ())
    offset_ += slips_.front ().by;
  if (motion_ != Motion::stepping)
    return std::nullopt;
  if (held_)
    return held_->in_slot (int (slot % slots_)) ? kStillMask : kOffMask;

  const std::int64_t masks = schedule_->masks ();
  const std::int64_t mask = (slot - offset_) % masks;
  return int (mask < 0 ? mask + masks : mask);
}

namespace
{

enum class Failure { none, open, upload, start, restart };

using Slip = SimulatedMirrors::Slip;

struct Options {
  std::string mirrors;
  DmdInfo info;
  SimulatedMirrors::Shape shape;
  Nanoseconds mask_time = 0;
  std::vector<Slip> slips;
  Failure failure = Failure::none;
};

class SimulatedDmd : public Dmd
{
public:
  /** @p mirrors  that it has claimed. */
  SimulatedDmd (Options options, std::shared_ptr<SimulatedMirrors> mirrors)
      : options_ (std::move (options)), mirrors_ (std::move (mirrors))
  {
    mirrors_->set_shape (options_.shape);
    for (const Slip &slip : options_.slips)
      mirrors_->slip_at (slip.slot, slip.by);
  }
  ~SimulatedDmd () override { mirrors_->release (); }

  const DmdInfo &info () const override { return options_.info; }

  Result<void> upload (const Schedule &schedule, std::stop_token stop,
      const UploadProgress &progress) override
  {
    const int masks = schedule.masks ();
    for (int sent = 0; sent < masks; sent++) {
      progress (sent, masks);
      if (!send_mask (stop))
        return Error{options_.info.name + ": upload cancelled after " +
                         std::to_string (sent) + " of " +
                         std::to_string (masks) + " masks",
            ErrorCode::cancelled};
      if (options_.failure == Failure::upload)
        return failed ("upload");
    }
    mirrors_->program (schedule);
    progress (masks, masks);
    return {};
  }

  Result<void> start (const SlotPlan &, std::stop_token) override
  {
    if (!mirrors_->schedule ())
      return Error{options_.info.name + ": no masks to start; upload first"};
    const Failure now = started_ ? Failure::restart : Failure::start;
    if (options_.failure == now)
      return failed (started_ ? "restart" : "start");
    started_ = true;
    mirrors_->start ();
    return {};
  }

  Result<void> show (const StillMask &mask, const SlotPlan &plan,
      std::stop_token stop) override
  {
    if (!options_.info.still_masks)
      return Dmd::show (mask, plan, stop);
    if (!send_mask (stop))
      return Error{options_.info.name + ": sending " + mask.name + " cancelled",
          ErrorCode::cancelled};
    mirrors_->hold (mask, plan.slots ());
    mirrors_->start ();
    return {};
  }
  void stop () override { mirrors_->stop (); }
  bool running () const override { return mirrors_->running (); }

private:
  /** Takes as long as a mask takes; false if told to stop meanwhile. */
  bool send_mask (const std::stop_token &stop) const
  {
    return wait_for (stop, std::chrono::nanoseconds (options_.mask_time));
  }

  Error failed (const char *what) const
  {
    return Error{options_.info.name + ": " + what +
                     " failed, as its 'fail' option asks for",
        ErrorCode::device};
  }

  Options options_;
  std::shared_ptr<SimulatedMirrors> mirrors_;
  bool started_ = false;
};

std::optional<int>
parse_masks (std::string_view text)
{
  const auto masks = parse_int (text);
  return masks.value_or (0) >= 1 ? masks : std::nullopt;
}

bool
add_slip (std::string_view text, std::vector<Slip> &slips)
{
  constexpr int kMaxSlip = 1024;
  const auto parts = split (text, ':');
  const auto slot = parse_int (parts.front ());
  const auto by = parts.size () == 2 ? parse_int (parts.back ()) : 1;
  if (parts.size () > 2 || !slot || *slot < 0 || !by || *by < -kMaxSlip ||
      (!slips.empty () && slips.back ().slot > *slot))
    return false;
  slips.push_back ({*slot, *by});
  return true;
}

Result<Options>
parse_options (std::string_view device)
{
  Options o;
  DmdInfo &info = o.info;
  info.resident_masks = 512;
  info.still_masks = true;
  const auto parse_serial = [] (std::string_view text) {
    return std::optional (std::string (text));
  };
  const DeviceKey keys[] = {value_key ("size", "WxH", o.shape.size, parse_size),
      value_key (
          "layout", "address|lattice|cell", o.shape.diamond, parse_layout),
      value_key ("masks", "N", info.resident_masks, parse_masks),
      value_key ("min-active", "TIME", info.minimum_active, parse_time),
      value_key ("min-switching", "TIME", info.minimum_switching, parse_time),
      value_key ("mask-time", "TIME", o.mask_time, parse_time),
      value_key ("serial", "TEXT", info.serial, parse_serial),
      choice_key ("still", info.still_masks, {{"yes", true}, {"no", false}}),
      choice_key (
          "triggers", info.triggers_camera, {{"yes", true}, {"no", false}}),
      {"slip-at", "SLOT[:BY], slots ascending",
          [&o] (std::string_view text) { return add_slip (text, o.slips); }},
      choice_key ("fail", o.failure,
          {{"open", Failure::open}, {"upload", Failure::upload},
              {"start", Failure::start}, {"restart", Failure::restart}})};
  ASSIGN_OR_RETURN (o.mirrors, parse_device (device, keys));
  if (o.mirrors.empty ())
    return Error{"DMD " + in_quotes (device) +
                 " has no name; write sim:NAME, such as sim:bench"};
  info.name = "sim:" + o.mirrors;
  info.size = o.shape.size.value_or (Extent{1024, 768});
  if (o.shape.diamond)
    info.array = Array::diamond;
  return o;
}

} // namespace

Result<std::unique_ptr<Dmd>>
open_simulated_dmd (std::string_view device)
{
  ASSIGN_OR_RETURN (Options options, parse_options (device));
  if (options.failure == Failure::open)
    return Error{
        options.info.name + ": open failed, as its 'fail' option asks for",
        ErrorCode::device};
  auto mirrors = SimulatedMirrors::find (options.mirrors);
  if (!mirrors->claim ())
    return Error{options.info.name +
                     " is in use: another driver of this process, such as a "
                     "second dmdsync, controls it. Close that one first, or "
                     "choose another name",
        ErrorCode::busy};
  return std::unique_ptr<Dmd> (std::make_unique<SimulatedDmd> (
      std::move (options), std::move (mirrors)));
}

} // namespace codedexposure
