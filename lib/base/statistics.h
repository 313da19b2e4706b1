/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Statistics of numbers, and of the pixels of pictures. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"

namespace codedexposure
{

/** Calls @p use (x, y) for each pixel of @p picture, row by row. */
template <typename Picture, typename Use>
void
each_pixel (const Picture &picture, Use use)
{
  int width, height;
  if constexpr (requires { picture.width (); }) {
    width = picture.width ();
    height = picture.height ();
  } else {
    width = picture.width;
    height = picture.height;
  }
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      use (x, y);
}

/** Calls @p use (x, y) for the pixels of @p picture that are at most @p reach
 * from @p at along both axes. */
template <typename T, typename Use>
void
each_near (const Image<T> &picture, Offset at, int reach, Use use)
{
  for (int y = std::max (0, at.y - reach);
       y <= std::min (picture.height () - 1, at.y + reach); y++)
    for (int x = std::max (0, at.x - reach);
         x <= std::min (picture.width () - 1, at.x + reach); x++)
      use (x, y);
}

/** The value that @p part of @p values are below; 0 without values. */
template <typename T>
T
quantile (std::vector<T> values, double part)
{
  if (values.empty ())
    return T ();
  const auto at =
      values.begin () + std::ptrdiff_t (std::min (double (values.size ()) - 1.0,
                            part * double (values.size ())));
  std::nth_element (values.begin (), at, values.end ());
  return *at;
}

/** The same of the pixels of @p picture. */
template <typename T>
T
quantile (const Image<T> &picture, double part)
{
  const auto all = picture.pixels ();
  return quantile (std::vector<T> (all.begin (), all.end ()), part);
}

template <typename T>
T
median (std::vector<T> values)
{
  return quantile (std::move (values), 0.5);
}

/** 0 of a picture without pixels. */
template <typename T>
double
mean_of (ImageView<T> picture)
{
  /* Whole numbers are added much faster. */
  std::conditional_t<std::is_integral_v<T>, std::uint64_t, double> sum = 0;
  each_pixel (picture, [&] (int x, int y) { sum += picture.at (x, y); });
  return double (sum) / std::max (1.0, double (picture.width) * picture.height);
}

/** @p a less @p b, which has the same size. */
inline Image<float>
difference (Image<float> a, const Image<float> &b)
{
  each_pixel (a, [&] (int x, int y) { a.at (x, y) -= b.at (x, y); });
  return a;
}

} // namespace codedexposure
