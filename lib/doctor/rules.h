/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the checks judge by. */
#pragma once

#include <limits>
#include <string_view>

namespace codedexposure
{

/** Bounds that a number may reach. */
struct Limits {
  double low = -std::numeric_limits<double>::infinity ();
  double high = std::numeric_limits<double>::infinity ();
};

/** What a number should be; what is wrong if it is not; and what to do. */
struct Rule {
  const char *id;      ///< of the diagnosis; empty: others tell what is wrong
  const char *reading; ///< name of the number; empty: it is not shown
  const char *unit;
  Limits good;       ///< beyond them: WARN
  Limits bearable;   ///< beyond them: FAIL
  const char *cause; ///< with {} for the number; empty: the check tells it
  const char *remedy;
};

/** The rule whose reading or id is @p name; an empty one if there is none. */
const Rule &rule_of (std::string_view name);

} // namespace codedexposure
