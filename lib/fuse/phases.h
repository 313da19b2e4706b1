/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pixels with the same neighbourhood, and the weights of their taps. */
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "estimate/observation.h"
#include "estimate/scene_model.h"
#include "schedule/schedule.h"

namespace codedexposure::fuse
{

/** A pixel relative to another one, of coded frame -1, the one before, 0, the
 * same one, or 1, the one after it. */
struct Tap {
  int x, y;
  int frame = 0;

  bool operator== (const Tap &) const = default;
};

/** The pixels of a coded frame within @p radius px. */
std::vector<Tap> taps_within (double radius, int frame = 0);
/** The pixels within @p own px, and of the coded frames before and after, if
 * they are used, those within @p neighbours px. */
std::vector<Tap> taps_around (
    double own, double neighbours, bool previous, bool next);
/** Of the taps in the coded frames before and after, px. Larger ones are not
 * more accurate. */
constexpr double kNeighbourRadius = 2.3;

/**
 * Which elements lie around a pixel. Pixels with the same neighbourhood are of
 * one phase, so that filters are made once for each.
 *
 * Rows of pixels repeat as shifts of a few: pixel (x, y) has phase
 * first (y) + (x + shift (y)) mod period ().
 */
class Phases
{
public:
  explicit Phases (const Schedule &schedule);

  int period () const { return period_; }                 ///< along a row, px
  int rows () const { return int (row_starts_.size ()); } ///< distinct ones
  /** The distinct row that row @p y of the frame is a shift of. */
  int row_of (int y) const { return at (y).row; }
  int shift (int y) const { return at (y).shift; }
  /** Elements of the pixels at @p taps from pixel @p x of distinct row @p row.
   */
  std::vector<int> elements (int row, int x, std::span<const Tap> taps) const;

private:
  struct Row {
    int row;
    int shift;
  };
  const Row &at (int y) const
  {
    return rows_[std::size_t (floor_mod (y, int (rows_.size ())))];
  }
  bool is_shift (int y, int from, int shift) const;

  Schedule schedule_;
  int period_;
  std::vector<Row> rows_;       ///< one period of the tile
  std::vector<int> row_starts_; ///< y of the first of each distinct row
};

/** Weights of the taps around the pixels of one phase under one class. */
struct PhaseWeights {
  /** Weight of tap i for slot s at [s * taps + i]. */
  std::vector<float> slots;
  /** Prediction of the middle pixel from all others, less that pixel. */
  std::vector<float> residual;
  /** Expected squared errors, in units of the scene's variance: of that
   * prediction, and of the mean slot. */
  double predicted_variance = 0.0, slot_variance = 0.0;
};

/** Calls @p use with the weights of every phase, the pixels at @p x of distinct
 * row @p row, under class @p patch.
 * @p taps   coded pixels, {0, 0, 0} among them.
 * @p noise  variance of each element in units of the scene's variance. */
using UseWeights =
    std::function<void (int row, int x, const PhaseWeights &weights)>;
void for_each_phase (const Phases &phases, const Observation &observation,
    const SceneClass &patch, std::span<const Tap> taps,
    std::span<const double> noise, const UseWeights &use);

/** What each pixel of a phase is to be estimated from the pixels around it. */
enum class Sought {
  kSlots,    ///< its light in every slot
  kResidual, ///< the coded pixel from all others, less that pixel
};

/** As for_each_phase (), with few taps; see SparseKriging. All other weights
 * are 0. Weight of tap i for output k is at [k * taps + i].
 * @p excess  squared error that is accepted beyond that with all taps, as a
 *            part of it. */
using UseSparse =
    std::function<void (int row, int x, const std::vector<float> &weights)>;
void for_each_sparse_phase (const Phases &phases,
    const Observation &observation, const SceneClass &patch,
    std::span<const Tap> taps, std::span<const double> noise, Sought sought,
    double excess, const UseSparse &use);

} // namespace codedexposure::fuse
