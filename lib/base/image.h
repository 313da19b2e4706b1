/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Strided two-dimensional pixels: a view and its owner. */
#pragma once

#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace codedexposure
{

/**
 * Borrowed rows of pixels.
 *
 * @p stride is the distance between rows in bytes, at least width *
 * sizeof (T); rows need no alignment beyond that of T. The view stays valid as
 * long as the memory it points at.
 */
template <typename T>
struct ImageView {
  T *data = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;

  T *row (int y) const
  {
    using Byte =
        std::conditional_t<std::is_const_v<T>, const std::byte, std::byte>;
    return reinterpret_cast<T *> (
        reinterpret_cast<Byte *> (data) + std::ptrdiff_t (y) * stride);
  }
  T &at (int x, int y) const { return row (y)[x]; }

  /** Rows [y, y + rows), all columns. */
  ImageView rows (int y, int count) const
  {
    return {row (y), width, count, stride};
  }

  /** Columns [x, x + w) of rows [y, y + h). */
  ImageView block (int x, int y, int w, int h) const
  {
    return {row (y) + x, w, h, stride};
  }

  operator ImageView<const T> () const requires (!std::is_const_v<T>)
  {
    return {data, width, height, stride};
  }
};

template <typename A, typename B>
bool
same_size (const ImageView<A> &a, const ImageView<B> &b)
{
  return a.width == b.width && a.height == b.height;
}

/** Owned pixels, rows packed, zero at first. */
template <typename T>
class Image
{
public:
  Image () = default;
  Image (int width, int height)
      : width_ (width), height_ (height),
        pixels_ (std::size_t (width) * std::size_t (height))
  {
  }

  int width () const { return width_; }
  int height () const { return height_; }
  ImageView<T> view ()
  {
    return {
        pixels_.data (), width_, height_, std::ptrdiff_t (width_ * sizeof (T))};
  }
  ImageView<const T> view () const
  {
    return {
        pixels_.data (), width_, height_, std::ptrdiff_t (width_ * sizeof (T))};
  }
  T &at (int x, int y) { return view ().at (x, y); }
  const T &at (int x, int y) const { return view ().at (x, y); }
  /** All of them, row by row. */
  std::span<T> pixels () { return pixels_; }
  std::span<const T> pixels () const { return pixels_; }

  bool operator== (const Image &) const = default;

private:
  int width_ = 0;
  int height_ = 0;
  std::vector<T> pixels_;
};

} // namespace codedexposure
