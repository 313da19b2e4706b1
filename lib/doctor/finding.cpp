/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/finding.h"

#include <algorithm>

#include "base/json.h"

namespace codedexposure
{

Verdict
Finding::verdict () const
{
  Verdict worst = Verdict::pass;
  for (const Diagnosis &diagnosis : diagnoses)
    worst = std::max (worst, diagnosis.severity);
  return worst;
}

const Reading *
Finding::reading (std::string_view name) const
{
  const auto found = std::ranges::find (readings, name, &Reading::name);
  return found == readings.end () ? nullptr : &*found;
}

const char *
verdict_text (Verdict verdict)
{
  switch (verdict) {
  case Verdict::pass:
    return "PASS";
  case Verdict::warn:
    return "WARN";
  default:
    return "FAIL";
  }
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
