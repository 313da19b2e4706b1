/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads DLPC900 images the way the format is written down, independently of
 * the encoder. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/image.h"

namespace codedexposure::emulated
{

using Pixels = Image<std::uint32_t>;

/** Reads bytes one after the other; past the end, it fails for good. */
class ByteReader
{
public:
  explicit ByteReader (const std::vector<std::uint8_t> &bytes, std::size_t at)
      : bytes_ (bytes), at_ (at)
  {
  }
  int next ()
  {
    if (at_ >= bytes_.size ()) {
      failed_ = true;
      return 0;
    }
    return bytes_[at_++];
  }
  int next_count (int first)
  {
    return first < 128 ? first : (first & 127) + 128 * next ();
  }
  std::uint32_t next_pixel ()
  {
    const int a = next (), b = next (), c = next ();
    return std::uint32_t (a) * 65536 + std::uint32_t (b) * 256 +
           std::uint32_t (c);
  }
  bool failed () const { return failed_; }
  std::size_t at () const { return at_; }

private:
  const std::vector<std::uint8_t> &bytes_;
  std::size_t at_;
  bool failed_ = false;
};

/** Fills pixels along rows; no step may cross the end of a row. */
class PixelCursor
{
public:
  explicit PixelCursor (Pixels &image) : image_ (image) {}

  bool fits (int count) const
  {
    return count > 0 && y_ < image_.height () && x_ + count <= image_.width ();
  }
  void put (std::uint32_t pixel)
  {
    image_.at (x_, y_) = pixel;
    if (++x_ == image_.width ()) {
      x_ = 0;
      y_++;
    }
  }
  std::uint32_t above () const { return image_.at (x_, y_ - 1); }
  int row () const { return y_; }
  bool full () const { return y_ == image_.height (); }

private:
  Pixels &image_;
  int x_ = 0;
  int y_ = 0;
};

/** Fills @p image from enhanced run-length code; false for a malformed one. */
inline bool
decode_erle (ByteReader &in, Pixels &image)
{
  PixelCursor out (image);
  for (;;) {
    const int first = in.next ();
    if (in.failed ())
      return false;
    if (first != 0) {
      const int count = in.next_count (first);
      if (!out.fits (count))
        return false;
      const std::uint32_t pixel = in.next_pixel ();
      for (int i = 0; i < count; i++)
        out.put (pixel);
      continue;
    }
    const int second = in.next ();
    if (second == 0)
      continue; // end of a line
    if (second != 1) {
      const int count = in.next_count (second);
      if (!out.fits (count))
        return false;
      for (int i = 0; i < count; i++)
        out.put (in.next_pixel ());
      continue;
    }
    const int count = in.next_count (in.next ());
    if (count == 0)
      return out.full () && !in.failed ();
    if (!out.fits (count) || out.row () == 0)
      return false;
    for (int i = 0; i < count; i++)
      out.put (out.above ());
  }
}

/** The image of a header and its pixels, none where anything is wrong. */
inline std::optional<Pixels>
decode_spld (const std::vector<std::uint8_t> &bytes)
{
  constexpr std::size_t kHeader = 48;
  if (bytes.size () < kHeader ||
      std::string (bytes.begin (), bytes.begin () + 4) != "Spld")
    return std::nullopt;
  const auto u16 = [&] (std::size_t at) {
    return int (bytes[at]) + 256 * bytes[at + 1];
  };
  const std::size_t size = std::size_t (u16 (8)) + 65536u * unsigned (u16 (10));
  if (size + kHeader != bytes.size () || u16 (4) == 0 || u16 (6) == 0)
    return std::nullopt;

  Pixels image (u16 (4), u16 (6));
  ByteReader in (bytes, kHeader);
  if (bytes[25] == 2)
    return decode_erle (in, image) ? std::optional (image) : std::nullopt;
  if (bytes[25] != 0)
    return std::nullopt;
  const int padding = (16 - 3 * image.width () % 16) % 16;
  for (int y = 0; y < image.height (); y++) {
    for (int x = 0; x < image.width (); x++)
      image.at (x, y) = in.next_pixel ();
    for (int i = 0; i < padding; i++)
      in.next ();
  }
  return in.failed () ? std::nullopt : std::optional (image);
}

} // namespace codedexposure::emulated
