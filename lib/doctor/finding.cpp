/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/finding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "base/json.h"
#include "base/text.h"
#include "doctor/rules.h"

namespace codedexposure
{

bool
is_finite (const Measured &number)
{
  return std::isfinite (number.value) && std::isfinite (number.sigma);
}

Verdict
Finding::verdict () const
{
  Verdict worst = Verdict::pass;
  for (const Reading &reading : readings)
    if (!is_finite (reading.number))
      worst = Verdict::unknown;
  for (const Diagnosis &diagnosis : diagnoses)
    worst = std::max (worst, diagnosis.severity);
  return worst;
}

bool
Finding::is_known () const
{
  return std::ranges::all_of (readings, [] (const Reading &reading) {
    return is_finite (reading.number);
  }) && std::ranges::none_of (diagnoses, [] (const Diagnosis &diagnosis) {
    return diagnosis.severity == Verdict::unknown;
  });
}

const Reading *
Finding::reading (std::string_view name) const
{
  const auto found = std::ranges::find (readings, name, &Reading::name);
  return found == readings.end () ? nullptr : &*found;
}

namespace
{

/* "at most 100", "40 to 95", "0" */
std::string
text_of (const Limits &limits)
{
  const std::string low = real_text (limits.low),
                    high = real_text (limits.high);
  if (std::isinf (limits.low))
    return std::isinf (limits.high) ? "" : "at most " + high;
  if (std::isinf (limits.high))
    return "at least " + low;
  return low == high ? low : low + " to " + high;
}

} // namespace

void
Finding::add (std::string_view name, const Measured &number)
{
  const Rule &rule = rule_of (name);
  readings.push_back ({rule.reading, number, rule.unit, text_of (rule.good)});
}

void
Finding::blame (std::string_view id, std::string cause, Verdict severity,
    std::string remedy)
{
  diagnoses.push_back ({std::string (id), severity, std::move (cause),
      remedy.empty () ? rule_of (id).remedy : std::move (remedy)});
}

Verdict
Finding::judge (
    std::string_view name, const Measured &number, const std::string &cause)
{
  const Rule &rule = rule_of (name);
  const Verdict verdict = verdict_of (name, number);
  if (verdict == Verdict::pass || *rule.id == 0)
    return verdict;
  std::string text = cause.empty () ? rule.cause : cause;
  if (const std::size_t at = text.find ("{}"); at != text.npos)
    text.replace (at, 2, codedexposure::shown (number.value));
  const std::string what = *rule.reading == 0 ? rule.id : rule.reading;
  const std::string unit = std::string (*rule.unit == 0 ? "" : " ") + rule.unit;
  if (!is_finite (number))
    text = what + " could not be measured: it should be " +
           text_of (rule.good) + unit;
  else if (verdict == Verdict::unknown)
    text = what + " is " + codedexposure::shown (number.value) + " +- " +
           codedexposure::shown (number.sigma) + unit +
           ", too uncertain to tell whether it is " + text_of (rule.good);
  blame (rule.id, std::move (text), verdict, rule.remedy);
  return verdict;
}

void
Finding::judge_bits (int missing, int bits)
{
  if (missing > 0)
    blame ("missing-bits", "the lowest " + std::to_string (missing) + " of " +
                               std::to_string (bits) + " bits are always 0");
}

void
Finding::sort ()
{
  std::ranges::stable_sort (
      diagnoses, std::ranges::greater (), &Diagnosis::severity);
}

Verdict
verdict_of (std::string_view name, const Measured &number)
{
  if (!is_finite (number))
    return Verdict::unknown;
  const double low = number.value - 2.0 * number.sigma;
  const double high = number.value + 2.0 * number.sigma;
  const auto breaks = [&] (const Limits &limits) {
    return low > limits.high || high < limits.low;
  };
  const Rule &rule = rule_of (name);
  if (breaks (rule.good))
    return breaks (rule.bearable) ? Verdict::fail : Verdict::warn;
  return low >= rule.good.low && high <= rule.good.high ? Verdict::pass
                                                        : Verdict::unknown;
}

const char *
verdict_text (Verdict verdict)
{
  constexpr const char *kTexts[] = {"PASS", "UNKNOWN", "WARN", "FAIL"};
  return kTexts[int (verdict)];
}

std::string
fixed (double value, int decimals)
{
  std::array<char, 64> text;
  std::snprintf (text.data (), text.size (), "%.*f", decimals, value);
  const std::string number = text.data ();
  const bool zero = number.find_first_of ("123456789") == number.npos;
  return zero && number[0] == '-' ? number.substr (1) : number;
}

std::string
shown (double value)
{
  const double size = std::abs (value);
  return fixed (
      value, size >= 100 || !(size > 0)
                 ? 0
                 : std::min (6, 2 - int (std::floor (std::log10 (size)))));
}

namespace
{

OrderedJson
json_of (const Finding &finding)
{
  OrderedJson readings = OrderedJson::array ();
  for (const auto &[name, number, unit, rule] : finding.readings) {
    readings.push_back ({{"name", name}, {"value", number.value},
        {"sigma", number.sigma}, {"unit", unit}});
    if (!rule.empty ())
      readings.back ()["rule"] = rule;
  }
  OrderedJson diagnoses = OrderedJson::array ();
  for (const auto &[id, severity, cause, remedy] : finding.diagnoses)
    diagnoses.push_back ({{"id", id}, {"severity", verdict_text (severity)},
        {"cause", cause}, {"remedy", remedy}});
  OrderedJson notes = OrderedJson::object ();
  for (const auto &[name, text] : finding.notes)
    notes[name] = text;
  return {{"check", finding.check},
      {"verdict",
          finding.skipped ? "SKIPPED" : verdict_text (finding.verdict ())},
      {"shown", finding.shown}, {"seconds", finding.seconds},
      {"readings", readings}, {"notes", notes}, {"diagnoses", diagnoses}};
}

} // namespace

std::string
findings_json (const std::vector<Finding> &findings)
{
  OrderedJson checks = OrderedJson::array ();
  Verdict worst = Verdict::pass;
  for (const Finding &finding : findings) {
    checks.push_back (json_of (finding));
    worst = std::max (worst, finding.verdict ());
  }
  const OrderedJson root{{"format", "coded-exposure-findings"}, {"version", 1},
      {"verdict", verdict_text (worst)}, {"checks", checks}};
  return root.dump (-1, ' ', false, OrderedJson::error_handler_t::replace);
}

} // namespace codedexposure
