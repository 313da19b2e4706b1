/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a check of the bench found. */
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/image.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** From the best to the worst. */
enum class Verdict { pass, warn, fail };

/** A number that a check saw. */
struct Reading {
  std::string name; ///< such as "delay"
  Measured number;
  std::string unit;      ///< such as "us"; empty: none
  std::string rule = {}; ///< what it should be, such as "at most 100"
};

/** What may be wrong, and what to do. */
struct Diagnosis {
  /** Names the cause, as in docs/doctor.md, such as "trigger-edge". */
  std::string id;
  Verdict severity = Verdict::fail; ///< warn or fail
  std::string cause;                ///< one sentence with what was seen
  std::string remedy;               ///< the one thing to try next
};

/** Points of a curve, in the order in which they are joined. */
struct Plot {
  std::string title, x_axis, y_axis;
  std::vector<Position> points = {};
  std::vector<Position> model = {}; ///< a second curve; empty: none
};

/** A picture for the page, scaled to 0..255. */
struct Exhibit {
  std::string title;
  Image<std::uint8_t> picture;
};

/** The result of a check. */
struct Finding {
  std::string check;    ///< such as "trigger"
  std::string shown;    ///< what the mirrors showed, one sentence
  bool skipped = false; ///< what it depends on has failed
  double seconds = 0.0; ///< that it took
  std::vector<Reading> readings = {};
  /** What was found that is no number: name and text. */
  std::vector<std::pair<std::string, std::string>> notes = {};
  /** The most likely one first. */
  std::vector<Diagnosis> diagnoses = {};
  std::vector<Plot> plots = {};
  std::vector<Exhibit> exhibits = {};

  /** The worst of the diagnoses. */
  Verdict verdict () const;
  /** Null if there is none of that name. */
  const Reading *reading (std::string_view name) const;
};

/** "PASS", "WARN", "FAIL" */
const char *verdict_text (Verdict verdict);

/** Findings in the strict form of docs/formats.md, one line. */
std::string findings_json (const std::vector<Finding> &findings);

} // namespace codedexposure
