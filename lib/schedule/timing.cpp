/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/timing.h"

#include <array>
#include <charconv>
#include <limits>
#include <utility>

#include "base/text.h"

namespace codedexposure
{

namespace
{

__extension__ typedef __int128 Wide;

constexpr Nanoseconds kSecond = 1'000'000'000;

struct Unit {
  std::string_view suffix;
  Nanoseconds nanoseconds;
};
constexpr std::array<Unit, 4> kUnits{
    {{"ns", 1}, {"us", 1000}, {"ms", 1'000'000}, {"s", kSecond}}};

bool
is_digit (char c)
{
  return c >= '0' && c <= '9';
}

} // namespace

Nanoseconds
FrameRate::time_of (std::int64_t index, int part, int parts) const
{
  const Wide in_parts = Wide (index) * parts + part;
  return Nanoseconds (in_parts * den * kSecond / (Wide (num) * parts));
}

std::optional<FrameRate>
FrameRate::of_period (Nanoseconds period)
{
  constexpr Nanoseconds kLargest = std::numeric_limits<int>::max ();
  if (period < 2)
    return std::nullopt;
  /* Continued fraction of a number between those of two ends, in seconds: as
   * long as both have the same terms, they are also those of what is sought. */
  Wide low_num = kSecond, low_den = period + 1;
  Wide high_num = kSecond, high_den = period - 1;
  Wide num = 1, den = 0, num_before = 0, den_before = 1;
  const auto append = [&] (Wide term) {
    num_before = std::exchange (num, term * num + num_before);
    den_before = std::exchange (den, term * den + den_before);
  };
  for (;;) {
    const Wide term = low_num / low_den;
    if ((term + 1) * high_den < high_num) {
      append (term + 1);
      break;
    }
    append (term);
    low_num -= term * low_den;
    high_num -= term * high_den;
    if (low_num == 0) { // 1 / 0 is beyond every number
      append (high_den / high_num + 1);
      break;
    }
    std::swap (low_num, high_den);
    std::swap (high_num, low_den);
  }
  if (num > kLargest || den > kLargest)
    return std::nullopt;
  return FrameRate{int (num), int (den)};
}

Result<SlotPlan>
SlotPlan::fit (const Timing &timing, int slots, FrameRate rate)
{
  if (rate.num <= 0 || rate.den <= 0)
    return Error{
        "a frame rate of " + std::to_string (rate.num) + "/" +
        std::to_string (rate.den) +
        " does not set the length of the slots; set a frame rate above "
        "0"};
  const Nanoseconds period = rate.period ();
  const std::string at = " at " + std::to_string (rate.num) + "/" +
                         std::to_string (rate.den) + " frames/s (" +
                         time_text (period) + " a frame)";

  SlotPlan plan;
  plan.slots_ = slots;
  plan.period_ = period;
  if (timing.active > 0) {
    plan.active_ = timing.active;
    plan.span_ = slots * (timing.active + timing.switching);
  } else {
    plan.span_ = period - timing.readout;
    plan.active_ = plan.span_ / slots - timing.switching;
  }

  if (plan.active_ <= 0)
    return Error{std::to_string (slots) + " slots with " +
                 time_text (timing.switching) + " of switching and " +
                 time_text (timing.readout) +
                 " of readout leave no time for light" + at +
                 "; take fewer slots or a lower frame rate"};
  if (plan.span_ > period - timing.readout)
    return Error{
        std::to_string (slots) + " slots of " + time_text (timing.active) +
        " active + " + time_text (timing.switching) + " switching + " +
        time_text (timing.readout) + " readout need " +
        time_text (plan.span_ + timing.readout) + ", which does not fit" + at +
        "; shorten active, or lower the frame rate"};
  return plan;
}

Nanoseconds
SlotPlan::start (int slot) const
{
  return Nanoseconds (Wide (slot) * span_ / slots_);
}

Result<Nanoseconds>
parse_time (std::string_view text)
{
  const Error malformed{"time " + in_quotes (text) +
                        " is not a number with a unit, such as 9.8ms, "
                        "200us, 105000ns or 0.04s"};
  const auto too_long = [text] {
    return Error{"time " + in_quotes (text) + " is not below an hour"};
  };
  if (text == "0")
    return Nanoseconds (0);

  std::size_t digits = 0;
  while (digits < text.size () && is_digit (text[digits]))
    digits++;
  std::size_t end = digits;
  if (end < text.size () && text[end] == '.')
    for (end++; end < text.size () && is_digit (text[end]);)
      end++;
  if (digits == 0 || end == digits + 1)
    return malformed;

  for (const Unit &unit : kUnits) {
    if (text.substr (end) != unit.suffix)
      continue;
    Nanoseconds whole = 0;
    const auto parsed =
        std::from_chars (text.data (), text.data () + digits, whole);
    if (parsed.ec != std::errc () || whole >= kTimeLimit / unit.nanoseconds)
      return too_long ();

    Nanoseconds time = whole * unit.nanoseconds;
    Nanoseconds place = unit.nanoseconds;
    for (std::size_t i = digits + 1; i < end; i++) {
      place /= 10;
      if (place == 0 && text[i] != '0')
        return Error{
            "time " + in_quotes (text) + " is finer than a nanosecond"};
      time += place * (text[i] - '0');
    }
    return time;
  }
  return malformed;
}

std::string
time_text (Nanoseconds time)
{
  if (time == 0)
    return "0";
  const Unit *unit = &kUnits.front ();
  for (const Unit &candidate : kUnits)
    if (time >= candidate.nanoseconds)
      unit = &candidate;

  std::string text = std::to_string (time / unit->nanoseconds);
  Nanoseconds rest = time % unit->nanoseconds;
  if (rest != 0) {
    text += '.';
    for (Nanoseconds place = unit->nanoseconds / 10; rest != 0; place /= 10) {
      text += char ('0' + rest / place);
      rest %= place;
    }
  }
  return text + std::string (unit->suffix);
}

} // namespace codedexposure
