/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Which values an option takes: each kind of value is read and described here,
 * and nowhere else. Numbers are read in the C locale. */
#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <string>

#include "base/geometry.h"
#include "schedule/timing.h"

namespace codedexposure::app
{

/** Reads the text of a value; none if it is not what it must be. */
template <typename T>
struct Rule {
  std::function<std::optional<T> (const std::string &text)> read;
  std::string must_be; ///< "a number from 1 to 16"
};

using Text = std::string;

/** Any text for which @p holds is true. */
Rule<Text> text_that (
    std::function<bool (const std::string &text)> holds, std::string must_be);
/** Any text that is not empty. */
Rule<Text> any_text ();
/** One of these words. */
Rule<Text> one_of (std::initializer_list<const char *> words);
/** A file name with this ending, such as ".mkv". */
Rule<Text> file_ending_in (const char *ending);
/** Whole numbers from @p low to @p high. */
Rule<int> whole (int low, int high, const char *what = "a number");
/** Real numbers from @p low to @p high. */
Rule<double> real (double low, double high, const char *what);
Rule<double> any_real ();
/** At least 0; a time is above 0 if @p positive. */
Rule<double> seconds (bool positive = false);
Rule<Extent> picture_size ();
/** "25", "29.97" or "30000/1001". */
Rule<FrameRate> frame_rate_rule ();

} // namespace codedexposure::app
