/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/erle.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace cexp
{

namespace
{

constexpr int kTwoByteCount = 128;
constexpr int kMaxCount = 0x7FFF;

/** Counts the bytes that it is given. */
class ByteCounter
{
public:
  void put (std::uint8_t) { size_++; }
  void put_pixels (const PlanePixel *, int count)
  {
    size_ += 3 * std::size_t (count);
  }
  std::size_t size () const { return size_; }

private:
  std::size_t size_ = 0;
};

/** Keeps the bytes that it is given. */
class ByteSink
{
public:
  explicit ByteSink (std::size_t expected) { bytes_.reserve (expected); }

  void put (std::uint8_t byte) { bytes_.push_back (byte); }
  /** On the wire, planes 16..23 come first. */
  void put_pixels (const PlanePixel *pixels, int count)
  {
    const std::size_t at = bytes_.size ();
    bytes_.resize (at + 3 * std::size_t (count));
    std::uint8_t *out = bytes_.data () + at;
    for (int i = 0; i < count; i++) {
      *out++ = std::uint8_t (pixels[i] >> 16);
      *out++ = std::uint8_t (pixels[i] >> 8);
      *out++ = std::uint8_t (pixels[i]);
    }
  }
  std::size_t size () const { return bytes_.size (); }
  Bytes take () { return std::move (bytes_); }

private:
  Bytes bytes_;
};

template <typename Sink>
void
put_count (Sink &sink, int count)
{
  if (count < kTwoByteCount) {
    sink.put (std::uint8_t (count));
  } else {
    sink.put (std::uint8_t ((count & 0x7F) | 0x80));
    sink.put (std::uint8_t (count >> 7));
  }
}

/** Where in @p row, from @p x on, pixels stop to be the same as the first. */
int
run_end (const PlanePixel *row, int x, int width)
{
  int end = x + 1;
  while (end < width && row[end] == row[x])
    end++;
  return end;
}

/** Where pixels stop to be those of the row above; @p x without such a row. */
int
copy_end (const PlanePixel *row, const PlanePixel *above, int x, int width)
{
  if (above == nullptr)
    return x;
  return int (std::mismatch (row + x, row + width, above + x).first - row);
}

/** Where a run of two or a copy begins that ends a series of literals. */
int
literal_end (const PlanePixel *row, const PlanePixel *above, int x, int width)
{
  int end = x + 1;
  while (end < width && (end + 1 == width || row[end] != row[end + 1]) &&
         (above == nullptr || row[end] != above[end]))
    end++;
  return end;
}

template <typename Sink>
void
encode_row (
    Sink &sink, const PlanePixel *row, const PlanePixel *above, int width)
{
  for (int x = 0; x < width;) {
    const int copied = copy_end (row, above, x, width);
    const int repeated = copied < width ? run_end (row, x, width) : x;
    if (copied > x && copied >= repeated) {
      sink.put (0);
      sink.put (1);
      put_count (sink, copied - x);
      x = copied;
      continue;
    }
    const int literal =
        repeated > x + 1 ? x + 1 : literal_end (row, above, x, width);
    if (literal == x + 1) { // a lone literal has no form of its own
      put_count (sink, repeated - x);
      sink.put_pixels (row + x, 1);
      x = repeated;
    } else {
      sink.put (0);
      put_count (sink, literal - x);
      sink.put_pixels (row + x, literal - x);
      x = literal;
    }
  }
}

template <typename Sink>
void
encode (Sink &sink, ImageView<const PlanePixel> image, std::size_t unit)
{
  static constexpr std::array<std::uint8_t, 3> kEndOfImage{0, 1, 0};
  assert (image.width >= 1 && image.width <= kMaxCount);
  for (int y = 0; y < image.height; y++)
    encode_row (
        sink, image.row (y), y > 0 ? image.row (y - 1) : nullptr, image.width);
  for (const std::uint8_t byte : kEndOfImage)
    sink.put (byte);
  while (sink.size () % unit != 0)
    sink.put (0);
}

} // namespace

Bytes
encode_erle (ImageView<const PlanePixel> image, std::size_t unit)
{
  ByteSink sink (erle_size (image, unit));
  encode (sink, image, unit);
  return sink.take ();
}

std::size_t
erle_size (ImageView<const PlanePixel> image, std::size_t unit)
{
  ByteCounter counter;
  encode (counter, image, unit);
  return counter.size ();
}

} // namespace cexp
