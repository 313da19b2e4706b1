/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A calibration in one picture. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibrate/calibration.h"
#include "panel.h"

namespace codedexposure
{

struct CalibrationReport {
  std::string title = {};
  std::string verdict = {}; ///< one line
  bool within = false;      ///< the tolerance; the colour of the verdict
  std::vector<std::string> lines = {};
  std::optional<FringePair> before = {}; ///< the alignment
  std::optional<FringePair> after = {};
  const CalibrationResult *result = nullptr; ///< never null
};

/** Writes the picture, fringes, residuals and the use of each pixel, as PNG.
 * Error when the file cannot be written. */
Result<void> write_report (
    const std::string &path, const CalibrationReport &report);

} // namespace codedexposure
