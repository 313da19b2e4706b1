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
/** Pairs of neighbouring pixels; see fuse::PairRow. */
using PairField = FieldOf<std::int32_t>;

} // namespace codedexposure
