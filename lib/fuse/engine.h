/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Fusion of light, before and after it is pixels. */
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "fuse/field.h"
#include "fuse/filter_bank.h"
#include "fuse/fuser.h"
#include "fuse/likeness.h"
#include "fuse/motion.h"
#include "fuse/predictions.h"
#include "fuse/stillness.h"

namespace cexp::fuse
{

/** Row @p y of every slot, of the frame's width, 255 for white. */
using RowSink = std::function<void (int y, const float *const *slots)>;

/** Light in the coded frame to light in every slot; see Fuser. */
class Engine
{
public:
  static Result<std::unique_ptr<Engine>> make (const Schedule &schedule,
      int width, int height, const FuseOptions &options, double steps);

  int slots () const { return observation_.slots (); }
  int width () const { return width_; }
  int height () const { return height_; }

  /** A field to write the next coded frame to, times gain () row by row. */
  Field &next ();
  /** What pixels of row @p y are to be multiplied by, beside 255 / white; null
   * where that is 1. */
  const float *gain (int y) const;
  /** next () has been written. */
  void take ();

  int pending () const { return int (queue_.size ()); }
  /** False when it was stopped; the frame is gone then. */
  bool fuse (const RowSink &sink, Workers &workers, std::stop_token stop);
  void forget ();

private:
  Engine (const Schedule &schedule, int width, int height,
      const FuseOptions &options, double steps);
  void map_noise (const Schedule &schedule);
  void find_margin (const Schedule &schedule);
  void prepare (const Schedule &schedule, const FuseOptions &options);
  void prepare_plain (const SceneClass &model, std::span<const double> noise);
  void find_stillness (const Field &coded);
  void choose (int y, const float *creeping, const float *moving);
  void share_out (int y, Field &shares) const;
  void blend (int y, float *const *rows) const;
  void fuse_plainly (const Field &coded, const RowSink &sink);
  bool fuse_motion (const Field &coded, const RowSink &sink, Workers &workers,
      std::stop_token stop);
  /** Standard deviation of coded pixels in grey levels. */
  double typical_noise () const;

  int width_, height_;
  Observation observation_;
  Phases phases_;
  const Kernels &kernels_;
  int radius_;
  std::optional<Predictions> predictions_;
  std::vector<FilterBank> plain_; ///< fast: of its one or two models
  Field creeping_; ///< weight of the first of two, the second has the rest
  std::optional<Motion> motion_;
  std::optional<Likeness> likeness_;
  std::vector<Field> light_; ///< of each slot, unless fast
  NoiseMap noise_;
  Field gain_; ///< empty where it is 1 everywhere
  Stillness stillness_;

  /* Pixels of the margin and the pixels of the same element that they repeat.
   */
  struct Repeat {
    std::ptrdiff_t to, from;
  };
  std::vector<Repeat> margin_;

  std::deque<Field> queue_;
  Field spare_;
};

} // namespace cexp::fuse
