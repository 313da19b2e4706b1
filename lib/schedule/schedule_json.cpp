/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The versioned JSON form of schedules: docs/formats.md. */
#include <algorithm>

#include "schedule/json_forms.h"
#include "schedule/schedule.h"

namespace codedexposure
{

namespace
{

constexpr std::string_view kFormat = "coded-exposure";
constexpr int kVersion = 1;

/** The two numbers of @p value, such as [0, 1]. */
Result<Offset>
read_pair (const Json &value, const std::string &key, int highest)
{
  const auto numbers = read_integers (value, key, highest);
  if (!numbers)
    return numbers.error ();
  if (numbers->size () != 2)
    return expected (key, "two whole numbers, x and y", value);
  return Offset{numbers->front (), numbers->back ()};
}

Result<Tile>
read_tile (const Json &value)
{
  if (value.is_string ())
    return Tile::parse (value.get_ref<const std::string &> ());
  if (!value.is_object ())
    return expected ("tile",
        "a name, such as \"2x2\", or {\"period\":[w,h],\"labels\":[...]}",
        value);
  if (const auto checked = check_keys (value, " in tile", {"period", "labels"});
      !checked)
    return checked.error ();
  for (const char *key : {"period", "labels"})
    if (!value.contains (key))
      return Error{"key 'tile." + std::string (key) +
                   "' is missing; a tile that is written out has a period, "
                   "[width, height], and width x height labels"};

  const auto period =
      read_pair (value["period"], "tile.period", Tile::kMaxPeriod);
  if (!period)
    return period.error ();
  const auto labels =
      read_integers (value["labels"], "tile.labels", Tile::kMaxElements - 1);
  if (!labels)
    return labels.error ();
  return Tile::from_labels (
      period->x, period->y, {labels->begin (), labels->end ()});
}

Result<Code>
read_code (const Json &value, int elements)
{
  if (value.is_string ())
    return Code::named (value.get_ref<const std::string &> (), elements);
  if (!value.is_object ())
    return expected ("code",
        "a name, such as \"sequential\", or {\"rows\":[\"1000\",...]}", value);
  if (const auto checked = check_keys (value, " in code", {"rows"}); !checked)
    return checked.error ();

  const auto rows = value.find ("rows");
  if (rows == value.end () || !rows->is_array ())
    return expected (
        "code", "a name or {\"rows\":[...]} with a list of rows", value);
  std::vector<std::string> texts;
  for (const Json &row : *rows) {
    if (!row.is_string ())
      return expected ("code.rows[" + std::to_string (texts.size ()) + "]",
          "a string of 0 and 1, such as \"1000\"", row);
    texts.push_back (row.get<std::string> ());
  }
  return Code::from_rows (texts);
}

Result<void>
read_timing (const Json &value, Timing &timing)
{
  if (!value.is_object ())
    return expected ("timing", "an object", value);
  if (const auto checked = check_keys (
          value, " in timing", {"active_ns", "switching_ns", "readout_ns"});
      !checked)
    return checked;
  for (const auto &[key, field] : {std::pair ("active_ns", &Timing::active),
           std::pair ("switching_ns", &Timing::switching),
           std::pair ("readout_ns", &Timing::readout)}) {
    const auto found = value.find (key);
    if (found == value.end ())
      continue;
    const auto time =
        read_integer (*found, "timing." + std::string (key), kTimeLimit - 1);
    if (!time)
      return time.error ();
    timing.*field = *time;
  }
  return {};
}

/** What a schedule and a region have alike: tile, code, order and phase. */
Result<Schedule::Parts>
read_pattern (const Json &root)
{
  const auto tile = read_tile (root["tile"]);
  if (!tile)
    return tile.error ();
  const auto code = read_code (root["code"], tile->elements ());
  if (!code)
    return code.error ();
  Schedule::Parts parts{*tile, *code};
  if (root.contains ("order")) {
    const auto order =
        read_integers (root["order"], "order", Tile::kMaxElements - 1);
    if (!order)
      return order.error ();
    if (order->empty ())
      return expected ("order", "the element of each label", root["order"]);
    parts.order = *order;
  }
  if (root.contains ("phase")) {
    const auto phase =
        read_pair (root["phase"], "phase", Schedule::kMaxMirrors);
    if (!phase)
      return phase.error ();
    parts.phase = *phase;
  }
  return parts;
}

Result<Region>
read_region (const Json &value)
{
  if (!value.is_object ())
    return Error{
        "it must be an object with rect, tile and code, not " + shown (value)};
  if (const auto checked =
          check_keys (value, "", {"rect", "tile", "code", "order", "phase"});
      !checked)
    return checked.error ();
  for (const char *key : {"rect", "tile", "code"})
    if (!value.contains (key))
      return Error{"key '" + std::string (key) +
                   "' is missing; a region needs at least rect, tile and code"};
  const auto rect =
      read_integers (value["rect"], "rect", Schedule::kMaxMirrors);
  if (!rect)
    return rect.error ();
  if (rect->size () != 4)
    return expected (
        "rect", "four whole numbers, [x, y, width, height]", value["rect"]);
  auto parts = read_pattern (value);
  if (!parts)
    return parts.error ();
  return Region{{(*rect)[0], (*rect)[1], (*rect)[2], (*rect)[3]},
      std::move (parts->tile), std::move (parts->code),
      std::move (parts->order), parts->phase};
}

Result<std::vector<Region>>
read_regions (const Json &value)
{
  if (!value.is_array () || value.empty ())
    return expected ("regions", "a list of at least one region", value);
  std::vector<Region> regions;
  for (const Json &entry : value) {
    auto region = read_region (entry);
    if (!region)
      return region.error ().with_prefix (
          "in regions[" + std::to_string (regions.size ()) + "]: ");
    regions.push_back (*std::move (region));
  }
  return regions;
}

/** The keys that may be left out and that regions do not have. */
Result<void>
read_options (const Json &root, Schedule::Parts &parts)
{
  if (root.contains ("timing"))
    if (const auto read = read_timing (root["timing"], parts.timing); !read)
      return read;
  if (root.contains ("leak")) {
    if (!root["leak"].is_number ())
      return expected ("leak", "a number from 0 to 0.5", root["leak"]);
    parts.leak = root["leak"].get<double> ();
  }
  if (root.contains ("pilot_rows")) {
    const auto rows =
        read_integer (root["pilot_rows"], "pilot_rows", Schedule::kMaxMirrors);
    if (!rows)
      return rows.error ();
    parts.pilot_rows = int (*rows);
  }
  if (root.contains ("regions")) {
    auto regions = read_regions (root["regions"]);
    if (!regions)
      return regions.error ();
    parts.regions = *std::move (regions);
  }
  return {};
}

Result<void>
check_schedule_keys (const Json &root)
{
  if (const auto checked = check_head (root, kFormat, kVersion, "schedule");
      !checked)
    return checked;
  if (const auto checked = check_keys (root, "",
          {"format", "version", "tile", "code", "timing", "order", "phase",
              "leak", "pilot_rows", "regions"});
      !checked)
    return checked;
  for (const char *key : {"tile", "code"})
    if (!root.contains (key))
      return Error{"key '" + std::string (key) +
                   "' is missing; a schedule needs at least format, version, "
                   "tile and code"};
  return {};
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

Result<Schedule>
read_schedule (const Json &root)
{
  if (const auto checked = check_schedule_keys (root); !checked)
    return checked.error ();
  auto parts = read_pattern (root);
  if (!parts)
    return parts.error ();
  if (const auto read = read_options (root, *parts); !read)
    return read.error ();
  return Schedule::make (*std::move (parts));
}

Result<Schedule>
Schedule::from_json (std::string_view json)
try {
  const std::string what = "schedule JSON: ";
  if (json.size () > kMaxJsonSize)
    return Error{what + "more than " + std::to_string (kMaxJsonSize) +
                 " bytes; no schedule is that long"};
  const auto root = parse_strictly (json, "schedule");
  if (!root)
    return root.error ().with_prefix (what);
  auto schedule = read_schedule (*root);
  if (!schedule)
    return schedule.error ().with_prefix (what);
  return schedule;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

std::string
Schedule::to_json () const
{
  OrderedJson root;
  root["format"] = kFormat;
  root["version"] = kVersion;
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
  return root.dump ();
}

} // namespace codedexposure
