/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Extraction by the kernels of an instruction set. */
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "base/image.h"
#include "extract/decoder.h"
#include "extract/extractor.h"
#include "extract/kernels.h"
#include "extract/linear.h"
#include "schedule/sample_grid.h"

namespace codedexposure
{

/** A row of pixels for each element or rank. */
template <typename Pixel>
using RowPointers = std::array<Pixel *, Tile::kMaxElements>;

/** The sample grid in the form that kernels read. */
template <typename Pixel>
class LayoutTable
{
public:
  LayoutTable (const SampleGrid &grid, int lanes)
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

  /** For a block that starts with row @p row of cells; valid as long as the
   * table. */
  Layout<Pixel> from (int row) const
  {
    return {places_.data (), n_, repeat_.width, repeat_.height, 0,
        row % repeat_.height, comb_.data (), identity_, elements_.data ()};
  }

private:
  int n_;
  Extent repeat_;
  bool identity_ = true;
  std::vector<std::uint8_t> places_;
  std::vector<std::uint8_t> elements_; ///< Layout::element
  std::vector<Pixel> comb_;
};

/** What is to be done, by kernels or by the reference. */
struct ExtractPlan {
  Method method;
  SampleGrid grid;
  Extent size;                         ///< of a subframe
  int largest;                         ///< pixel value
  std::vector<int> elements;           ///< select: element of each subframe
  std::optional<Decoder> decoder = {}; ///< decode
  std::optional<LinearPlan> linear = {};
};

/* Coded frames from this size on do not fit the caches together with their
 * subframes and the next frame, so nothing is gained by writing into them. */
constexpr std::size_t kLargeFrame = std::size_t (8) << 20;
/* As much of a frame is worked on before saturated pixels are looked for: few
 * enough to be still in the caches, enough to make calls cheap. */
constexpr std::size_t kBand = std::size_t (128) << 10;
constexpr std::size_t kLine = 64;

/** Whether all rows begin with a line of the cache. */
template <typename Pixel>
bool
begin_with_lines (std::span<const ImageView<Pixel>> views)
{
  return std::ranges::all_of (views, [] (const ImageView<Pixel> &view) {
    return reinterpret_cast<std::uintptr_t> (view.data) % kLine == 0 &&
           std::size_t (view.stride) % kLine == 0;
  });
}

/** Makes non-temporal stores visible to other threads. */
inline void
finish_stores ()
{
#ifdef __SSE2__
  _mm_sfence ();
#endif
}

/**
 * The plan carried out by kernels: equal to the reference bit for bit. Nothing
 * in it changes, so that threads can share it.
 */
template <typename Pixel>
class FastPath
{
public:
  /** @p plan     outlives this.
   *  @p targets  the kernels that may be used, widest first; the first one
   *              whose vectors are no wider than a row is. Nothing when all
   *              are. */
  static std::optional<FastPath<Pixel>> make (
      const ExtractPlan &plan, std::span<const Target> targets)
  {
    for (const Target &target : targets)
      if (const auto &kernels = target.kernels<Pixel> ();
          kernels.lanes <= plan.size.width)
        return FastPath (plan, kernels);
    return {};
  }

  ExtractReport run (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const
  {
    const bool interpolates = plan_->decoder && plan_->decoder->interpolates ();
    return {interpolates ? interpolate (coded, subframes)
                         : run_bands (coded, subframes)};
  }

private:
  /** Elements of some columns of cells, for three rows of cells, with a cell
   * more at either end. */
  class Ring
  {
  public:
    Ring (int n, int first, int count, int width)
        : n_ (n), first_ (first), count_ (count), width_ (width)
    {
    }

    static int most_cells (int n) { return kPixels / 3 / n - 2; }

    int first () const { return first_; }
    int count () const { return count_; }
    const Pixel *row (int j, int element) const
    {
      return pixels_ + at (j, element);
    }

    /** Returns the largest pixel. */
    Pixel fill (const Kernels<Pixel> &kernels, const Layout<Pixel> &layout,
        Extent cell, ImageView<const Pixel> coded, int j)
    {
      const int begin = std::max (first_ - 1, 0);
      const int end = std::min (first_ + count_ + 1, width_);
      RowPointers<Pixel> rows;
      for (int e = 0; e < n_; e++)
        rows[std::size_t (e)] = pixels_ + at (j, e) + begin - first_;
      const Pixel peak = kernels.select (
          {coded.row (j * cell.height) + begin * cell.width, coded.stride,
              cell.width, cell.height, end - begin, 1},
          layout, {rows.data (), 0});
      for (int e = 0; e < n_; e++) {
        Pixel *const row = pixels_ + at (j, e);
        if (begin == first_)
          row[-1] = row[0];
        if (end == first_ + count_)
          row[count_] = row[count_ - 1];
      }
      return peak;
    }

  private:
    /* 66 cells of 256 elements. */
    static constexpr int kPixels = 3 * 66 * Tile::kMaxElements;

    int at (int j, int element) const
    {
      return (j % 3 * n_ + element) * (count_ + 2) + 1;
    }

    alignas (64) Pixel pixels_[kPixels];
    int n_;
    int first_;
    int count_;
    int width_;
  };

  FastPath (const ExtractPlan &plan, const Kernels<Pixel> &kernels)
      : plan_ (&plan), kernels_ (&kernels), layout_ (plan.grid, kernels.lanes)
  {
    if (!plan.decoder)
      return;
    for (int e = 0; e < plan_->grid.elements (); e++) {
      const Offset offset = plan_->grid.offset (e, 0, 0);
      const Lerp x = plan_->decoder->lerp_x (offset);
      const Lerp y = plan_->decoder->lerp_y (offset);
      weights_.push_back (
          {nullptr, nullptr, short (y.near * x.near), short (y.near * x.far),
              short (y.far * x.near), short (y.far * x.far), x.step});
      row_steps_.push_back (y.step);
    }
  }

  std::uint64_t run_bands (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const
  {
    const Extent cell = plan_->grid.cell (), size = plan_->size;
    const std::size_t n = subframes.size ();
    const std::size_t row_bytes = n * std::size_t (size.width) * sizeof (Pixel);
    const std::ptrdiff_t stride = subframes[0].stride;
    const bool one_stride = std::ranges::all_of (
        subframes, [stride] (const auto &s) { return s.stride == stride; });
    const int band = one_stride ? std::max (1, int (kBand / row_bytes)) : 1;
    const bool stream = row_bytes * std::size_t (size.height) >= kLargeFrame &&
                        begin_with_lines (subframes);

    std::uint64_t count = 0;
    for (int j = 0; j < size.height; j += band) {
      RowPointers<Pixel> to;
      for (std::size_t k = 0; k < n; k++)
        to[plan_->method == Method::kSelect ? std::size_t (plan_->elements[k])
                                            : k] = subframes[k].row (j);
      const int rows = std::min (band, size.height - j);
      const Pixel peak =
          run_block ({coded.row (j * cell.height), coded.stride, cell.width,
                         cell.height, size.width, rows},
              layout_.from (j), {to.data (), stride, stream});
      count += saturated (coded, j, rows, peak);
    }
    if (stream)
      finish_stores ();
    return count;
  }

  Pixel run_block (const Block<Pixel> &block, const Layout<Pixel> &layout,
      const Planes<Pixel> &to) const
  {
    switch (plan_->method) {
    case Method::kRank:
      return kernels_->rank (block, layout, to);
    case Method::kDecode:
      return kernels_->decode (block, layout, plan_->linear->linear (), to);
    default:
      return kernels_->select (block, layout, to);
    }
  }

  std::uint64_t interpolate (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const
  {
    const Extent cell = plan_->grid.cell (), size = plan_->size;
    const int n = plan_->grid.elements ();
    const int most = std::min (size.width, Ring::most_cells (n));
    Pixel peak = 0;
    for (int next = 0; next < size.width; next += most) {
      Ring ring (n, std::min (next, size.width - most), most, size.width);
      const auto fill = [&] (int j) {
        peak = std::max (
            peak, ring.fill (*kernels_, layout_.from (j), cell, coded, j));
      };
      fill (0);
      for (int j = 0; j < size.height; j++) {
        if (j + 1 < size.height)
          fill (j + 1);
        interpolate_row (ring, j, subframes);
      }
    }
    return saturated (coded, 0, size.height, peak);
  }

  void interpolate_row (const Ring &ring, int j,
      std::span<const ImageView<Pixel>> subframes) const
  {
    std::array<ElementRow<Pixel>, Tile::kMaxElements> rows;
    RowPointers<Pixel> to;
    for (std::size_t e = 0; e < subframes.size (); e++) {
      const int beside =
          std::clamp (j + row_steps_[e], 0, plan_->size.height - 1);
      rows[e] = weights_[e];
      rows[e].here = ring.row (j, int (e));
      rows[e].there = ring.row (beside, int (e));
      to[e] = subframes[e].row (j) + ring.first ();
    }
    kernels_->decode_row (
        rows.data (), plan_->linear->linear (), ring.count (), to.data ());
  }

  /** Counts only if the largest pixel, @p peak, is saturated. */
  std::uint64_t saturated (
      ImageView<const Pixel> coded, int first_row, int rows, Pixel peak) const
  {
    if (peak < plan_->largest)
      return 0;
    const Extent cell = plan_->grid.cell ();
    std::uint64_t found = 0;
    for (int y = 0; y < rows * cell.height; y++)
      found += kernels_->count (coded.row (first_row * cell.height + y),
          plan_->size.width * cell.width, Pixel (plan_->largest));
    return found;
  }

  const ExtractPlan *plan_;
  const Kernels<Pixel> *kernels_;
  LayoutTable<Pixel> layout_;
  /** Weights of each element; its rows are filled in for every row of cells. */
  std::vector<ElementRow<Pixel>> weights_;
  /** Row of cells, -1, 0 or 1 from its own, with which an element is joined. */
  std::vector<int> row_steps_;
};

} // namespace codedexposure
