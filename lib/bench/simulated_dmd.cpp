/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/simulated_dmd.h"

#include <charconv>
#include <condition_variable>
#include <map>
#include <vector>

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
SimulatedMirrors::program (const Schedule &schedule)
{
  stop ();
  const std::lock_guard guard (lock_);
  schedule_ = schedule;
  hold_.reset ();
}

void
SimulatedMirrors::hold (StillMask mask)
{
  stop ();
  const std::lock_guard guard (lock_);
  hold_ = std::make_shared<const StillMask> (std::move (mask));
}

std::shared_ptr<const StillMask>
SimulatedMirrors::held () const
{
  const std::lock_guard guard (lock_);
  return held_;
}

void
SimulatedMirrors::lay (std::optional<MirrorLayout> diamond)
{
  const std::lock_guard guard (lock_);
  diamond_ = diamond;
}

std::optional<MirrorLayout>
SimulatedMirrors::diamond () const
{
  const std::lock_guard guard (lock_);
  return diamond_;
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

bool
SimulatedMirrors::running () const
{
  const std::lock_guard guard (lock_);
  return motion_ != Motion::parked;
}

std::optional<Schedule>
SimulatedMirrors::schedule () const
{
  const std::lock_guard guard (lock_);
  return schedule_;
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
  if (!schedule_)
    return std::nullopt;
  if (slot % schedule_->slots () == 0)
    begin_exposure ();
  for (; !slips_.empty () && slips_.front ().slot <= slot; slips_.pop_front ())
    offset_ += slips_.front ().by;
  if (motion_ != Motion::stepping)
    return std::nullopt;
  if (held_)
    return slot % schedule_->slots () < held_->slots ? kStillMask : kOffMask;

  const std::int64_t masks = schedule_->masks ();
  const std::int64_t mask = (slot - offset_) % masks;
  return int (mask < 0 ? mask + masks : mask);
}

void
SimulatedMirrors::slip_at (std::int64_t slot, int by)
{
  const std::lock_guard guard (lock_);
  slips_.push_back ({slot, by});
}

namespace
{

enum class Failure { none, open, upload, start, restart };

struct Slip {
  std::int64_t slot = 0;
  int by = 1;
};

/** What the device string says. */
struct Options {
  std::string mirrors;
  DmdInfo info;
  std::optional<MirrorLayout> diamond;
  Nanoseconds mask_time = 0;
  std::vector<Slip> slips;
  Failure failure = Failure::none;
};

class SimulatedDmd : public Dmd
{
public:
  explicit SimulatedDmd (Options options)
      : options_ (std::move (options)),
        mirrors_ (SimulatedMirrors::find (options_.mirrors))
  {
    mirrors_->lay (options_.diamond);
    for (const Slip &slip : options_.slips)
      mirrors_->slip_at (slip.slot, slip.by);
  }
  ~SimulatedDmd () override { mirrors_->stop (); }

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

  Result<void> show (
      const StillMask &mask, const SlotPlan &, std::stop_token stop) override
  {
    if (!mirrors_->schedule ())
      return Error{options_.info.name + ": no masks; upload first"};
    if (!send_mask (stop))
      return Error{options_.info.name + ": sending " + mask.name + " cancelled",
          ErrorCode::cancelled};
    mirrors_->hold (mask);
    mirrors_->start ();
    return {};
  }
  void stop () override { mirrors_->stop (); }
  bool running () const override { return mirrors_->running (); }

private:
  /** Takes as long as a mask takes; false when told to stop meanwhile. */
  bool send_mask (std::stop_token stop) const
  {
    std::mutex lock;
    std::condition_variable_any never;
    std::unique_lock guard (lock);
    never.wait_for (guard, stop, std::chrono::nanoseconds (options_.mask_time),
        [] { return false; });
    return !stop.stop_requested ();
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

template <typename Number>
bool
parse_number (std::string_view text, Number lowest, Number &number)
{
  const char *end = text.data () + text.size ();
  if (!text.empty () && text.front () == '+')
    text.remove_prefix (1);
  const auto parsed = std::from_chars (text.data (), end, number);
  return parsed.ec == std::errc () && parsed.ptr == end && number >= lowest;
}

bool
parse_time_into (std::string_view text, Nanoseconds &time)
{
  const Result<Nanoseconds> parsed = parse_time (text);
  if (parsed)
    time = *parsed;
  return parsed.ok ();
}

bool
parse_size (std::string_view text, Extent &size)
{
  const std::size_t cross = text.find ('x');
  return cross != text.npos &&
         parse_number (text.substr (0, cross), 1, size.width) &&
         parse_number (text.substr (cross + 1), 1, size.height);
}

bool
parse_slip (std::string_view text, std::vector<Slip> &slips)
{
  const std::size_t colon = text.find (':');
  Slip slip;
  if (!parse_number (text.substr (0, colon), std::int64_t (0), slip.slot))
    return false;
  if (colon != text.npos &&
      !parse_number (text.substr (colon + 1), -1024, slip.by))
    return false;
  slips.push_back (slip);
  return slips.size () < 2 || slips[slips.size () - 2].slot <= slip.slot;
}

bool
parse_failure (std::string_view text, Failure &failure)
{
  static const std::map<std::string_view, Failure> names{
      {"open", Failure::open}, {"upload", Failure::upload},
      {"start", Failure::start}, {"restart", Failure::restart}};
  const auto found = names.find (text);
  if (found != names.end ())
    failure = found->second;
  return found != names.end ();
}

bool
set_option (Options &options, std::string_view key, std::string_view value)
{
  if (key == "size")
    return parse_size (value, options.info.size);
  if (key == "layout") {
    const auto layout = parse_layout (value);
    if (layout)
      options.diamond = *layout;
    options.info.array = Array::diamond;
    return layout.ok ();
  }
  if (key == "masks")
    return parse_number (value, 1, options.info.resident_masks);
  if (key == "min-active")
    return parse_time_into (value, options.info.minimum_active);
  if (key == "min-switching")
    return parse_time_into (value, options.info.minimum_switching);
  if (key == "mask-time")
    return parse_time_into (value, options.mask_time);
  if (key == "still") {
    options.info.still_masks = value == "yes";
    return value == "yes" || value == "no";
  }
  if (key == "slip-at")
    return parse_slip (value, options.slips);
  if (key == "fail")
    return parse_failure (value, options.failure);
  return false;
}

Result<Options>
parse_options (std::string_view device)
{
  Options options;
  std::string_view rest = device.substr (std::string_view ("sim:").size ());
  const std::size_t name_end = std::min (rest.find (','), rest.size ());
  options.mirrors = std::string (rest.substr (0, name_end));
  options.info.name = "sim:" + options.mirrors;
  options.info.size = {1024, 768};
  options.info.resident_masks = 512;
  options.info.still_masks = true;
  if (options.mirrors.empty ())
    return Error{"DMD '" + std::string (device) +
                 "' has no name; write sim:NAME, such as sim:bench"};

  rest.remove_prefix (name_end);
  while (!rest.empty ()) {
    rest.remove_prefix (1);
    const std::string_view option = rest.substr (0, rest.find (','));
    const std::size_t equals = option.find ('=');
    const std::string_view value =
        equals == option.npos ? "" : option.substr (equals + 1);
    if (!set_option (options, option.substr (0, equals), value))
      return Error{
          "DMD '" + std::string (device) + "': cannot use '" +
          std::string (option) +
          "'; options of a simulated DMD are size=WxH, "
          "layout=address|lattice|cell, masks=N, "
          "min-active=TIME, min-switching=TIME, mask-time=TIME, "
          "still=yes|no, "
          "slip-at=SLOT[:BY] (slots ascending), fail=open|upload|start|"
          "restart"};
    rest.remove_prefix (option.size ());
  }
  return options;
}

} // namespace

Result<std::unique_ptr<Dmd>>
open_simulated_dmd (std::string_view device)
{
  Result<Options> options = parse_options (device);
  if (!options)
    return options.error ();
  if (options->failure == Failure::open)
    return Error{
        options->info.name + ": open failed, as its 'fail' option asks for",
        ErrorCode::device};
  return std::unique_ptr<Dmd> (
      std::make_unique<SimulatedDmd> (*std::move (options)));
}

void
serve_simulated_dmds ()
{
  add_dmd_scheme ({"sim:", "sim:NAME (a simulated DMD)", open_simulated_dmd});
}

} // namespace codedexposure
