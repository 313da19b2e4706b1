/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Presets, the one-line text form of schedules, and where a text is a path. */
#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include "base/file.h"
#include "base/text.h"
#include "base/try.h"
#include "schedule/schedule.h"

namespace codedexposure
{

namespace
{

constexpr std::string_view kExample = "sequential:2x2";
constexpr std::array<std::string_view, 3> kCodes{
    "sequential", "staircase", "s-matrix"};

/** Labels in the order of their reversed binary digits; where n is no power of
 * two, those of the next one with the missing labels left out. */
std::vector<int>
bit_reversed_order (int n)
{
  const int size = int (std::bit_ceil (unsigned (n)));
  std::vector<int> order;
  order.reserve (std::size_t (n));
  for (int i = 0; i < size; i++) {
    int reversed = 0;
    for (int bit = 1; bit < size; bit <<= 1)
      reversed = reversed << 1 | ((i & bit) != 0 ? 1 : 0);
    if (reversed < n)
      order.push_back (reversed);
  }
  return order;
}

/** What stands before ':' in @p text, if it is the name of a code. */
bool
begins_with_code (std::string_view text)
{
  const std::string_view code = text.substr (0, text.find (':'));
  return code.size () < text.size () &&
         std::find (kCodes.begin (), kCodes.end (), code) != kCodes.end ();
}

Error
bad_value (
    std::string_view key, std::string_view value, const std::string &rule)
{
  return {std::string (key) + "=" + printable (value) + ": " + rule};
}

template <Nanoseconds Timing::*kTime>
Result<void>
read_time (std::string_view key, std::string_view value, Schedule::Parts &parts)
{
  ASSIGN_OR_RETURN (parts.timing.*kTime,
      with_prefix (parse_time (value), std::string (key) + ": "));
  return {};
}

Result<void>
read_order (
    std::string_view key, std::string_view value, Schedule::Parts &parts)
{
  if (value == "raster")
    return {};
  if (value == "bit-reversal") {
    parts.order = bit_reversed_order (parts.tile.elements ());
    return {};
  }
  for (const std::string_view entry : split (value, '/')) {
    const auto element = parse_int (entry);
    if (!element)
      return bad_value (key, value,
          in_quotes (entry) +
              " is no element; write raster, bit-reversal or the element of "
              "each label, as in order=0/2/1/3");
    parts.order.push_back (*element);
  }
  return {};
}

Result<void>
read_phase (
    std::string_view key, std::string_view value, Schedule::Parts &parts)
{
  const auto pieces = split (value, '/');
  const auto x = parse_int (pieces.front ());
  const auto y = parse_int (pieces.back ());
  if (pieces.size () != 2 || !x || !y)
    return bad_value (key, value,
        "it must be two whole numbers x/y, in pixels, as in phase=1/0");
  parts.phase = {*x, *y};
  return {};
}

Result<void>
read_leak (std::string_view key, std::string_view value, Schedule::Parts &parts)
{
  const auto leak = parse_real (value);
  if (!leak)
    return bad_value (key, value,
        "it must be a number from 0 to 0.5, the light of a mirror that is off "
        "as a part of one that is on, as in leak=0.01");
  parts.leak = *leak;
  return {};
}

Result<void>
read_pilot (
    std::string_view key, std::string_view value, Schedule::Parts &parts)
{
  const auto rows = parse_int (value);
  if (!rows)
    return bad_value (
        key, value, "it must be a whole number of mirror rows, as in pilot=16");
  parts.pilot_rows = *rows;
  return {};
}

/** Tile and code of "CODE:TILE". */
Result<Schedule::Parts>
read_pattern (std::string_view text, const std::string &form)
{
  const std::size_t colon = text.find (':');
  const std::string_view name = text.substr (0, colon);
  if (std::find (kCodes.begin (), kCodes.end (), name) == kCodes.end ())
    return Error{in_quotes (name) +
                 " is no code; the codes are sequential, "
                 "staircase and s-matrix, and any other is "
                 "written out in a JSON file" +
                 form};
  if (colon == text.npos)
    return Error{"the tile is missing" + form};
  ASSIGN_OR_RETURN (const auto tile, Tile::parse (text.substr (colon + 1)));
  ASSIGN_OR_RETURN (const auto code, Code::named (name, tile.elements ()));
  return Schedule::Parts{tile, code};
}

struct Key {
  std::string_view name;
  Result<void> (*read) (
      std::string_view key, std::string_view value, Schedule::Parts &parts);
  bool repeats = false;
};

/** What regions have as well. */
constexpr Key kOrder{"order", read_order};
constexpr Key kPhase{"phase", read_phase};

std::string
key_names (std::span<const Key> keys)
{
  std::string names;
  for (const Key &key : keys)
    names += (names.empty () ? "" : ", ") + std::string (key.name);
  return names;
}

/** Reads every key=value of @p settings into @p parts. */
Result<void>
read_settings (std::span<const std::string_view> settings,
    std::span<const Key> keys, const std::string &separator,
    Schedule::Parts &parts)
{
  std::vector<bool> seen (keys.size ());
  for (const std::string_view setting : settings) {
    const std::size_t equals = setting.find ('=');
    if (equals == setting.npos)
      return Error{in_quotes (setting) + " after a " + separator +
                   " is not of the form key=value; the keys are " +
                   key_names (keys) +
                   ", and lists are written with '/', as in order=0/2/1/3"};
    const std::string_view name = setting.substr (0, equals);
    const auto key = std::find_if (keys.begin (), keys.end (),
        [name] (const Key &known) { return known.name == name; });
    if (key == keys.end ())
      return Error{"there is no key " + in_quotes (name) + "; the keys are " +
                   key_names (keys)};

    auto given = seen[std::size_t (key - keys.begin ())];
    if (given && !key->repeats)
      return Error{
          "key " + in_quotes (name) + " is given twice; leave one out"};
    given = true;
    RETURN_IF_ERROR (key->read (name, setting.substr (equals + 1), parts));
  }
  return {};
}

/** "192x144+64+32:sequential:4x2:order=bit-reversal" */
Result<void>
read_region (
    std::string_view key, std::string_view value, Schedule::Parts &parts)
{
  const std::string form =
      "; a region is WxH+X+Y:CODE:TILE, such as 192x144+64+32:sequential:4x2, "
      "then :order= and :phase= where it has them";
  const auto pieces = split (value, ':');
  const auto rect = parse_rect (pieces.front ());
  const bool has_corner = pieces.front ().find ('+') != value.npos;
  if (!rect || !has_corner || pieces.size () < 2)
    return bad_value (key, value,
        in_quotes (pieces.front ()) + " is no area with a code" + form);

  const auto settings = std::find_if (pieces.begin () + 1, pieces.end (),
      [] (std::string_view piece) { return piece.find ('=') != piece.npos; });
  std::string_view pattern = value.substr (pieces[0].size () + 1);
  for (auto setting = settings; setting != pieces.end (); ++setting)
    pattern.remove_suffix (std::min (setting->size () + 1, pattern.size ()));
  auto region = read_pattern (pattern, form);
  if (!region)
    return bad_value (key, value, region.error ().message);
  const Key keys[] = {kOrder, kPhase};
  if (const auto read =
          read_settings ({settings, pieces.end ()}, keys, "colon", *region);
      !read)
    return bad_value (key, value, read.error ().message);
  parts.regions.push_back ({*rect, std::move (region->tile),
      std::move (region->code), std::move (region->order), region->phase});
  return {};
}

constexpr std::array<Key, 8> kKeys{{
    {"active", read_time<&Timing::active>},
    {"switching", read_time<&Timing::switching>},
    {"readout", read_time<&Timing::readout>},
    kOrder,
    kPhase,
    {"leak", read_leak},
    {"pilot", read_pilot},
    {"region", read_region, true},
}};

Result<Schedule>
read_preset (std::string_view preset)
{
  const std::string form = "; a preset is CODE:TILE[,key=value...], such as " +
                           std::string (kExample);
  auto pieces = split (preset, ',');
  ASSIGN_OR_RETURN (auto parts, read_pattern (pieces.front (), form));
  pieces.erase (pieces.begin ());
  RETURN_IF_ERROR (read_settings (pieces, kKeys, "comma", parts));
  return Schedule::make (std::move (parts));
}

Result<Schedule>
read_json_file (std::string_view path)
{
  const std::string what = "schedule file " + in_quotes (path, 4096) + ": ";
  if (path.find ('\0') != path.npos)
    return Error{what + "a path holds no zero bytes"};
  const auto content = read_file (std::string (path), Schedule::kMaxJsonSize);
  if (!content)
    return Error{
        what + content.error ().message +
            "; a text with '/' or ending in .json is the path of a JSON "
            "file unless it begins with sequential:, staircase: or "
            "s-matrix:",
        content.error ().code};
  return with_prefix (Schedule::from_json (*content), what);
}

/** Order and phase, each after @p separator, where they say anything. */
std::string
placing_text (
    const std::vector<int> &order, Offset phase, const std::string &separator)
{
  std::string text;
  if (!std::ranges::is_sorted (order)) {
    if (order == bit_reversed_order (int (order.size ())))
      text = separator + "order=bit-reversal";
    else
      for (const int element : order)
        text += (text.empty () ? separator + "order=" : "/") +
                std::to_string (element);
  }
  if (phase != Offset{})
    text += separator + "phase=" + std::to_string (phase.x) + "/" +
            std::to_string (phase.y);
  return text;
}

std::string
region_text (const Region &region)
{
  return ",region=" + rect_text (region.rect) + ":" + region.code.name () +
         ":" + region.tile.name () +
         placing_text (region.order, region.phase, ":");
}

} // namespace

Result<Schedule>
Schedule::parse (std::string_view preset_or_path)
try {
  if (preset_or_path.empty ())
    return Error{"the schedule is empty; write a preset, such as " +
                 std::string (kExample) + ", or the path of a JSON file"};
  const bool path_like = preset_or_path.find ('/') != preset_or_path.npos ||
                         preset_or_path.ends_with (".json");
  if (path_like && !begins_with_code (preset_or_path))
    return read_json_file (preset_or_path);
  return from_preset (preset_or_path);
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<Schedule>
Schedule::from_preset (std::string_view preset)
try {
  return with_prefix (
      read_preset (preset), "schedule " + in_quotes (preset) + ": ");
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

std::string
Schedule::text () const
{
  std::string text = code ().name () + ":" + tile ().name ();
  if (timing ().active != 0)
    text += ",active=" + time_text (timing ().active);
  if (timing ().switching != 0)
    text += ",switching=" + time_text (timing ().switching);
  if (timing ().readout != 0)
    text += ",readout=" + time_text (timing ().readout);
  text += placing_text (order (), phase (), ",");
  if (leak () != 0.0)
    text += ",leak=" + real_text (leak ());
  if (pilot_rows () != 0)
    text += ",pilot=" + std::to_string (pilot_rows ());
  for (const Region &region : regions ())
    text += region_text (region);
  return text;
}

} // namespace codedexposure
