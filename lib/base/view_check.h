/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Checks of the images that a caller hands in, once for each call. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/image.h"
#include "base/result.h"

namespace codedexposure
{

/** The bytes of an image, whatever its pixels. */
struct ViewBytes {
  std::uintptr_t begin = 0;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;
  std::ptrdiff_t pixel = 1; ///< bytes of one

  template <typename T>
  static ViewBytes of (const ImageView<T> &view)
  {
    return {reinterpret_cast<std::uintptr_t> (view.data), view.width,
        view.height, view.stride, std::ptrdiff_t (sizeof (T))};
  }
};

/** Error unless @p view has @p width x @p height pixels in memory that can hold
 * them. @p what, such as "coded frame", is for the message. */
Result<void> check_view (
    const ViewBytes &view, const char *what, int width, int height);

/** Error where an output shares a pixel with another one, or with @p input. All
 * have passed check_view (). */
Result<void> check_apart (
    std::span<const ViewBytes> outputs, const ViewBytes *input = nullptr);

} // namespace codedexposure
