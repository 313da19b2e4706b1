/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/finding.h"

#include <algorithm>

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

} // namespace codedexposure
