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

/** From the best to the worst. What is not known is never good. */
enum class Verdict { pass, unknown, warn, fail };

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
  /** warn or fail; unknown: whether it is so cannot be told. */
  Verdict severity = Verdict::fail;
  std::string cause;  ///< one sentence with what was seen
  std::string remedy; ///< the one thing to try next
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

  /** The worst of the diagnoses; unknown if there is none, but a reading that
   * is no finite number. */
  Verdict verdict () const;
  /** Whether every reading is a finite number, and no diagnosis is unknown. */
  bool is_known () const;
  /** Whether a diagnosis says that something is wrong. */
  bool is_ill () const { return verdict () >= Verdict::warn; }
  /** Null if there is none of that name. */
  const Reading *reading (std::string_view name) const;

  /** Adds the reading @p name of rules.cpp, with its unit and rule. */
  void add (std::string_view name, const Measured &number);
  /** Adds a diagnosis, with the remedy of rules.cpp if there is no other. */
  void blame (std::string_view id, std::string cause,
      Verdict severity = Verdict::fail, std::string remedy = {});
  /** Adds the diagnosis of the rule @p name unless verdict_of () passes.
   * @p cause: of what is wrong, in place of that of the rule. */
  Verdict judge (std::string_view name, const Measured &number,
      const std::string &cause = {});
  /** Adds a diagnosis where the lowest @p missing of @p bits never are 1. */
  void judge_bits (int missing, int bits);
  /** add () and judge (). */
  Verdict measure (std::string_view name, const Measured &number,
      const std::string &cause = {})
  {
    add (name, number);
    return judge (name, number, cause);
  }
  /** Sorts the diagnoses by their severity. */
  void sort ();
};

/**
 * What the rule @p name of rules.cpp says of @p number: warn or fail if it is
 * beyond the limits by twice its standard deviation; pass if it is within them
 * by as much. Else it is unknown.
 */
Verdict verdict_of (std::string_view name, const Measured &number);

bool is_finite (const Measured &number);

/** "PASS", "UNKNOWN", "WARN", "FAIL" */
const char *verdict_text (Verdict verdict);

/** Findings in the strict form of docs/formats.md, one line. */
std::string findings_json (const std::vector<Finding> &findings);

/** @p number, and its standard deviation, in a unit that is 1 / @p factor of
 * its own. */
inline Measured
scaled (const Measured &number, double factor)
{
  return {factor * number.value, factor * number.sigma};
}

/** "1.50"; never "-0". */
std::string fixed (double value, int decimals);
/** With three digits, or all of those before the point: "0.0123", "1234". */
std::string shown (double value);

} // namespace codedexposure
