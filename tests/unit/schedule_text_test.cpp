/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Presets, paths, and the messages for invalid ones. */
#include "schedule/schedule.h"

#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "schedules.h"

using namespace codedexposure;

namespace
{

Schedule
preset (const std::string &text)
{
  auto schedule = Schedule::from_preset (text);
  EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
  return schedule.ok () ? *schedule : Schedule ();
}

void
expect_words (const Result<Schedule> &schedule, const std::string &text,
    const std::vector<std::string> &words)
{
  ASSERT_FALSE (schedule.ok ()) << text;
  for (const std::string &word : words)
    EXPECT_NE (schedule.error ().message.find (word), std::string::npos)
        << "'" << word << "' in: " << schedule.error ().message;
}

/** A temporary folder for a test, removed with its content. */
class ScheduleFile : public testing::Test
{
protected:
  void SetUp () override
  {
    std::string name = testing::TempDir () + "schedule-XXXXXX";
    ASSERT_NE (mkdtemp (name.data ()), nullptr);
    folder_ = name;
  }
  void TearDown () override { std::filesystem::remove_all (folder_); }

  std::string write (const std::string &name, const std::string &content)
  {
    const std::filesystem::path path = folder_ / name;
    std::ofstream (path, std::ios::binary) << content;
    return path.string ();
  }

  std::filesystem::path folder_;
};

} // namespace

TEST (Preset, EveryKeyIsRead)
{
  const Schedule schedule =
      preset ("staircase:lattice:4/2,active=9.8ms,switching=0.2ms,"
              "readout=105ns,order=3/1/2/0,phase=1/2,leak=0.01,pilot=16");
  EXPECT_EQ (schedule.code ().name (), "staircase");
  EXPECT_EQ (schedule.tile ().name (), "lattice:4/2");
  EXPECT_EQ (schedule.timing (), (Timing{9'800'000, 200'000, 105}));
  EXPECT_EQ (schedule.order (), (std::vector{3, 1, 2, 0}));
  EXPECT_EQ (schedule.phase (), (Offset{1, 2}));
  EXPECT_EQ (schedule.leak (), 0.01);
  EXPECT_EQ (schedule.pilot_rows (), 16);
}

TEST (Preset, KeysMayStandInAnyOrder)
{
  EXPECT_EQ (preset ("sequential:2x2,leak=0.5,active=1ms"),
      preset ("sequential:2x2,active=1ms,leak=0.5"));
}

TEST (Preset, DefaultsMayBeWrittenOut)
{
  EXPECT_EQ (preset ("sequential:2x2,active=0,switching=0ms,readout=0s,"
                     "order=raster,phase=0/0,leak=0,pilot=0"),
      Schedule ());
  EXPECT_EQ (preset ("sequential:2x2,order=0/1/2/3"), Schedule ());
}

TEST (Preset, BitReversalOfPowersOfTwo)
{
  EXPECT_EQ (preset ("sequential:lattice:8/3,order=bit-reversal").order (),
      (std::vector{0, 4, 2, 6, 1, 5, 3, 7}));
  EXPECT_EQ (preset ("sequential:2x2,order=bit-reversal").order (),
      (std::vector{0, 2, 1, 3}));
  EXPECT_EQ (preset ("sequential:2x1,order=bit-reversal").order (),
      (std::vector{0, 1}));
}

TEST (Preset, BitReversalLeavesMissingNumbersOut)
{
  EXPECT_EQ (preset ("sequential:3x1,order=bit-reversal").order (),
      (std::vector{0, 2, 1}));
  EXPECT_EQ (preset ("sequential:lattice:5/2,order=bit-reversal").order (),
      (std::vector{0, 4, 2, 1, 3}));
  EXPECT_EQ (preset ("sequential:3x3,order=bit-reversal").order (),
      (std::vector{0, 8, 4, 2, 6, 1, 5, 3, 7}));
  for (int n = 2; n <= 256; n++)
    EXPECT_TRUE (Schedule::from_preset (
        "sequential:lattice:" + std::to_string (n) + "/1,order=bit-reversal")
                     .ok ());
}

TEST (Preset, TextIsCanonical)
{
  for (const char *text : {"sequential:2x2", "s-matrix:lattice:7/2",
           "sequential:lattice:8/3,order=bit-reversal", "staircase:diamond:13",
           "sequential:2x2,order=3/2/1/0",
           "staircase:2x2,active=9.8ms,switching=200us,readout=1ns,"
           "order=bit-reversal,phase=1/0,leak=0.01,pilot=16"})
    EXPECT_EQ (preset (text).text (), text);
  EXPECT_EQ (preset ("sequential:02x2,pilot=016,leak=1e-2,active=0.0098s,"
                     "order=0/2/1/3")
                 .text (),
      "sequential:2x2,active=9.8ms,order=bit-reversal,leak=0.01,pilot=16");
}

TEST (Preset, TextParsesBack)
{
  test::ScheduleSource source (1);
  for (int i = 0; i < 3000; i++) {
    const Schedule schedule = source.named ();
    const auto back = Schedule::from_preset (schedule.text ());
    ASSERT_TRUE (back.ok ()) << back.error ().message;
    ASSERT_EQ (*back, schedule) << schedule.text ();
    const auto parsed = Schedule::parse (schedule.text ());
    ASSERT_TRUE (parsed.ok ()) << parsed.error ().message;
    ASSERT_EQ (*parsed, schedule);
  }
}

TEST (Preset, TextOfWrittenPartsIsADescription)
{
  const auto schedule =
      Schedule::make ({*Tile::from_labels (2, 2, {1, 0, 3, 2}),
          *Code::from_rows ({"1100", "0110", "0011", "1000"})});
  ASSERT_TRUE (schedule.ok ());
  EXPECT_EQ (schedule->text (), "matrix:labels");
  EXPECT_FALSE (Schedule::parse (schedule->text ()).ok ());
}

TEST (Preset, WrongOnesAreNamed)
{
  const std::string ten (10'000, 'a');
  const struct {
    std::string text;
    std::vector<std::string> words;
  } cases[] = {
      /* the whole */
      {"", {"'' is no code", "CODE:TILE", "sequential:2x2"}},
      {"sequential", {"tile is missing", "sequential:2x2"}},
      {"2x2", {"'2x2' is no code", "staircase"}},
      {":2x2", {"'' is no code"}},
      {"Sequential:2x2", {"'Sequential' is no code"}},
      {" sequential:2x2", {"' sequential' is no code"}},
      {"matrix:2x2", {"'matrix' is no code", "JSON file"}},
      {"sequential,2x2", {"tile is missing"}},
      {"sequential=2x2", {"'sequential=2x2' is no code"}},
      {ten, {"aaa...' is no code"}},
      {"sequ\n\xff:2x2", {"'sequ\\x0a\\xff' is no code"}},
      {"s\xc3\xa9q:2x2", {"'s\xc3\xa9q' is no code"}},
      /* tiles */
      {"sequential:", {"tile '' is none of", "WxH", "lattice:8/3"}},
      {"sequential:2", {"tile '2' is none of"}},
      {"sequential:2x", {"tile '2x' is none of"}},
      {"sequential:2x2x2", {"tile '2x2x2' is none of"}},
      {"sequential:2X2", {"tile '2X2' is none of"}},
      {"sequential:2x2 ", {"tile '2x2 ' is none of"}},
      {"sequential: 2x2", {"tile ' 2x2' is none of"}},
      {"sequential:2.0x2", {"tile '2.0x2' is none of"}},
      {"sequential:+2x2", {"tile '+2x2' is none of"}},
      {"sequential:0x2", {"'0x2'", "2 to 256 elements"}},
      {"sequential:1x1", {"'1x1'", "2 to 256 elements"}},
      {"sequential:-2x2", {"'-2x2'", "at least one column"}},
      {"sequential:16x17", {"'16x17'", "2 to 256 elements"}},
      {"sequential:65536x65536", {"'65536x65536'", "2 to 256 elements"}},
      {"sequential:99999999999x2", {"tile '99999999999x2'"}},
      {"sequential:labels", {"tile 'labels' is none of", "JSON file"}},
      {"sequential:lattice:8", {"tile 'lattice:8' is none of"}},
      {"sequential:lattice:8/", {"tile 'lattice:8/' is none of"}},
      {"sequential:lattice:8/3/1", {"tile 'lattice:8/3/1' is none of"}},
      {"sequential:lattice:8/8", {"step 8", "0..7"}},
      {"sequential:lattice:8/-1", {"step -1", "0..7"}},
      {"sequential:lattice:1/0", {"1 elements", "2 to 256"}},
      {"sequential:lattice:257/3", {"257 elements", "2 to 256"}},
      {"sequential:diamond:12", {"'diamond:12'", "5, 13, 25"}},
      {"sequential:diamond:-5", {"'diamond:-5'", "5, 13, 25"}},
      {"sequential:diamond:x", {"tile 'diamond:x' is none of"}},
      {"sequential:file.json", {"tile 'file.json' is none of"}},
      /* codes and tiles together */
      {"s-matrix:3x2", {"'s-matrix'", "6 elements", "4 and 7"}},
      {"s-matrix:lattice:5/2", {"5 elements", "4 and 7"}},
      /* keys */
      {"sequential:2x2,", {"'' after a comma", "key=value", "active"}},
      {"sequential:2x2,,leak=0", {"'' after a comma"}},
      {"sequential:2x2,leak", {"'leak' after a comma", "key=value"}},
      {"sequential:2x2,=1", {"no key ''"}},
      {"sequential:2x2,gain=1", {"no key 'gain'", "active", "pilot"}},
      {"sequential:2x2,Leak=0", {"no key 'Leak'"}},
      {"sequential:2x2, leak=0", {"no key ' leak'"}},
      {"sequential:2x2,leak=0,leak=0", {"'leak' is given twice"}},
      {"sequential:2x2,order=raster,order=0/1/2/3", {"'order'", "twice"}},
      /* times */
      {"sequential:2x2,active=", {"active", "''", "number with a unit"}},
      {"sequential:2x2,active=9.8", {"'9.8'", "unit", "9.8ms"}},
      {"sequential:2x2,active=-1ms", {"'-1ms'"}},
      {"sequential:2x2,active=1h", {"'1h'", "unit"}},
      {"sequential:2x2,active=1ms2", {"'1ms2'"}},
      {"sequential:2x2,switching=3600s", {"switching", "below an hour"}},
      {"sequential:2x2,switching=nan", {"switching", "'nan'"}},
      {"sequential:2x2,readout=0.1ns", {"readout", "finer"}},
      {"sequential:2x2,readout=99999999999999999999s", {"below an hour"}},
      /* order */
      {"sequential:2x2,order=", {"order=", "'' is no element", "raster"}},
      {"sequential:2x2,order=reversed", {"'reversed'", "bit-reversal"}},
      {"sequential:2x2,order=0/1/2", {"3 entries for 4 labels"}},
      {"sequential:2x2,order=0/1/2/3/4", {"5 entries for 4 labels"}},
      {"sequential:2x2,order=0/1/2/2", {"element 2 twice", "permutation"}},
      {"sequential:2x2,order=0/1/2/4", {"element 4", "0..3"}},
      {"sequential:2x2,order=0/1/2/-3", {"element -3", "0..3"}},
      {"sequential:2x2,order=0/1//2", {"'' is no element"}},
      {"sequential:2x2,order=0/1/2/3/", {"'' is no element"}},
      {"sequential:2x2,order=0/1/2/3.0", {"'3.0' is no element"}},
      {"sequential:2x2,order=0,2,1,3", {"'2' after a comma", "0/2/1/3"}},
      {"sequential:2x2,order=0/1/2/99999999999", {"'99999999999'"}},
      /* phase */
      {"sequential:2x2,phase=", {"phase=", "two whole numbers", "1/0"}},
      {"sequential:2x2,phase=1", {"phase=1:", "two whole numbers"}},
      {"sequential:2x2,phase=1/0/0", {"phase=1/0/0", "two whole numbers"}},
      {"sequential:2x2,phase=0.5/0", {"phase=0.5/0", "two whole numbers"}},
      {"sequential:2x2,phase=-1/0", {"phase -1/0", "0..16384"}},
      {"sequential:2x2,phase=0/16385", {"phase 0/16385", "0..16384"}},
      {"sequential:2x2,phase=0/9999999999", {"phase=0/9999999999"}},
      /* leak */
      {"sequential:2x2,leak=", {"leak=:", "from 0 to 0.5", "0.01"}},
      {"sequential:2x2,leak=1%", {"leak=1%", "from 0 to 0.5"}},
      {"sequential:2x2,leak=nan", {"leak=nan", "from 0 to 0.5"}},
      {"sequential:2x2,leak=inf", {"leak=inf", "from 0 to 0.5"}},
      {"sequential:2x2,leak=1e999", {"leak=1e999", "from 0 to 0.5"}},
      {"sequential:2x2,leak=0x1p-3", {"leak=0x1p-3", "from 0 to 0.5"}},
      {"sequential:2x2,leak=-0.1", {"leak -0.1", "0..0.5"}},
      {"sequential:2x2,leak=0.6", {"leak 0.6", "0..0.5"}},
      /* pilot */
      {"sequential:2x2,pilot=", {"pilot=:", "whole number", "pilot=16"}},
      {"sequential:2x2,pilot=yes", {"pilot=yes", "whole number"}},
      {"sequential:2x2,pilot=1.5", {"pilot=1.5", "whole number"}},
      {"sequential:2x2,pilot=-1", {"pilot of -1", "0..16384"}},
      {"sequential:2x2,pilot=100000", {"pilot of 100000", "0..16384"}},
      {std::string ("sequential:2x2\0,leak=0", 22), {"2x2\\x00"}},
  };
  for (const auto &c : cases)
    expect_words (Schedule::from_preset (c.text), c.text, c.words);
  for (const auto &c : cases) {
    const auto schedule = Schedule::from_preset (c.text);
    ASSERT_FALSE (schedule.ok ());
    EXPECT_LT (schedule.error ().message.size (), 600u);
    EXPECT_EQ (schedule.error ().message.rfind ("schedule '", 0), 0u);
  }
}

TEST (Parse, APresetBeginsWithACode)
{
  for (const char *text : {"sequential:lattice:8/3", "staircase:2x2,phase=1/1",
           "s-matrix:2x2,order=3/2/1/0"}) {
    const auto schedule = Schedule::parse (text);
    ASSERT_TRUE (schedule.ok ()) << schedule.error ().message;
    EXPECT_EQ (schedule->text (), text);
  }
  expect_words (Schedule::parse ("sequential:a/b.json"), "",
      {"tile 'a/b.json' is none of"});
}

TEST (Parse, WhatLooksLikeAPathIsAFile)
{
  for (const char *text : {"no-such.json", "./sequential:2x2", "no/such/file",
           "lattice:8/3", "matrix:2x2,order=0/1/2/3"})
    expect_words (Schedule::parse (text), text,
        {"schedule file '" + std::string (text) + "'", "cannot be opened",
            "No such file", "path of a JSON file"});
  expect_words (Schedule::parse (std::string ("./a\0b", 5)), "",
      {"'./a\\x00b'", "zero bytes"});
}

TEST (Parse, AnythingElseIsAWrongPreset)
{
  expect_words (Schedule::parse (""), "", {"empty", "sequential:2x2", "path"});
  expect_words (Schedule::parse ("2x2"), "", {"'2x2' is no code"});
  expect_words (
      Schedule::parse ("{\"format\":1}"), "", {"is no code", "JSON file"});
}

/* Every fenced block that is JSON of a schedule, and every line of one that
 * begins with the name of a code and a colon. */
TEST (Documentation, ExamplesAreRead)
{
  std::ifstream page (SOURCE_ROOT "/docs/formats.md");
  ASSERT_TRUE (page.good ());
  int presets = 0, jsons = 0;
  std::string line, block;
  for (bool fenced = false; std::getline (page, line);) {
    if (line.starts_with ("```")) {
      if (fenced && block.starts_with ("{") &&
          block.find ("\"coded-exposure\"") != block.npos) {
        const auto schedule = Schedule::from_json (block);
        EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
        jsons++;
      }
      fenced = !fenced;
      block.clear ();
    } else if (fenced) {
      block += line + "\n";
      const std::string code = line.substr (0, line.find (':') + 1);
      if (code == "sequential:" || code == "staircase:" ||
          code == "s-matrix:") {
        const auto schedule = Schedule::parse (line);
        EXPECT_TRUE (schedule.ok ()) << schedule.error ().message;
        presets++;
      }
    }
  }
  EXPECT_GE (presets, 7);
  EXPECT_GE (jsons, 2);
}

TEST_F (ScheduleFile, IsRead)
{
  const Schedule schedule = preset ("staircase:lattice:8/3,leak=0.02");
  for (const char *name : {"bench.json", "no-ending", "staircase:2x2"}) {
    const auto read =
        Schedule::parse (write (name, schedule.to_json () + "\n"));
    ASSERT_TRUE (read.ok ()) << read.error ().message;
    EXPECT_EQ (*read, schedule);
  }
}

TEST_F (ScheduleFile, ThatIsWrongIsNamed)
{
  const auto expect = [this] (const std::string &content,
                          std::vector<std::string> words) {
    const std::string path = write ("wrong.json", content);
    words.push_back ("schedule file '");
    expect_words (Schedule::parse (path), path, words);
  };
  expect ("", {"it is empty"});
  expect ("sequential:2x2", {"no valid JSON"});
  expect (Schedule ().to_json () + "x", {"no valid JSON"});
  expect ("{}", {"'format' is missing"});
  expect (std::string (Schedule::kMaxJsonSize + 1, ' '),
      {"more than 1048576 bytes"});
  expect_words (Schedule::parse (folder_.string () + "/"), "",
      {"cannot be read", "directory"});
}

TEST_F (ScheduleFile, MayBeAsLongAsTheLimit)
{
  std::string content = Schedule ().to_json ();
  content.resize (Schedule::kMaxJsonSize, ' ');
  EXPECT_TRUE (Schedule::parse (write ("long.json", content)).ok ());
}
