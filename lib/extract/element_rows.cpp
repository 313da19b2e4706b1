/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/element_rows.h"

#include <algorithm>

namespace cexp
{

template <typename Pixel>
ElementRows<Pixel>::ElementRows (
    const SampleGrid &grid, std::span<const Target> targets)
    : targets_ (targets), n_ (grid.elements ()), cell_ (grid.cell ()),
      repeat_ (grid.repeat ())
{
  for (int j = 0; j < repeat_.height; j++)
    for (int e = 0; e < n_; e++)
      for (int i = 0; i < repeat_.width; i++) {
        const Offset at = grid.offset (e, i, j);
        places_.push_back (std::uint8_t (at.y * cell_.width + at.x));
      }

  const int widest = targets.front ().kernels<Pixel> ().lanes;
  comb_.resize (std::size_t (repeat_.width + widest));
  for (std::size_t i = 0; i < comb_.size (); i += std::size_t (repeat_.width))
    comb_[i] = Pixel (-1);
}

template <typename Pixel>
Pixel
ElementRows<Pixel>::gather (ImageView<const Pixel> coded, int j, int first,
    int count, const RowPointers<Pixel> &rows, bool large) const
{
  if (repeat_.width > 1)
    return split_and_relabel (coded, j, first, count, rows, large);

  const std::uint8_t *place = places_of_row (j);
  RowPointers<Pixel> places;
  for (int e = 0; e < n_; e++)
    places[place[e]] = rows[std::size_t (e)];
  return split (coded, j, first, count, places, large);
}

/** places[p][i] = pixel at place p of cell (first + i, j). */
template <typename Pixel>
Pixel
ElementRows<Pixel>::split (ImageView<const Pixel> coded, int j, int first,
    int count, const RowPointers<Pixel> &places, bool large) const
{
  Pixel peak = 0;
  for_segments<Pixel> (
      targets_, count, [&] (const Kernels<Pixel> &kernels, int at, int cells) {
        const auto to = moved (places, n_, at);
        const Strips strips =
            strips_for (kernels, cells, large, to.data (), n_);
        for (int y = 0; y < cell_.height; y++) {
          const Pixel *row =
              coded.row (j * cell_.height + y) + (first + at) * cell_.width;
          peak = std::max (peak, kernels.split (row, cell_.width,
                                     to.data () + y * cell_.width, strips));
        }
      });
  return peak;
}

template <typename Pixel>
Pixel
ElementRows<Pixel>::split_and_relabel (ImageView<const Pixel> coded, int j,
    int first, int count, const RowPointers<Pixel> &rows, bool large) const
{
  constexpr int kScratch = 64 * Tile::kMaxElements; /* stays in the L1 cache */
  alignas (64) Pixel scratch[kScratch];
  const int most = kScratch / n_;
  const int chunks = (count + most - 1) / most;

  Pixel peak = 0;
  for (int c = 0; c < chunks; c++) {
    const int begin = count * c / chunks;
    const int cells = count * (c + 1) / chunks - begin;
    RowPointers<Pixel> places;
    for (int p = 0; p < n_; p++)
      places[std::size_t (p)] = scratch + p * (kScratch / n_);
    peak =
        std::max (peak, split (coded, j, first + begin, cells, places, false));
    for_segments<Pixel> (
        targets_, cells, [&] (const Kernels<Pixel> &kernels, int at, int part) {
          const auto from = moved (places, n_, at);
          const auto to = moved (rows, n_, begin + at);
          kernels.relabel (from.data (), places_of_row (j), n_, repeat_.width,
              (first + begin + at) % repeat_.width, comb_.data (), to.data (),
              strips_for (kernels, part, large, to.data (), n_));
        });
  }
  return peak;
}

template class ElementRows<std::uint8_t>;
template class ElementRows<std::uint16_t>;

} // namespace cexp
