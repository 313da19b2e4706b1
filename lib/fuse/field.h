/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A plane of values with a margin, so that filters need no special case at the
 * border. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace codedexposure
{

/** A coordinate beyond 0 .. @p size - 1 mirrored at the border pixel, and
 * clamped where the image is smaller than the distance. */
inline int
mirrored (int at, int size)
{
  const int inside = at < 0 ? -at : at;
  return std::clamp (
      inside < size ? inside : 2 * size - 2 - inside, 0, size - 1);
}

/**
 * width x height values (of light: 255 for white), with @p margin more on every
 * side and kSlack after every row, which vectors may read and write.
 */
template <typename T>
class FieldOf
{
public:
  /** Values of the widest vector. */
  static constexpr int kSlack = 16;

  FieldOf () = default;
  FieldOf (int width, int height, int margin = 0)
      : width_ (width), height_ (height), margin_ (margin),
        stride_ (width + 2 * margin + kSlack),
        values_ (std::size_t (stride_) * std::size_t (height + 2 * margin))
  {
  }

  int width () const { return width_; }
  int height () const { return height_; }
  int margin () const { return margin_; }
  std::ptrdiff_t stride () const { return stride_; } ///< in values
  /** Row @p y in -margin .. height + margin - 1, from x = 0. */
  T *row (int y) { return values_.data () + start (y); }
  const T *row (int y) const { return values_.data () + start (y); }
  bool empty () const { return values_.empty (); }

private:
  std::ptrdiff_t start (int y) const
  {
    return (y + margin_) * stride_ + margin_;
  }

  int width_ = 0, height_ = 0, margin_ = 0;
  std::ptrdiff_t stride_ = 0;
  std::vector<T> values_;
};

using Field = FieldOf<float>;

/**
 * Pairs of neighbouring pixels (fuse::FilterRow), with each row split into
 * parts: every period-th pixel, from which a tile repeats. Row y begins at
 * x = -margin.
 */
class SplitField
{
public:
  SplitField () = default;
  SplitField (int width, int height, int margin, int period)
      : width_ (width), height_ (height), margin_ (margin), period_ (period),
        stride_ (split_length (width, period) + 2 * margin / period + 1),
        values_ (
            std::size_t (stride_ * period) * std::size_t (height + 2 * margin))
  {
  }

  /** Values of a part of @p width pixels, in whole vectors. */
  static int split_length (int width, int period)
  {
    const int length = (width + period - 1) / period;
    return (length + Field::kSlack - 1) / Field::kSlack * Field::kSlack;
  }

  int width () const { return width_; }
  int height () const { return height_; }
  int margin () const { return margin_; }
  int period () const { return period_; }
  std::ptrdiff_t stride () const { return stride_; } ///< of parts
  bool empty () const { return values_.empty (); }
  std::int32_t *row (int y) { return values_.data () + start (y); }
  const std::int32_t *row (int y) const { return values_.data () + start (y); }
  /** Where in a row pixel @p x is, from -margin on; every period-th pixel after
   * it follows. */
  std::ptrdiff_t place (int x) const
  {
    return (x + margin_) % period_ * stride_ + (x + margin_) / period_;
  }

private:
  std::ptrdiff_t start (int y) const
  {
    return (y + margin_) * stride_ * period_;
  }

  int width_ = 0, height_ = 0, margin_ = 0, period_ = 1;
  std::ptrdiff_t stride_ = 0;
  std::vector<std::int32_t> values_;
};

} // namespace codedexposure
