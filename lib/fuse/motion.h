/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Motion-adaptive kriging. */
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "fuse/bands.h"
#include "fuse/filter_bank.h"
#include "fuse/models.h"

namespace codedexposure::fuse
{

/**
 * Under each class of patches, every coded pixel is predicted from those around
 * it, which saw other slots. The prediction of the right class is good in spite
 * of aliasing: its squared error, averaged around a block of 2x2 pixels,
 * measures how well the class fits there. The frames are the sum of the filters
 * of all classes, with weights by how well they fit.
 *
 * Some classes exist a second time, with pixels of the coded frames before and
 * after the one that is fused, and compete with the others: those of what stays
 * near its place, with pixels there, and the followers, with pixels along their
 * motion.
 */
class MotionFilter
{
public:
  /** @p plan  outlives this. */
  explicit MotionFilter (const FilterPlan &plan);

  /** Writes the light of every slot to @p slots, fields of the size of
   * @p frames. The result does not depend on the number of workers.
   * @p misfit  gets the mean squared error around each block of 2x2 pixels of
   *            the class that fits best there, in grey levels squared. */
  void run (const CodedFrames &frames, std::span<Field> slots, Field &misfit,
      const Task &task);

private:
  /** Classes with the same taps. */
  struct Set {
    std::vector<float> factors; ///< of the squared error of each class
    FilterBank residuals;       ///< a group has kChunk classes
    std::optional<FilterBank> of_partner; ///< residuals of its pixels, likewise
    FilterBank filters; ///< a group is a class, its outputs are slots
    /** Of followers: the number of each among the classes of the frame. */
    std::vector<std::size_t> followed;
  };
  class Chunk;
  /** @p per_neighbour  see for_each_phase (). */
  Set make_set (std::span<const SceneClass> classes, std::span<const Tap> taps,
      std::size_t per_neighbour = kAllTaps) const;
  Set make_followers (Neighbours neighbours) const;
  const Set &of_frame (Neighbours neighbours);
  std::vector<const Set *> sets_for (Neighbours neighbours);

  struct Room;
  void measure_row (const CodedFrames &frames, const Set &set, int group, int y,
      float *const *to, Room &room) const;
  void measure_blocks (
      const CodedFrames &frames, const Set &set, int group, Room &room) const;
  void measure (const CodedFrames &frames, const Set &set, std::size_t first,
      Room &room) const;
  void set_weights (Room &room, Field &misfit) const;
  void mix (const CodedFrames &frames, std::span<const Set *const> sets, int y,
      std::span<Field> slots, Room &room) const;

  const FilterPlan &plan_;
  MotionModels models_;
  ForNeighbours<Set> of_frame_, over_frames_, followers_;
};

} // namespace codedexposure::fuse
