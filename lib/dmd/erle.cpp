/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/erle.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <map>
#include <utility>

namespace codedexposure
{

namespace
{

constexpr int kTwoByteCount = 128;
constexpr int kMaxCount = 0x7FFF;

void
put_count (Bytes &bytes, int count)
{
  if (count < kTwoByteCount) {
    bytes.push_back (std::uint8_t (count));
  } else {
    bytes.push_back (std::uint8_t ((count & 0x7F) | 0x80));
    bytes.push_back (std::uint8_t (count >> 7));
  }
}

/** The end of the run of equal pixels that begins at @p x. */
int
run_end (const PlanePixel *row, int x, int width)
{
  int end = x + 1;
  while (end < width && row[end] == row[x])
    end++;
  return end;
}

/** The end of the pixels equal to the row above; @p x without such a row. */
int
copy_end (const PlanePixel *row, const PlanePixel *above, int x, int width)
{
  if (above == nullptr)
    return x;
  return int (std::mismatch (row + x, row + width, above + x).first - row);
}

/** The end of the literals from @p x on: where a run or a copy begins. */
int
literal_end (const PlanePixel *row, const PlanePixel *above, int x, int width)
{
  int end = x + 1;
  while (end < width && (end + 1 == width || row[end] != row[end + 1]) &&
         (above == nullptr || row[end] != above[end]))
    end++;
  return end;
}

Bytes
encode_row (const PlanePixel *row, const PlanePixel *above, int width)
{
  Bytes bytes;
  for (int x = 0; x < width;) {
    const int copied = copy_end (row, above, x, width);
    const int repeated = copied < width ? run_end (row, x, width) : x;
    if (copied > x && copied >= repeated) {
      append (bytes, std::array<std::uint8_t, 2>{0, 1});
      put_count (bytes, copied - x);
      x = copied;
      continue;
    }
    const int literal =
        repeated > x + 1 ? x + 1 : literal_end (row, above, x, width);
    if (literal == x + 1) { // a lone literal has no form of its own
      put_count (bytes, repeated - x);
      append_pixels (bytes, row + x, 1);
      x = repeated;
    } else {
      bytes.push_back (0);
      put_count (bytes, literal - x);
      append_pixels (bytes, row + x, literal - x);
      x = literal;
    }
  }
  return bytes;
}

} // namespace

void
PiecedBytes::add (int piece)
{
  order.push_back (piece);
  size += pieces[std::size_t (piece)].size ();
}

void
PiecedBytes::add (Bytes piece)
{
  pieces.push_back (std::move (piece));
  add (int (pieces.size ()) - 1);
}

Bytes
PiecedBytes::joined () const
{
  Bytes bytes;
  bytes.reserve (size);
  for (const int piece : order)
    append (bytes, pieces[std::size_t (piece)]);
  return bytes;
}

void
append_pixels (Bytes &bytes, const PlanePixel *pixels, int count)
{
  const std::size_t at = bytes.size ();
  bytes.resize (at + 3 * std::size_t (count));
  std::uint8_t *out = bytes.data () + at;
  for (int i = 0; i < count; i++) {
    *out++ = std::uint8_t (pixels[i] >> 16);
    *out++ = std::uint8_t (pixels[i] >> 8);
    *out++ = std::uint8_t (pixels[i]);
  }
}

PiecedBytes
encode_erle (const MirrorRows<PlanePixel> &image, int x, int width)
{
  constexpr std::size_t kUnit = 4;
  assert (width >= 1 && width <= kMaxCount);
  PiecedBytes code;
  std::map<std::pair<int, int>, int> known; // by the row and the one above
  int above = -1;
  for (int y = 0; y < image.height (); y++) {
    const int row = image.order[std::size_t (y)];
    const auto [piece, is_new] =
        known.try_emplace ({row, above}, int (code.pieces.size ()));
    if (is_new)
      code.pieces.push_back (encode_row (
          image.row (y) + x, y > 0 ? image.row (y - 1) + x : nullptr, width));
    code.add (piece->second);
    above = row;
  }
  Bytes end{0, 1, 0};
  end.resize (
      end.size () + (kUnit - (code.size + end.size ()) % kUnit) % kUnit);
  code.add (std::move (end));
  return code;
}

} // namespace codedexposure
