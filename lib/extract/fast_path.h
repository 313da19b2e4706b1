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
#include "extract/reference.h"
#include "extract/targets.h"
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
  /** @p lanes  of the widest kernels that will read it. */
  LayoutTable (const SampleGrid &grid, int lanes);

  /** For a block that starts with cell (@p column, @p row); valid as long as
   * the table. */
  Layout<Pixel> from (int column, int row) const
  {
    return {places_.data (), n_, repeat_.width, repeat_.height,
        column % repeat_.width, row % repeat_.height, comb_.data (), identity_,
        elements_.data ()};
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
   *  @p targets  the kernels that may be used, widest first; those that are
   *              too wide for the rows are left out. Nothing when all are. */
  static std::optional<FastPath> make (
      const ExtractPlan &plan, std::span<const Target> targets);

  ExtractReport run (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes, RowRange rows) const;

private:
  /** What the code's terms come down to. */
  enum class DecodeForm {
    kDifference,     ///< whole multiples of element k less element k - 1
    kLerpDifference, ///< quarters of the same, interpolated
    kTerms,          ///< anything
  };
  struct Chunk;

  FastPath (const ExtractPlan &plan, std::span<const Target> targets);
  void take_terms (const Decoder &decoder);
  void take_weights ();

  std::uint64_t run_bands (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes, RowRange rows) const;
  Pixel run_band (ImageView<const Pixel> coded, RowRange rows,
      const Planes<Pixel> &to) const;
  Pixel run_block (const Kernels<Pixel> &kernels, const Block<Pixel> &block,
      const Layout<Pixel> &layout, const Planes<Pixel> &to) const;
  std::uint64_t decode (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes, RowRange rows) const;
  std::uint64_t decode_chunk (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes, RowRange rows,
      Chunk &chunk) const;
  void decode_row (
      const Chunk &chunk, int j, const RowPointers<Pixel> &to) const;
  std::uint64_t saturated (ImageView<const Pixel> coded, RowRange rows,
      int first, int count, Pixel peak) const;

  const ExtractPlan *plan_;
  std::span<const Target> targets_;
  LayoutTable<Pixel> layout_;
  DecodeForm form_ = DecodeForm::kTerms;
  std::vector<int> term_elements_;
  std::vector<double> term_factors_;
  std::vector<TermList> terms_;
  /** Weights of each element; its rows are filled in for every row of cells. */
  std::vector<ElementRow<Pixel>> weights_;
  /** Row of cells, -1, 0 or 1 from its own, with which an element is joined. */
  std::vector<int> row_steps_;
};

} // namespace codedexposure
