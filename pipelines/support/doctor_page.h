/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The page of the bench doctor: HTML, with all its pictures. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "doctor/finding.h"

struct DoctorPage {
  std::string style; ///< CSS, that of pipelines/report
  /** Names and texts at the top. */
  std::vector<std::pair<std::string, std::string>> head;
  bool simulated = false; ///< no real part was examined
  std::vector<std::pair<std::string, std::string>> titles; ///< of the checks
  std::vector<codedexposure::Finding> findings;
  /** Rows of the bench profile; empty: none was written. */
  std::vector<std::pair<std::string, std::string>> profile;
  std::vector<std::string> next; ///< commands to try
};

std::string html_of (const DoctorPage &page);
/** "40.02 ± 0.01 us": no more digits than sigma has. */
std::string reading_text (const codedexposure::Reading &reading);
