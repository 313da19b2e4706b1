/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The last step with a partner: what the slots sum to is what it saw. */
#pragma once

#include <vector>

#include "base/workers.h"
#include "fuse/coded_stream.h"
#include "fuse/static_pixels.h"

namespace codedexposure::fuse
{

/**
 * The light y of a partner's pixel is the mean of the light x_s of the slots,
 * weighted with its responses m_s. Estimates of a wrong model miss it, and move
 * to it by the shortest way:
 *
 *   x_s += a (r - R) m_s / (sum of all m^2),  r = y - sum of all m_s x_s,
 *
 * where R is the mean of r around the pixel in its row, so that neither gain
 * nor black level of the partner need be known, and a what is not noise in
 * r - R there: 1 without noise.
 */
class PartnerFit
{
public:
  /** @p partner  what partners tell of the slots, behind the mirrors of
   *              @p schedule. */
  PartnerFit (const Kernels &kernels, const Schedule &schedule,
      const Observation &partner, Extent size);

  /** Of a thread. */
  class Room
  {
  public:
    explicit Room (const PartnerFit &fit);

  private:
    friend PartnerFit;
    Field rows_; ///< of one row at a time
    std::vector<const float *> responses_;
  };

  /** Row @p y.
   * @p partner  the light that it saw.
   * @p light    of each slot. */
  void run (int y, const float *partner, float *const *light, Room &room) const;
  /** What @p light makes in row @p y of the partner. */
  void make (int y, const float *const *light, float *to) const;

  /** What a change by 1 of the partner's light changes that of @p slot by, for
   * each pixel of row @p y. */
  void follow (int y, int slot, float *to) const;

private:
  const Kernels &kernels_;
  NoiseMap noise_;
  std::vector<Field> responses_; ///< m_s, of a period of rows
  Field steps_;                  ///< 1 / (sum of all m^2), likewise
};

} // namespace codedexposure::fuse
