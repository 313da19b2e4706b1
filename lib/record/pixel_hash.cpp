/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/pixel_hash.h"

#include <bit>
#include <memory>
#include <new>

#include <xxhash.h>

#include "base/free_with.h"

namespace codedexposure
{

static_assert (std::endian::native == std::endian::little);

template <typename Pixel>
std::uint64_t
pixel_hash (ImageView<const Pixel> pixels)
{
  const std::size_t row = std::size_t (pixels.width) * sizeof (Pixel);
  if (pixels.stride == std::ptrdiff_t (row))
    return XXH3_64bits (pixels.data, row * std::size_t (pixels.height));
  const std::unique_ptr<XXH3_state_t, FreeWith<XXH3_freeState>> state (
      XXH3_createState ());
  if (!state)
    throw std::bad_alloc ();
  XXH3_64bits_reset (state.get ());
  for (int y = 0; y < pixels.height; y++)
    XXH3_64bits_update (state.get (), pixels.row (y), row);
  return XXH3_64bits_digest (state.get ());
}

template std::uint64_t pixel_hash (ImageView<const std::uint8_t>);
template std::uint64_t pixel_hash (ImageView<const std::uint16_t>);

} // namespace codedexposure
