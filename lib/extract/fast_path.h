/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Extraction by the kernels of an instruction set. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

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
  LayoutTable (const SampleGrid &grid, int lanes);

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
  static std::optional<FastPath> make (
      const ExtractPlan &plan, std::span<const Target> targets);

  ExtractReport run (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const;

private:
  class Ring;

  FastPath (const ExtractPlan &plan, const Kernels<Pixel> &kernels);

  std::uint64_t run_bands (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const;
  Pixel run_block (const Block<Pixel> &block, const Layout<Pixel> &layout,
      const Planes<Pixel> &to) const;
  std::uint64_t interpolate (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const;
  void interpolate_row (const Ring &ring, int j,
      std::span<const ImageView<Pixel>> subframes) const;
  std::uint64_t saturated (
      ImageView<const Pixel> coded, int first_row, int rows, Pixel peak) const;

  const ExtractPlan *plan_;
  const Kernels<Pixel> *kernels_;
  LayoutTable<Pixel> layout_;
  /** Weights of each element; its rows are filled in for every row of cells. */
  std::vector<ElementRow<Pixel>> weights_;
  /** Row of cells, -1, 0 or 1 from its own, with which an element is joined. */
  std::vector<int> row_steps_;
};

} // namespace codedexposure
