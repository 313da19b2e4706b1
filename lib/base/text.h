/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Parses text of unknown origin, and makes it safe to show. */
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace codedexposure
{

/** @p text as one line of valid UTF-8 for a message: bytes that are not part of
 * a printable character become \xNN, and "..." replaces everything beyond
 * @p limit bytes. */
std::string printable (std::string_view text, std::size_t limit = 64);

/** printable () in single quotes. */
std::string in_quotes (std::string_view text, std::size_t limit = 64);

/** All of @p text as a decimal integer that fits an int; none otherwise. */
std::optional<int> parse_int (std::string_view text);

/** All of @p text as a finite decimal number, such as 0.01 or 1e-2; none
 * otherwise. */
std::optional<double> parse_real (std::string_view text);

/** The shortest text that parse_real () reads as @p value. */
std::string real_text (double value);

/** The pieces of @p text between separators, empty ones included. */
std::vector<std::string_view> split (std::string_view text, char separator);

} // namespace codedexposure
