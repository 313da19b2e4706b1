/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The versioned JSON form of schedules: docs/formats.md. */
#include "schedule/json.h"

#include <algorithm>

namespace codedexposure
{

namespace
{

const JsonHead kHead{"schedule", "coded-exposure", 1};
constexpr const char *kPair = "two whole numbers, x and y";

Tile
read_tile (const Json &value)
{
  if (value.is_string ())
    return or_throw (Tile::parse (value.get_ref<const std::string &> ()));
  if (!value.is_object ())
    throw expected ("tile",
        "a name, such as \"2x2\", or {\"period\":[w,h],\"labels\":[...]}",
        value);
  Offset period;
  std::vector<int> labels;
  read_keys (value, "tile",
      "a tile that is written out has a period, [width, height], and width x "
      "height labels",
      {{"period",
           integers_into ({&period.x, &period.y}, Tile::kMaxPeriod, kPair),
           true},
          {"labels", integers_into (labels, Tile::kMaxElements - 1), true}});
  return or_throw (
      Tile::from_labels (period.x, period.y, {labels.begin (), labels.end ()}));
}

Code
read_code (const Json &value, int elements)
{
  if (value.is_string ())
    return or_throw (
        Code::named (value.get_ref<const std::string &> (), elements));
  if (!value.is_object ())
    throw expected ("code",
        "a name, such as \"sequential\", or {\"rows\":[\"1000\",...]}", value);
  std::vector<std::string> rows;
  const auto read_rows = [&rows] (const Json &list, const std::string &key) {
    if (!list.is_array ())
      throw expected (key, "a list of rows", list);
    for (const Json &row : list) {
      if (!row.is_string ())
        throw expected (key + "[" + std::to_string (rows.size ()) + "]",
            "a string of 0 and 1, such as \"1000\"", row);
      rows.push_back (row.get<std::string> ());
    }
  };
  read_keys (value, "code", "a code that is written out has rows",
      {{"rows", read_rows, true}});
  return or_throw (Code::from_rows (rows));
}

/** What a schedule and a region have alike. */
template <typename Pattern>
JsonKeys
pattern_keys (Pattern &pattern)
{
  return {
      {"tile",
          [&pattern] (const Json &value, const std::string &) {
            pattern.tile = read_tile (value);
          },
          true},
      {"code",
          [&pattern] (const Json &value, const std::string &) {
            pattern.code = read_code (value, pattern.tile.elements ());
          },
          true},
      {"order",
          [&pattern] (const Json &value, const std::string &key) {
            integers_into (pattern.order, Tile::kMaxElements - 1) (value, key);
            if (pattern.order.empty ())
              throw expected (key, "the element of each label", value);
          }},
      {"phase", integers_into ({&pattern.phase.x, &pattern.phase.y},
                    Schedule::kMaxMirrors, kPair)},
  };
}

Region
read_region (const Json &value)
{
  const Schedule usual;
  Region region{{}, usual.tile (), usual.code ()};
  auto &[x, y, width, height] = region.rect;
  JsonKeys keys = pattern_keys (region);
  keys.insert (keys.begin (),
      {"rect",
          integers_into ({&x, &y, &width, &height}, Schedule::kMaxMirrors,
              "four whole numbers, [x, y, width, height]"),
          true});
  read_keys (value, "", "a region needs at least rect, tile and code", keys);
  return region;
}

std::vector<Region>
read_regions (const Json &value, const std::string &key)
{
  if (!value.is_array () || value.empty ())
    throw expected (key, "a list of at least one region", value);
  std::vector<Region> regions;
  for (const Json &entry : value)
    try {
      regions.push_back (read_region (entry));
    } catch (const Error &refused) {
      throw refused.with_prefix (
          "in regions[" + std::to_string (regions.size ()) + "]: ");
    }
  return regions;
}

void
read_timing (const Json &value, Timing &timing)
{
  read_keys (value, "timing", "",
      {{"active_ns", integer_into (timing.active, kTimeLimit - 1)},
          {"switching_ns", integer_into (timing.switching, kTimeLimit - 1)},
          {"readout_ns", integer_into (timing.readout, kTimeLimit - 1)}});
}

OrderedJson
tile_json (const Tile &tile)
{
  if (tile.is_named ())
    return tile.name ();
  OrderedJson map;
  map["period"] = {tile.period_x (), tile.period_y ()};
  map["labels"] = tile.labels ();
  return map;
}

OrderedJson
code_json (const Code &code)
{
  if (code.is_named ())
    return code.name ();
  return {{"rows", code.rows ()}};
}

/** The keys order and phase, where they say anything. */
void
add_placing (const std::vector<int> &order, Offset phase, OrderedJson &pattern)
{
  if (!std::is_sorted (order.begin (), order.end ()))
    pattern["order"] = order;
  if (phase != Offset{})
    pattern["phase"] = {phase.x, phase.y};
}

OrderedJson
region_json (const Region &region)
{
  const Rect &rect = region.rect;
  OrderedJson json;
  json["rect"] = {rect.x, rect.y, rect.width, rect.height};
  json["tile"] = tile_json (region.tile);
  json["code"] = code_json (region.code);
  add_placing (region.order, region.phase, json);
  return json;
}

} // namespace

Schedule
read_schedule (const Json &root, const JsonKeys &more)
{
  const Schedule usual;
  Schedule::Parts parts{usual.tile (), usual.code ()};
  JsonKeys keys = pattern_keys (parts);
  const JsonKeys options = {
      {"timing",
          [&parts] (const Json &value, const std::string &) {
            read_timing (value, parts.timing);
          }},
      {"leak", number_into (parts.leak, "a number from 0 to 0.5")},
      {"pilot_rows", integer_into (parts.pilot_rows, Schedule::kMaxMirrors)},
      {"regions",
          [&parts] (const Json &value, const std::string &key) {
            parts.regions = read_regions (value, key);
          }},
  };
  keys.insert (keys.end (), options.begin (), options.end ());
  keys.insert (keys.end (), more.begin (), more.end ());
  read_versioned (root, kHead,
      "a schedule needs at least format, version, tile and code", keys);
  return or_throw (Schedule::make (std::move (parts)));
}

Result<Schedule>
Schedule::from_json (std::string_view json)
{
  return read_json<Schedule> (json, kHead.what, kMaxJsonSize,
      [] (const Json &root) { return read_schedule (root); });
}

std::string
Schedule::to_json () const
{
  OrderedJson root;
  root["format"] = kHead.format;
  root["version"] = kHead.version;
  root["tile"] = tile_json (tile ());
  root["code"] = code_json (code ());
  if (timing () != Timing{})
    root["timing"] = {{"active_ns", timing ().active},
        {"switching_ns", timing ().switching},
        {"readout_ns", timing ().readout}};
  add_placing (order (), phase (), root);
  if (leak () != 0.0)
    root["leak"] = leak ();
  if (pilot_rows () != 0)
    root["pilot_rows"] = pilot_rows ();
  for (const Region &region : regions ())
    root["regions"].push_back (region_json (region));
  return json_text (root);
}

} // namespace codedexposure
