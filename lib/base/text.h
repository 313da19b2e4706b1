/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Text of unknown origin: numbers out of it, and its safe display. */
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cexp
{

/** @p text as one line of valid UTF-8, fit for a message: bytes that are no
 * printable character stand as \xNN, and what lies beyond @p limit bytes is
 * replaced by "...". */
std::string printable (std::string_view text, std::size_t limit = 64);

/** printable () in single quotes. */
std::string in_quotes (std::string_view text, std::size_t limit = 64);

/** The whole of @p text as a decimal integer that fits an int. */
std::optional<int> parse_int (std::string_view text);

/** The whole of @p text as a finite decimal number, such as 0.01 or 1e-2. */
std::optional<double> parse_real (std::string_view text);

/** The shortest text that parse_real () turns into @p value again. */
std::string real_text (double value);

/** The pieces between separators: one more than there are separators. */
std::vector<std::string_view> split (std::string_view text, char separator);

} // namespace cexp
