/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pixels with the same neighbourhood, and the weights of their taps. */
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "estimate/observation.h"
#include "estimate/scene_model.h"
#include "fuse/bands.h"
#include "fuse/kernels.h"
#include "schedule/schedule.h"

namespace codedexposure::fuse
{

/** Stands for the partner of a coded frame, in the beam of the mirrors that are
 * off, where others have the numbers of coded frames. */
constexpr int kPartner = 2;

/** A pixel relative to another one, of coded frame -1, the one before, 0, the
 * same one, or 1, the one after it, or of the partner of the same one. */
struct Tap {
  int x, y;
  int frame = 0;

  bool operator== (const Tap &) const = default;
};

/** The neighbouring coded frames that there are, and whether there is a
 * partner.
 */
struct Neighbours {
  bool before = false, after = false;
  bool partner = false;

  /** Of the coded frames. */
  bool any () const { return before || after; }
  /** Without them. */
  Neighbours none () const { return {.partner = partner}; }
};

/** Something for each set of neighbours, made when it is first asked for. */
template <typename T>
class ForNeighbours
{
public:
  template <typename Make>
  const T &get (Neighbours neighbours, const Make &make)
  {
    auto &made =
        made_[(neighbours.before ? 1u : 0u) + (neighbours.after ? 2u : 0u) +
              (neighbours.partner ? 4u : 0u)];
    if (!made)
      made = make ();
    return *made;
  }

private:
  std::array<std::optional<T>, 8> made_;
};

/** The pixels of a coded frame within @p radius px. */
std::vector<Tap> taps_within (double radius, int frame = 0);
/** The pixels within @p own px, those of @p neighbours within @p reach px, and
 * of a partner those within kPartnerRadius. */
std::vector<Tap> taps_around (double own, double reach, Neighbours neighbours);
/** Of the taps in the coded frames before and after, for what stays near its
 * place, px. Larger ones are not more accurate. */
constexpr double kNeighbourRadius = 2.3;
/** Of the taps in the partner, px: a shallow code has the light of most slots
 * in every pixel. Larger ones are not more accurate. */
constexpr double kPartnerRadius = 1.5;

/**
 * Which elements lie around a pixel. Pixels with the same neighbourhood are of
 * one phase, so that filters are made once for each.
 *
 * Rows of pixels repeat as shifts of a few distinct ones: pixel x of distinct
 * row r has phase r period () + x mod period ().
 */
class Phases
{
public:
  explicit Phases (const Schedule &schedule);

  int period () const { return period_; }                 ///< along a row, px
  int rows () const { return int (row_starts_.size ()); } ///< distinct ones
  /** Of the pixels of row @p y of the frame, two periods of them. */
  const int *of_row (int y) const
  {
    const int row = floor_mod (y, schedule_.tile ().period_y ());
    return of_rows_.data () + std::ptrdiff_t (row) * 2 * period_;
  }
  /** Elements of the pixels at @p taps from pixel @p x of distinct row @p row.
   */
  std::vector<int> elements (int row, int x, std::span<const Tap> taps) const;

private:
  bool is_shift (int y, int from, int shift) const;

  Schedule schedule_;
  int period_;
  std::vector<int> of_rows_;    ///< one period of the tile
  std::vector<int> row_starts_; ///< y of the first of each distinct row
};

class TapSources;

/** What the filters of a schedule are made from. */
struct FilterPlan {
  const Kernels &kernels;
  const Phases &phases;
  const Observation &observation;
  const TapSources &sources;
  std::vector<double> noise; ///< variance of each element, in the scene's
  /** What partners tell of the slots, if there are any; else null. */
  const Observation *partner;
  std::vector<double> partner_noise;
  int radius;           ///< of taps, px
  float steps;          ///< of a pixel per grey level
  bool lookahead;       ///< the next coded frame is usually known
  std::stop_token stop; ///< of the call that makes filters

  /** The neighbours that usually there are, beside @p before. */
  Neighbours usual (bool before) const
  {
    return {before, lookahead, partner != nullptr};
  }

  void throw_if_stopped () const
  {
    if (stop.stop_requested ())
      throw Stopped ();
  }
};

/** Weights of the taps around the pixels of one phase under one class. */
struct PhaseWeights {
  /** Weight of tap i for slot s at [s * taps + i]. */
  std::vector<float> slots;
  /** Prediction of the middle pixel from all others, less that pixel, and of
   * that of the partner; empty if there is none. */
  std::vector<float> residual, partner_residual;
  /** Expected squared errors, in units of the scene's variance: of these
   * predictions, and of each slot. */
  double predicted_variance = 0.0, partner_variance = 0.0;
  std::vector<double> slot_variances;
};

/** No limit. */
constexpr std::size_t kAllTaps = std::numeric_limits<std::size_t>::max ();

/** Calls @p use with the weights of every phase, the pixels at @p x of distinct
 * row @p row, under class @p patch.
 * @p taps           coded pixels, {0, 0, 0} among them.
 * @p per_neighbour  so many at most of those in each neighbouring coded frame:
 *                   those that tell most of the slot that is next to it. */
using UseWeights = std::function<void (
    int row, int x, std::span<const Tap> taps, const PhaseWeights &weights)>;
void for_each_phase (const FilterPlan &plan, const SceneClass &patch,
    std::span<const Tap> taps, const UseWeights &use,
    std::size_t per_neighbour = kAllTaps);

/** What each pixel of a phase is to be estimated from the pixels around it. */
enum class Sought {
  kSlots,    ///< its light in every slot
  kResidual, ///< the coded pixel from all others, less that pixel
};

/** As for_each_phase (), with few taps; see SparseKriging. All other weights
 * are 0. Weight of tap i for output k is at [k * taps + i]. Filters of more
 * than kMaxSparseSlots would take too long to be made sparse, and have all
 * taps.
 * @p excess  squared error that is accepted beyond that with all taps, as a
 *            part of it. */
using UseSparse =
    std::function<void (int row, int x, const std::vector<float> &weights)>;
constexpr int kMaxSparseSlots = 16;
void for_each_sparse_phase (const FilterPlan &plan, const SceneClass &patch,
    std::span<const Tap> taps, Sought sought, double excess,
    const UseSparse &use);

} // namespace codedexposure::fuse
