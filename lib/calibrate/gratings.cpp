/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/gratings.h"

#include <algorithm>
#include <bit>

#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

constexpr std::string_view kInverse = "-inverse";

const char *
axis_text (Axis axis)
{
  return axis == Axis::x ? "x" : axis == Axis::y ? "y" : "both";
}

Error
not_a_pattern (std::string_view text, const std::string &why)
{
  return Error{"pattern " + in_quotes (text) + ": " + why +
               "; patterns are dark, white, grating-AXIS:PERIOD/PHASE and "
               "gray-AXIS:WIDTH/BIT[-inverse]"};
}

/* Axis and numbers of "NAME-AXIS:B/C". */
Result<void>
parse_numbers (std::string_view text, Pattern &pattern)
{
  std::string_view rest = text.substr (text.find ('-') + 1);
  const std::string_view axis = rest.substr (0, rest.find (':'));
  if (axis == "x" || axis == "y" || axis == "both")
    pattern.axis = axis == "x" ? Axis::x : axis == "y" ? Axis::y : Axis::both;
  else
    return not_a_pattern (text, "its axis must be x, y or both");

  rest.remove_prefix (std::min (axis.size () + 1, rest.size ()));
  const auto numbers = split (rest, '/');
  const auto first = parse_int (numbers[0]);
  const auto second =
      numbers.size () == 2 ? parse_int (numbers[1]) : std::nullopt;
  if (!first || !second)
    return not_a_pattern (text, "it must have two whole numbers, as in 4/0");
  pattern.period = *first;
  (pattern.kind == Pattern::Kind::gray ? pattern.bit : pattern.phase) = *second;
  return {};
}

Result<void>
check_numbers (std::string_view text, const Pattern &p)
{
  if (p.kind == Pattern::Kind::grating) {
    if (p.period < Pattern::kMinPeriod || p.period > Pattern::kMaxPeriod ||
        p.period % 2 != 0)
      return not_a_pattern (text, "its period must be even, from 2 to 256");
    if (p.phase < 0 || p.phase >= p.period)
      return not_a_pattern (text, "its phase must be 0 or more and less than "
                                  "its period");
    return {};
  }
  if (p.period < 1 || p.period > Pattern::kMaxPeriod)
    return not_a_pattern (text, "its stripes must be 1 to 256 mirrors wide");
  if (p.bit < 0 || p.bit > Pattern::kMaxBit)
    return not_a_pattern (text, "its bit must be 0 to 13");
  if (p.axis == Axis::both)
    return not_a_pattern (text, "the axis of a Gray code must be x or y");
  return {};
}

} // namespace

Result<Pattern>
Pattern::parse (std::string_view text)
{
  if (text == "dark" || text == "white")
    return Pattern{text == "dark" ? Kind::dark : Kind::white};
  Pattern pattern;
  std::string_view numbers = text;
  if (text.starts_with ("grating-"))
    pattern.kind = Kind::grating;
  else if (text.starts_with ("gray-"))
    pattern.kind = Kind::gray;
  else
    return not_a_pattern (text, "it is not known");
  if (pattern.kind == Kind::gray && text.ends_with (kInverse)) {
    pattern.inverse = true;
    numbers.remove_suffix (kInverse.size ());
  }
  RETURN_IF_ERROR (parse_numbers (numbers, pattern));
  RETURN_IF_ERROR (check_numbers (text, pattern));
  return pattern;
}

std::string
Pattern::text () const
{
  if (kind == Kind::dark || kind == Kind::white)
    return kind == Kind::dark ? "dark" : "white";
  const bool moves = kind == Kind::grating;
  return std::string (moves ? "grating-" : "gray-") + axis_text (axis) + ":" +
         std::to_string (period) + "/" + std::to_string (moves ? phase : bit) +
         (inverse ? std::string (kInverse) : "");
}

bool
Pattern::on (int x, int y) const
{
  const auto lit = [this] (int at) {
    if (kind == Kind::grating)
      return floor_mod (at + phase, period) < period / 2;
    const int stripe = (at - floor_mod (at, period)) / period;
    return (((stripe ^ (stripe >> 1)) >> bit) & 1) != (inverse ? 1 : 0);
  };
  if (kind == Kind::dark || kind == Kind::white)
    return kind == Kind::white;
  return (axis == Axis::y || lit (x)) && (axis == Axis::x || lit (y));
}

Pattern
Pattern::complement () const
{
  Pattern other = *this;
  if (kind == Kind::grating)
    other.phase = (phase + period / 2) % period;
  else if (kind == Kind::gray)
    other.inverse = !inverse;
  else
    other.kind = kind == Kind::dark ? Kind::white : Kind::dark;
  return other;
}

Pattern
live_grating (int period)
{
  return {Pattern::Kind::grating, Axis::both, period};
}

std::vector<Pattern>
calibration_patterns (Extent mirrors, int period)
{
  using Kind = Pattern::Kind;
  std::vector<Pattern> patterns = {{Kind::dark}, {Kind::white}};
  const int width = std::max (1, period / 2);
  for (const auto &[axis, size] :
      {std::pair (Axis::x, mirrors.width), std::pair (Axis::y, mirrors.height)})
    for (int bit = int (std::bit_width (unsigned ((size - 1) / width))) - 1;
         bit >= 0; bit--)
      for (const bool inverse : {false, true})
        patterns.push_back ({Kind::gray, axis, width, 0, bit, inverse});
  for (const Axis axis : {Axis::x, Axis::y})
    for (int phase = 0; phase < period; phase++)
      patterns.push_back ({Kind::grating, axis, period, phase});
  return patterns;
}

} // namespace codedexposure
