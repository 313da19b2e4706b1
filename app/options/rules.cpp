/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "rules.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>
#include <utility>
#include <vector>

#include "base/text.h"

namespace codedexposure::app
{

namespace
{

/* Without signs, spaces and leading zeros, which other readers take in
 * different ways. */
std::optional<int>
digits (std::string_view text, int low, int high)
{
  if (text.empty () || text.size () > 9 || (text.size () > 1 && text[0] == '0'))
    return std::nullopt;
  for (const char c : text)
    if (c < '0' || c > '9')
      return std::nullopt;
  const auto value = parse_int (text);
  if (!value || *value < low || *value > high)
    return std::nullopt;
  return value;
}

std::string
list_of (const std::vector<std::string> &words)
{
  std::string text;
  for (std::size_t i = 0; i < words.size (); i++) {
    if (i > 0)
      text += i + 1 == words.size () ? " or " : ", ";
    text += words[i];
  }
  return text;
}

} // namespace

Rule<Text>
text_that (
    std::function<bool (const std::string &text)> holds, std::string must_be)
{
  return {[holds = std::move (holds)] (const std::string &text) {
            return holds (text) ? std::optional (text) : std::nullopt;
          },
      std::move (must_be)};
}

Rule<Text>
any_text ()
{
  return text_that ([] (const std::string &text) { return !text.empty (); },
      "a text that is not empty");
}

Rule<Text>
one_of (std::initializer_list<const char *> words)
{
  const std::vector<std::string> known (words.begin (), words.end ());
  return text_that (
      [known] (const std::string &text) {
        return std::ranges::find (known, text) != known.end ();
      },
      list_of (known));
}

Rule<Text>
file_ending_in (const char *ending)
{
  const std::string end = ending;
  return text_that (
      [end] (const std::string &text) {
        return text.size () > end.size () && text.ends_with (end);
      },
      "a file name that ends in " + end);
}

Rule<int>
whole (int low, int high, const char *what)
{
  return {[low, high] (
              const std::string &text) { return digits (text, low, high); },
      std::string (what) + " from " + std::to_string (low) + " to " +
          std::to_string (high)};
}

Rule<double>
real (double low, double high, const char *what)
{
  return {[low, high] (const std::string &text) -> std::optional<double> {
            const auto value = parse_real (text);
            return value && *value >= low && *value <= high ? value
                                                            : std::nullopt;
          },
      what};
}

Rule<double>
any_real ()
{
  return real (-1e9, 1e9, "a number");
}

Rule<double>
seconds (bool positive)
{
  constexpr double kShortest = 1e-9, kLongest = 1e9;
  return real (positive ? kShortest : 0, kLongest,
      positive ? "a number of seconds above 0" : "a number of seconds");
}

Rule<Extent>
picture_size ()
{
  constexpr int kLargest = 99999;
  return {[] (const std::string &text) -> std::optional<Extent> {
            const auto parts = split (text, 'x');
            if (parts.size () != 2)
              return std::nullopt;
            const auto width = digits (parts[0], 1, kLargest);
            const auto height = digits (parts[1], 1, kLargest);
            if (!width || !height)
              return std::nullopt;
            return Extent{*width, *height};
          },
      "WIDTHxHEIGHT, such as 768x576"};
}

Rule<FrameRate>
frame_rate_rule ()
{
  constexpr int kMost = 9'999'999, kParts = 1000;
  return {[] (const std::string &text) -> std::optional<FrameRate> {
            const auto parts = split (text, '/');
            if (parts.size () == 2) {
              const auto num = digits (parts[0], 1, kMost);
              const auto den = digits (parts[1], 1, kMost);
              return num && den ? std::optional (FrameRate{*num, *den})
                                : std::nullopt;
            }
            const auto real = parse_real (text);
            if (!real || *real < 1.0 / kParts || *real > kMost / kParts)
              return std::nullopt;
            const int num = int (std::lround (*real * kParts));
            const int common = std::gcd (num, kParts);
            return FrameRate{num / common, kParts / common};
          },
      "a rate such as 25, 29.97 or 30000/1001"};
}

} // namespace codedexposure::app
