/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace codedexposure
{

namespace
{

/** Bytes of the printable multi-byte UTF-8 character at the beginning of
 * @p text; 0: there is none. */
std::size_t
multibyte_length (std::string_view text)
{
  const auto byte = [text] (std::size_t i) {
    return std::uint32_t (static_cast<unsigned char> (text[i]));
  };
  const std::uint32_t lead = byte (0);
  const std::size_t length = lead >= 0xf0   ? 4
                             : lead >= 0xe0 ? 3
                             : lead >= 0xc0 ? 2
                                            : 0;
  if (length == 0 || lead > 0xf4 || text.size () < length)
    return 0;

  std::uint32_t point = lead & (0x7fU >> length);
  for (std::size_t i = 1; i < length; i++) {
    if ((byte (i) & 0xc0U) != 0x80U)
      return 0;
    point = point << 6 | (byte (i) & 0x3fU);
  }
  constexpr std::array<std::uint32_t, 5> kSmallest{0, 0, 0xa0, 0x800, 0x10000};
  const bool surrogate = point >= 0xd800 && point <= 0xdfff;
  return point < kSmallest[length] || point > 0x10ffff || surrogate ? 0
                                                                    : length;
}

template <typename T>
std::optional<T>
parse_whole (std::string_view text)
{
  T value{};
  const char *end = text.data () + text.size ();
  const auto [stop, error] = std::from_chars (text.data (), end, value);
  if (error != std::errc () || stop != end)
    return std::nullopt;
  return value;
}

} // namespace

std::string
printable (std::string_view text, std::size_t limit)
{
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string shown;
  for (std::size_t i = 0; i < text.size ();) {
    const auto byte = static_cast<unsigned char> (text[i]);
    const bool ascii = byte >= 0x20 && byte < 0x7f;
    const std::size_t length = ascii ? 1 : multibyte_length (text.substr (i));
    if (i + (length > 0 ? length : 1) > limit)
      return shown + "...";
    if (length > 0) {
      shown += text.substr (i, length);
      i += length;
    } else {
      shown += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
      i++;
    }
  }
  return shown;
}

std::string
in_quotes (std::string_view text, std::size_t limit)
{
  std::string shown = printable (text, limit);
  shown.insert (shown.begin (), '\'');
  shown += '\'';
  return shown;
}

std::optional<int>
parse_int (std::string_view text)
{
  return parse_whole<int> (text);
}

std::optional<double>
parse_real (std::string_view text)
{
  const auto value = parse_whole<double> (text);
  return value && std::isfinite (*value) ? value : std::nullopt;
}

std::string
real_text (double value)
{
  std::array<char, 32> text;
  const auto [end, error] =
      std::to_chars (text.data (), text.data () + text.size (), value);
  return error == std::errc () ? std::string (text.data (), end) : "?";
}

std::vector<std::string_view>
split (std::string_view text, char separator)
{
  std::vector<std::string_view> pieces;
  for (;;) {
    const std::size_t at = text.find (separator);
    pieces.push_back (text.substr (0, at));
    if (at == text.npos)
      return pieces;
    text.remove_prefix (at + 1);
  }
}

} // namespace codedexposure
