/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The page of "codedexposure doctor". */
#pragma once

#include <string>
#include <vector>

#include "doctor/finding.h"
#include "pages/page.h"

namespace codedexposure::app
{

struct DoctorPage {
  Rows head;
  bool simulated = false; ///< no real part was examined
  std::vector<Finding> findings;
  Rows profile;                  ///< empty: none was written
  std::vector<std::string> next; ///< commands to try

  std::string html () const;
};

/** "Trigger and exposure" of "trigger". */
std::string title_of (const std::string &check);
/** "PASS" */
std::string outcome_of (const Finding &finding);
/** "40.02 ± 0.01 us": no more digits than sigma has. */
std::string reading_text (const Reading &reading);

} // namespace codedexposure::app
