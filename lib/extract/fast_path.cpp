/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/fast_path.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace codedexposure
{

namespace
{

/* Coded frames from this size on do not fit the caches together with their
 * subframes and the next frame, so nothing is gained by writing into them. */
constexpr std::size_t kLargeFrame = std::size_t (8) << 20;
/* As much of a frame is worked on before saturated pixels are looked for: few
 * enough to be still in the caches, enough to make calls cheap. */
constexpr std::size_t kBand = std::size_t (128) << 10;
constexpr std::size_t kLine = 64;

/**
 * Calls @p body (kernels, first, count) for parts that cover @p cells cells:
 * the widest vectors, and at the end some half as wide where these are enough.
 * Parts may overlap. @p cells is at least the lanes of the last target; without
 * @p halves vectors have one width throughout.
 */
template <typename Pixel, typename Body>
void
for_segments (
    std::span<const Target> targets, int cells, bool halves, Body body)
{
  int at = 0;
  for (std::size_t t = 0; t < targets.size () && at < cells; t++) {
    const Kernels<Pixel> &kernels = targets[t].kernels<Pixel> ();
    const int lanes = kernels.lanes;
    if (cells < lanes)
      continue;
    const int left_over = (cells - at) % lanes;
    const bool half_is_enough = halves && t == 0 && targets.size () > 1 &&
                                left_over <= lanes / 2 &&
                                lanes / 2 == targets[1].kernels<Pixel> ().lanes;
    const int end = half_is_enough ? cells - left_over : cells;
    const int first = std::min (at, end - lanes);
    if (end > at)
      body (kernels, first, end - first);
    at = end;
  }
}

/** Whether all rows lie equally to lines of the cache. */
template <typename Pixel>
bool
equally_aligned (std::span<Pixel *const> rows)
{
  const auto address = [] (Pixel *row) {
    return reinterpret_cast<std::uintptr_t> (row) % kLine;
  };
  return std::ranges::all_of (
      rows, [&] (Pixel *row) { return address (row) == address (rows[0]); });
}

/** A staircase without leak: slot k is a multiple of element k less element
 * k - 1. Its factor, or 0. */
double
staircase_factor (const Decoder &decoder)
{
  const double factor = decoder.terms (0).back ().factor;
  for (int s = 0; s < decoder.slots (); s++) {
    const auto terms = decoder.terms (s);
    const bool is_step =
        terms.back () == Term{s, factor} &&
        (s == 0 ? terms.size () == 1
                : terms.size () == 2 && terms[0] == Term{s - 1, -factor});
    if (!is_step)
      return 0.0;
  }
  return factor;
}

} // namespace

/** Elements of some columns of cells, for one row of cells or a ring of
 * three, with a cell more at either end where neighbours are needed. */
template <typename Pixel>
struct FastPath<Pixel>::Chunk {
  /* Three rows of 66 cells of 256 elements. A single row takes no more than
   * the L1 cache. */
  static constexpr int kRingPixels = 3 * 66 * Tile::kMaxElements;
  static constexpr int kRowPixels = 64 * Tile::kMaxElements;

  alignas (64) Pixel pixels[kRingPixels];
  Pixel peaks[3];
  int n;
  int first;
  int count;
  int halo;
  int pitch;

  static int most_cells (int n, bool ring)
  {
    return ring ? std::min (kRingPixels / 3 / n - 2, kMaxRowCells)
                : kRowPixels / n;
  }

  int slot (int j) const { return halo > 0 ? j % 3 : 0; }
  Pixel *row (int j, int element)
  {
    return pixels + (slot (j) * n + element) * pitch + halo;
  }
  const Pixel *row (int j, int element) const
  {
    return pixels + (slot (j) * n + element) * pitch + halo;
  }
  Pixel peak (int j) const { return peaks[slot (j)]; }

  void fill (std::span<const Target> targets, const LayoutTable<Pixel> &layout,
      const SampleGrid &grid, ImageView<const Pixel> coded, int j, int width)
  {
    const Extent cell = grid.cell ();
    const int begin = std::max (first - halo, 0);
    const int end = std::min (first + count + halo, width);
    Pixel &peak = peaks[slot (j)] = 0;
    for_segments<Pixel> (targets, end - begin, true,
        [&] (const Kernels<Pixel> &kernels, int at, int cells) {
          RowPointers<Pixel> rows;
          for (int e = 0; e < n; e++)
            rows[std::size_t (e)] = row (j, e) + (begin + at - first);
          const Block<Pixel> block = {
              coded.row (j * cell.height) + (begin + at) * cell.width,
              coded.stride, cell.width, cell.height, cells, 1};
          peak = std::max (
              peak, kernels.select (
                        block, layout.from (begin + at, j), {rows.data (), 0}));
        });
    if (halo == 0)
      return;
    for (int e = 0; e < n; e++) {
      Pixel *const at = row (j, e);
      if (first == 0)
        at[-1] = at[0];
      if (end == first + count)
        at[count] = at[count - 1];
    }
  }
};

template <typename Pixel>
LayoutTable<Pixel>::LayoutTable (const SampleGrid &grid, int lanes)
    : n_ (grid.elements ()), repeat_ (grid.repeat ()),
      elements_ (std::size_t (n_ * repeat_.height)),
      comb_ (std::size_t (repeat_.width + lanes))
{
  for (int j = 0; j < repeat_.height; j++)
    for (int e = 0; e < n_; e++)
      for (int i = 0; i < repeat_.width; i++) {
        const Offset at = grid.offset (e, i, j);
        const int place = at.y * grid.cell ().width + at.x;
        places_.push_back (std::uint8_t (place));
        elements_[std::size_t (j * n_ + place)] = std::uint8_t (e);
        identity_ = identity_ && place == e;
      }
  for (std::size_t i = 0; i < comb_.size (); i += std::size_t (repeat_.width))
    comb_[i] = Pixel (-1);
}

template <typename Pixel>
std::optional<FastPath<Pixel>>
FastPath<Pixel>::make (const ExtractPlan &plan, std::span<const Target> targets)
{
  while (!targets.empty () &&
         targets.front ().kernels<Pixel> ().lanes > plan.size.width)
    targets = targets.subspan (1);
  if (targets.empty ())
    return {};
  return FastPath (plan, targets);
}

template <typename Pixel>
FastPath<Pixel>::FastPath (
    const ExtractPlan &plan, std::span<const Target> targets)
    : plan_ (&plan), targets_ (targets),
      layout_ (plan.grid, targets.front ().kernels<Pixel> ().lanes)
{
  if (plan.decoder) {
    take_terms (*plan.decoder);
    take_weights ();
  }
}

template <typename Pixel>
void
FastPath<Pixel>::take_terms (const Decoder &decoder)
{
  const double factor = staircase_factor (decoder);
  if (decoder.interpolates () && factor == 0.25)
    form_ = DecodeForm::kLerpDifference;
  else if (!decoder.interpolates () && factor >= 1.0 && factor <= 256.0 &&
           factor == std::floor (factor))
    form_ = DecodeForm::kDifference;

  for (int s = 0; s < decoder.slots (); s++) {
    for (const Term &term : decoder.terms (s)) {
      term_elements_.push_back (term.element);
      term_factors_.push_back (term.factor);
    }
  }
  std::size_t start = 0;
  for (int s = 0; s < decoder.slots (); s++) {
    const std::size_t size = decoder.terms (s).size ();
    terms_.push_back ({term_elements_.data () + start,
        term_factors_.data () + start, int (size)});
    start += size;
  }
}

template <typename Pixel>
void
FastPath<Pixel>::take_weights ()
{
  for (int e = 0; e < plan_->grid.elements (); e++) {
    const Offset offset = plan_->grid.offset (e, 0, 0);
    const Lerp x = plan_->decoder->lerp_x (offset);
    const Lerp y = plan_->decoder->lerp_y (offset);
    weights_.push_back (
        {nullptr, nullptr, {x.near, x.far}, {y.near, y.far}, x.step});
    row_steps_.push_back (y.step);
  }
}

template <typename Pixel>
ExtractReport
FastPath<Pixel>::run (ImageView<const Pixel> coded,
    std::span<const ImageView<Pixel>> subframes, RowRange rows) const
{
  const bool through_elements =
      plan_->method == Method::kDecode && form_ != DecodeForm::kDifference;
  return {through_elements ? decode (coded, subframes, rows)
                           : run_bands (coded, subframes, rows)};
}

template <typename Pixel>
std::uint64_t
FastPath<Pixel>::run_bands (ImageView<const Pixel> coded,
    std::span<const ImageView<Pixel>> subframes, RowRange rows) const
{
  const std::size_t n = subframes.size ();
  const std::size_t row_bytes =
      n * std::size_t (plan_->size.width) * sizeof (Pixel);
  const std::ptrdiff_t stride = subframes[0].stride;
  const bool one_stride = std::ranges::all_of (
      subframes, [stride] (const auto &s) { return s.stride == stride; });
  const int band = one_stride ? std::max (1, int (kBand / row_bytes)) : 1;
  const bool large =
      row_bytes * std::size_t (plan_->size.height) >= kLargeFrame;

  std::uint64_t count = 0;
  bool streamed = false;
  const int end = rows.first + rows.count;
  for (int j = rows.first; j < end; j += band) {
    RowPointers<Pixel> to;
    for (std::size_t k = 0; k < n; k++)
      to[plan_->method == Method::kSelect ? std::size_t (plan_->elements[k])
                                          : k] = subframes[k].row (j);
    const bool stream =
        large && equally_aligned<Pixel> (std::span (to).first (n));
    streamed = streamed || stream;

    const RowRange part = {j, std::min (band, end - j)};
    const Pixel peak = run_band (coded, part, {to.data (), stride, stream});
    count += saturated (coded, part, 0, plan_->size.width, peak);
  }
  if (streamed)
    targets_.front ().kernels<Pixel> ().fence ();
  return count;
}

template <typename Pixel>
Pixel
FastPath<Pixel>::run_band (
    ImageView<const Pixel> coded, RowRange rows, const Planes<Pixel> &to) const
{
  const Extent cell = plan_->grid.cell ();
  const std::size_t n = std::size_t (plan_->grid.elements ());
  Pixel peak = 0;
  for_segments<Pixel> (targets_, plan_->size.width, !to.stream,
      [&] (const Kernels<Pixel> &kernels, int first, int count) {
        RowPointers<Pixel> moved;
        for (std::size_t k = 0; k < n; k++)
          moved[k] = to.rows[k] + first;
        /* Narrower stores leave lines half written, which memory punishes. */
        const bool whole_lines =
            std::size_t (kernels.lanes) * sizeof (Pixel) == kLine;
        const Block<Pixel> block = {
            coded.row (rows.first * cell.height) + first * cell.width,
            coded.stride, cell.width, cell.height, count, rows.count};
        peak = std::max (
            peak, run_block (kernels, block, layout_.from (first, rows.first),
                      {moved.data (), to.stride, to.stream && whole_lines}));
      });
  return peak;
}

template <typename Pixel>
Pixel
FastPath<Pixel>::run_block (const Kernels<Pixel> &kernels,
    const Block<Pixel> &block, const Layout<Pixel> &layout,
    const Planes<Pixel> &to) const
{
  switch (plan_->method) {
  case Method::kRank:
    return kernels.rank (block, to);
  case Method::kDecode:
    return kernels.difference (block, layout,
        int (plan_->decoder->terms (0)[0].factor), Pixel (plan_->largest), to);
  default:
    return kernels.select (block, layout, to);
  }
}

template <typename Pixel>
std::uint64_t
FastPath<Pixel>::decode (ImageView<const Pixel> coded,
    std::span<const ImageView<Pixel>> subframes, RowRange rows) const
{
  if (rows.count <= 0)
    return 0;
  Chunk chunk;
  chunk.n = plan_->grid.elements ();
  chunk.halo = plan_->decoder->interpolates () ? 1 : 0;
  const int most = Chunk::most_cells (chunk.n, chunk.halo > 0);
  const int chunks = (plan_->size.width + most - 1) / most;
  chunk.pitch = (plan_->size.width + chunks - 1) / chunks + 2 * chunk.halo;

  std::uint64_t count = 0;
  for (int c = 0; c < chunks; c++) {
    chunk.first = plan_->size.width * c / chunks;
    chunk.count = plan_->size.width * (c + 1) / chunks - chunk.first;
    count += decode_chunk (coded, subframes, rows, chunk);
  }
  return count;
}

template <typename Pixel>
std::uint64_t
FastPath<Pixel>::decode_chunk (ImageView<const Pixel> coded,
    std::span<const ImageView<Pixel>> subframes, RowRange rows,
    Chunk &chunk) const
{
  const int width = plan_->size.width;
  const int height = plan_->size.height;
  std::uint64_t count = 0;
  if (chunk.halo > 0)
    for (int j = std::max (rows.first - 1, 0); j <= rows.first; j++)
      chunk.fill (targets_, layout_, plan_->grid, coded, j, width);

  for (int j = rows.first; j < rows.first + rows.count; j++) {
    if (chunk.halo == 0)
      chunk.fill (targets_, layout_, plan_->grid, coded, j, width);
    else if (j + 1 < height)
      chunk.fill (targets_, layout_, plan_->grid, coded, j + 1, width);

    RowPointers<Pixel> to;
    for (std::size_t k = 0; k < subframes.size (); k++)
      to[k] = subframes[k].row (j) + chunk.first;
    decode_row (chunk, j, to);
    count +=
        saturated (coded, {j, 1}, chunk.first, chunk.count, chunk.peak (j));
  }
  return count;
}

template <typename Pixel>
void
FastPath<Pixel>::decode_row (
    const Chunk &chunk, int j, const RowPointers<Pixel> &to) const
{
  const Kernels<Pixel> &kernels = targets_.front ().kernels<Pixel> ();
  const Pixel largest = Pixel (plan_->largest);
  const std::size_t n = std::size_t (chunk.n);
  std::array<ElementRow<Pixel>, Tile::kMaxElements> rows;
  for (std::size_t e = 0; e < n; e++) {
    const int beside =
        std::clamp (j + row_steps_[e], 0, plan_->size.height - 1);
    rows[e] = weights_[e];
    rows[e].here = chunk.row (j, int (e));
    rows[e].there = chunk.row (beside, int (e));
  }
  if (form_ == DecodeForm::kLerpDifference)
    kernels.lerp_difference (
        rows.data (), chunk.n, chunk.count, largest, to.data ());
  else
    kernels.decode (rows.data (), terms_.data (), chunk.n, chunk.count, largest,
        to.data ());
}

/** Counts only if the largest pixel, @p peak, is saturated. */
template <typename Pixel>
std::uint64_t
FastPath<Pixel>::saturated (ImageView<const Pixel> coded, RowRange rows,
    int first, int count, Pixel peak) const
{
  if (peak < plan_->largest)
    return 0;
  const Kernels<Pixel> &kernels = targets_.front ().kernels<Pixel> ();
  const Extent cell = plan_->grid.cell ();
  std::uint64_t found = 0;
  for (int y = 0; y < rows.count * cell.height; y++)
    found += kernels.count (
        coded.row (rows.first * cell.height + y) + first * cell.width,
        count * cell.width, Pixel (plan_->largest));
  return found;
}

template class FastPath<std::uint8_t>;
template class FastPath<std::uint16_t>;

} // namespace codedexposure
