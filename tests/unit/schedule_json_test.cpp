/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The JSON form of schedules, both ways. */
#include "schedule/schedule.h"

#include <gtest/gtest.h>

#include "schedules.h"

using namespace codedexposure;

namespace
{

constexpr const char *kHead =
    R"({"format":"coded-exposure","version":1,"tile":"2x2","code":"sequential")";

/** A valid schedule with @p more keys. */
std::string
with (const std::string &more)
{
  return kHead + (more.empty () ? "" : "," + more) + "}";
}

std::string
with_tile (const std::string &tile)
{
  return R"({"format":"coded-exposure","version":1,"code":"sequential","tile":)" +
         tile + "}";
}

std::string
with_code (const std::string &code)
{
  return R"({"format":"coded-exposure","version":1,"tile":"2x1","code":)" +
         code + "}";
}

Schedule
read (const std::string &json)
{
  auto schedule = Schedule::from_json (json);
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return schedule.ok () ? *schedule : Schedule ();
}

} // namespace

TEST (ScheduleJson, OfTheDefaultSchedule)
{
  EXPECT_EQ (Schedule ().to_json (), with (""));
  EXPECT_EQ (read (with ("")), Schedule ());
}

TEST (ScheduleJson, HoldsEveryKey)
{
  const auto schedule = Schedule::from_preset (
      "staircase:lattice:4/2,active=9.8ms,switching=0.2ms,readout=1ns,"
      "order=3/1/2/0,phase=1/2,leak=0.01,pilot=16");
  ASSERT_TRUE (schedule.ok ());
  EXPECT_EQ (schedule->to_json (),
      R"({"format":"coded-exposure","version":1,"tile":"lattice:4/2",)"
      R"("code":"staircase","timing":{"active_ns":9800000,)"
      R"("switching_ns":200000,"readout_ns":1},"order":[3,1,2,0],)"
      R"("phase":[1,2],"leak":0.01,"pilot_rows":16})");
  EXPECT_EQ (read (schedule->to_json ()), *schedule);
}

TEST (ScheduleJson, HoldsWrittenParts)
{
  const auto schedule = Schedule::make (
      {*Tile::from_labels (2, 1, {1, 0}), *Code::from_rows ({"01", "11"})});
  ASSERT_TRUE (schedule.ok ());
  EXPECT_EQ (schedule->to_json (),
      R"({"format":"coded-exposure","version":1,)"
      R"("tile":{"period":[2,1],"labels":[1,0]},"code":{"rows":["01","11"]}})");
  EXPECT_EQ (read (schedule->to_json ()), *schedule);
}

TEST (ScheduleJson, DefaultsMayBeWrittenOut)
{
  EXPECT_EQ (read (with (
                 R"("timing":{"active_ns":0,"switching_ns":0,"readout_ns":0},)"
                 R"("order":[0,1,2,3],"phase":[0,0],"leak":0,"pilot_rows":0)")),
      Schedule ());
  EXPECT_EQ (read (with (R"("timing":{})")), Schedule ());
  EXPECT_EQ (read (with (R"("leak":0.0,"pilot_rows":-0)")), Schedule ());
}

TEST (ScheduleJson, SpaceAndOrderOfKeysAreFree)
{
  EXPECT_EQ (
      read (
          "\xef\xbb\xbf \n{ \"tile\" : \"2x2\",\r\n\t\"code\":\"sequential\", "
          "\"version\":1,\"format\":\"coded-\\u0065xposure\"} \n"),
      Schedule ());
}

TEST (ScheduleJson, ReadsBackWhatItWrote)
{
  test::ScheduleSource source (2);
  for (int i = 0; i < 2000; i++) {
    const Schedule schedule = i % 2 == 0 ? source.named () : source.written ();
    const std::string json = schedule.to_json ();
    const auto back = Schedule::from_json (json);
    ASSERT_TRUE (back.ok ()) << back.error ().message;
    ASSERT_EQ (*back, schedule) << schedule.text ();
    ASSERT_EQ (back->to_json (), json);
    ASSERT_EQ (json.find ('\n'), std::string::npos);
  }
}

TEST (ScheduleJson, OfTheLargestScheduleIsBelowTheLimit)
{
  std::vector<std::uint8_t> labels;
  for (int y = 0; y < 256; y++)
    for (int x = 0; x < 256; x++)
      labels.push_back (std::uint8_t (255 - (x + 16 * y) % 256));
  std::vector<std::string> rows;
  for (const std::string &row : Code::named ("s-matrix", 256)->rows ())
    rows.push_back (row);
  Schedule::Parts parts{
      *Tile::from_labels (256, 256, labels), *Code::from_rows (rows)};
  for (int label = 0; label < 256; label++)
    parts.order.push_back (255 - label);
  const auto schedule = Schedule::make (parts);
  ASSERT_TRUE (schedule.ok ()) << schedule.error ().message;
  const std::string json = schedule->to_json ();
  EXPECT_LT (json.size (), Schedule::kMaxJsonSize / 2);
  EXPECT_EQ (read (json), *schedule);
}

TEST (ScheduleJson, WrongTextsAreNamed)
{
  const std::string good = with ("");
  const std::string deep (Schedule::kMaxJsonSize / 2, '[');
  const struct {
    std::string text;
    std::vector<std::string> words;
  } cases[] = {
      /* no JSON */
      {"", {"it is empty"}},
      {" \n", {"it is empty"}},
      {"{", {"no valid JSON"}},
      {good.substr (0, good.size () - 1), {"no valid JSON", "end of input"}},
      {good + "}", {"no valid JSON"}},
      {good + good, {"no valid JSON"}},
      {good + std::string (1, '\0'), {"no valid JSON", "zero byte at 72"}},
      {with (R"("leak":0.1,)"), {"no valid JSON"}},
      {with (R"("leak":nan)"), {"no valid JSON"}},
      {with (R"("leak":.5)"), {"no valid JSON"}},
      {with (R"("leak":1e999)"), {"no valid JSON", "1e999"}},
      {with (R"("phase":[01,0])"), {"no valid JSON"}},
      {with ("\"\xff\":1"), {"no valid JSON", "UTF-8", "\\xff"}},
      {with ("\"\xc0\x80\":1"), {"no valid JSON", "UTF-8"}},
      {with (R"("a":"\ud800")"), {"no valid JSON"}},
      {good + "// comment", {"no valid JSON"}},
      {"'" + good + "'", {"no valid JSON"}},
      {deep, {"deeper than 8 levels"}},
      {std::string (Schedule::kMaxJsonSize + 1, ' '), {"more than 1048576"}},
      /* no schedule */
      {"[]", {"must be an object, not []", "coded-exposure"}},
      {"null", {"must be an object, not null"}},
      {R"("sequential:2x2")", {"must be an object"}},
      {"{}", {"'format' is missing", "coded-exposure"}},
      {R"({"version":1})", {"'format' is missing"}},
      {R"({"format":"coded-exposure"})", {"'version' is missing"}},
      {R"({"format":"coded","version":1})", {"format \"coded\"", "not known"}},
      {R"({"format":1,"version":1})", {"format 1 is not known"}},
      {R"({"format":"coded-exposure","version":2,"new":0})",
          {"version 2 is not known", "reads version 1"}},
      {R"({"format":"coded-exposure","version":0})", {"version 0"}},
      {R"({"format":"coded-exposure","version":1.0})", {"version 1.0"}},
      {R"({"format":"coded-exposure","version":"1"})", {"version \"1\""}},
      {R"({"format":"coded-exposure","version":1,"code":"sequential"})",
          {"'tile' is missing"}},
      {R"({"format":"coded-exposure","version":1,"tile":"2x2"})",
          {"'code' is missing"}},
      /* keys */
      {with (R"("gain":1)"), {"no key 'gain'", "pilot_rows"}},
      {with (R"("":1)"), {"no key ''"}},
      {with (R"("mapping":{})"), {"no key 'mapping'"}},
      {with (R"("tile":"2x2")"), {"'tile' stands twice"}},
      {with (R"("leak":0,"\u006ceak":0)"), {"'leak' stands twice"}},
      {with (R"("timing":{"active_ns":1,"active_ns":1})"),
          {"'active_ns' stands twice"}},
      {with (R"("timing":{"active":1})"),
          {"no key 'active' in timing", "active_ns"}},
      /* tile */
      {with_tile ("null"), {"'tile'", "not null"}},
      {with_tile ("4"), {"'tile'", "not 4"}},
      {with_tile (R"("2y2")"), {"tile '2y2' is none of"}},
      {with_tile (R"("labels")"), {"tile 'labels' is none of"}},
      {with_tile ("{}"), {"'tile.period' is missing"}},
      {with_tile (R"({"period":[2,2]})"), {"'tile.labels' is missing"}},
      {with_tile (R"({"period":[2,2],"labels":[0,1,2,3],"name":"x"})"),
          {"no key 'name' in tile", "labels"}},
      {with_tile (R"({"period":[2],"labels":[0,1]})"),
          {"'tile.period'", "two whole numbers", "[2]"}},
      {with_tile (R"({"period":[2,1,1],"labels":[0,1]})"),
          {"'tile.period'", "[2,1,1]"}},
      {with_tile (R"({"period":"2x1","labels":[0,1]})"), {"'tile.period'"}},
      {with_tile (R"({"period":[257,1],"labels":[0,1]})"),
          {"'tile.period[0]'", "0 to 256", "257"}},
      {with_tile (R"({"period":[0,1],"labels":[]})"), {"0 x 1", "1..256"}},
      {with_tile (R"({"period":[2,1],"labels":[0,1,2]})"), {"2 labels, not 3"}},
      {with_tile (R"({"period":[2,1],"labels":[0,256]})"),
          {"'tile.labels[1]'", "0 to 255", "256"}},
      {with_tile (R"({"period":[2,1],"labels":[0,-1]})"),
          {"'tile.labels[1]'", "-1"}},
      {with_tile (R"({"period":[2,1],"labels":[0,1.0]})"),
          {"'tile.labels[1]'", "1.0"}},
      {with_tile (R"({"period":[2,1],"labels":[0,true]})"),
          {"'tile.labels[1]'", "true"}},
      {with_tile (R"({"period":[2,1],"labels":{}})"),
          {"'tile.labels'", "list"}},
      {with_tile (R"({"period":[2,1],"labels":[0,2]})"), {"lacks label 1"}},
      {with_tile (R"({"period":[3,1],"labels":[0,0,1]})"), {"no cell"}},
      /* code */
      {with_code ("1"), {"'code'", "not 1"}},
      {with_code (R"("cumulative")"), {"'cumulative'", "none of"}},
      {with_code (R"("matrix")"), {"'matrix'", "none of"}},
      {with_code ("{}"), {"'code.rows'", "rows"}},
      {with_code (R"({"rows":"10"})"), {"'code.rows'", "rows"}},
      {with_code (R"({"rows":["10",1]})"), {"'code.rows[1]'", "not 1"}},
      {with_code (R"({"rows":["10","01"],"n":2})"), {"no key 'n' in code"}},
      {R"({"format":"coded-exposure","version":1,"tile":{"period":[2,1],)"
       R"("labels":[0,1]},"code":{"rows":["10","01"],"period":[2,1]}})",
          {"no key 'period' in code"}},
      {with_code (R"({"rows":[]})"), {"0 rows"}},
      {with_code (R"({"rows":["10","1"]})"), {"row 1", "1 slots"}},
      {with_code (R"({"rows":["10","0 "]})"), {"row 1", "'0 '"}},
      {with_code (R"({"rows":["10","00"]})"), {"row 1", "never on"}},
      {with_code (R"({"rows":["100","010","001"]})"),
          {"'matrix' has 3", "'2x1' has 2"}},
      /* the rest */
      {with (R"("timing":[])"), {"'timing'", "object"}},
      {with (R"("timing":{"active_ns":1.5})"), {"'timing.active_ns'", "1.5"}},
      {with (R"("timing":{"active_ns":"1ms"})"), {"'timing.active_ns'", "1ms"}},
      {with (R"("timing":{"switching_ns":-1})"),
          {"'timing.switching_ns'", "-1"}},
      {with (R"("timing":{"readout_ns":3600000000000})"),
          {"'timing.readout_ns'", "3599999999999", "3600000000000"}},
      {with (R"("timing":{"readout_ns":18446744073709551615})"),
          {"'timing.readout_ns'", "18446744073709551615"}},
      {with (R"("timing":{"readout_ns":99999999999999999999})"),
          {"'timing.readout_ns'"}},
      {with (R"("order":"raster")"), {"'order'", "list", "raster"}},
      {with (R"("order":[])"), {"'order'", "each label"}},
      {with (R"("order":[0,1,2])"), {"3 entries for 4 labels"}},
      {with (R"("order":[0,1,2,2])"), {"element 2 twice"}},
      {with (R"("order":[0,1,2,4])"), {"element 4", "0..3"}},
      {with (R"("order":[0,1,2,256])"), {"'order[3]'", "0 to 255", "256"}},
      {with (R"("phase":1)"), {"'phase'"}},
      {with (R"("phase":[1])"), {"'phase'", "[1]"}},
      {with (R"("phase":[0,16385])"), {"'phase[1]'", "0 to 16384", "16385"}},
      {with (R"("phase":[0,4294967296])"), {"'phase[1]'", "4294967296"}},
      {with (R"("leak":"0.1")"), {"'leak'", "number from 0 to 0.5"}},
      {with (R"("leak":null)"), {"'leak'", "null"}},
      {with (R"("leak":0.51)"), {"leak 0.51", "0..0.5"}},
      {with (R"("leak":-1e-9)"), {"leak -1e-09", "0..0.5"}},
      {with (R"("pilot_rows":1.0)"), {"'pilot_rows'", "1.0"}},
      {with (R"("pilot_rows":16385)"), {"'pilot_rows'", "0 to 16384"}},
      {with (R"("pilot_rows":true)"), {"'pilot_rows'", "true"}},
  };
  for (const auto &c : cases) {
    const auto schedule = Schedule::from_json (c.text);
    ASSERT_FALSE (schedule.ok ()) << c.text.substr (0, 200);
    const std::string &message = schedule.error ().message;
    EXPECT_EQ (message.rfind ("schedule JSON: ", 0), 0u) << message;
    EXPECT_LT (message.size (), 600u);
    for (const std::string &word : c.words)
      EXPECT_NE (message.find (word), std::string::npos)
          << "'" << word << "' in: " << message;
  }
}
