/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Extraction pixel by pixel: slow and readable. The kernels must equal it bit
 * for bit. */
#pragma once

#include <cstdint>
#include <span>

#include "base/image.h"
#include "extract/decoder.h"
#include "extract/linear.h"
#include "schedule/sample_grid.h"

namespace codedexposure
{

class CoveredCells;

/* In all of these: @p coded is the coded frame, @p subframes are the n
 * subframes in exposure order. Pixel is std::uint8_t or std::uint16_t. */

/** Subframe k = k-th smallest of the group, by the paper's group_sort (). */
template <typename Pixel>
void reference_rank (ImageView<const Pixel> coded, const SampleGrid &grid,
    std::span<const ImageView<Pixel>> subframes);

/** Subframe k = element @p elements[k]. */
template <typename Pixel>
void reference_select (ImageView<const Pixel> coded, const SampleGrid &grid,
    std::span<const int> elements, std::span<const ImageView<Pixel>> subframes);

/** Pixel @p cell of subframe k = light of slot k by @p linear, without looking
 * at @p covered cells: a missing sample is the one beside it, as at the edge of
 * the frame, and where that one is known on both sides, in the plane through
 * all three. */
template <typename Pixel>
void reference_decode (ImageView<const Pixel> coded, const SampleGrid &grid,
    const Decoder &decoder, const Linear &linear, const CoveredCells &covered,
    Offset cell, std::span<const ImageView<Pixel>> subframes);

/** Pixels of the @p rows of cells that are not below @p largest. */
template <typename Pixel>
std::uint64_t reference_saturated (ImageView<const Pixel> coded,
    const SampleGrid &grid, int largest, int rows);

} // namespace codedexposure
