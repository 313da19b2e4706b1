/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The best linear estimate of every pixel in every slot, and its error. */
#pragma once

#include <vector>

#include "advise/exposure_model.h"
#include "advise/scene_statistics.h"
#include "schedule/tile.h"

namespace cexp
{

/** A coded pixel at (x, y) from the estimated one, and its weight. */
struct EstimateTap {
  Offset at;
  double weight;
};

/**
 * Simple kriging: each pixel of the full-size picture in each slot, estimated
 * from the coded pixels of one frame around it such that the expected squared
 * error is least, for a scene of which no more is known than its statistics.
 *
 * The truth is the scene at any time for which the slot's subframe stands, so
 * that the error holds what the slot blurs, what lies between the samples, what
 * moves until the next subframe, and the noise.
 */
class LinearEstimate
{
public:
  /** Filters for more elements would take minutes to find. */
  static constexpr int kMaxElements = 64;

  /** @p model  of kMaxElements or fewer. Of a tile that is written out, each
   * element stands for all of its pixels. */
  LinearEstimate (const ExposureModel &model, const SceneStatistics &scene);

  /** Mean squared error over pixels and slots, white being 1. */
  double error () const { return error_; }
  /** In dB. */
  double psnr () const;
  /** The places of tap () around a pixel of element @p element, and what its
   * weights are for @p slot. They apply to differences of coded pixels from
   * their means, white in one slot being 1. */
  std::vector<EstimateTap> taps (int element, int slot) const;

private:
  int slots_;
  std::vector<Offset> places_;
  /** Of element e and slot s, place by place, from (e slots_ + s) times their
   * number on. */
  std::vector<double> weights_;
  double error_ = 0.0;
};

} // namespace cexp
