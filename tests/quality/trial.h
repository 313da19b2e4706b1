/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One method to record and split coded frames, and its accuracy. */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "extract/extractor.h"
#include "metrics.h"
#include "scene.h"
#include "schedule/schedule.h"

namespace codedexposure::quality
{

/** The schedule of a preset that is known to be good. */
Schedule schedule_of (std::string_view preset);

/** Scaling of the subframes. */
enum class Reading {
  kAsShown,    ///< nothing
  kNormalised, ///< subframe k times n / (k + 1): all equally bright
  kDifference, ///< n times what subframe k has more than subframe k - 1
};

/** A method from light to subframes. */
struct Way {
  std::string label = {}; ///< of its row in a table
  Schedule schedule = {}; ///< of the bench
  ExtractOptions extract = {};
  Reading reading = Reading::kAsShown;
  /** The schedule of extraction, if it differs from that of the bench. */
  std::optional<Schedule> believed = {};
};

/** How a camera sees the mirrors. */
struct View {
  bool mirrored = false;
  double shift_x = 0.0, shift_y = 0.0; ///< mirrors
  double rotation = 0.0;               ///< degrees
  double scale = 1.0;                  ///< pixels a mirror
  double stretch = 1.0;  ///< mirrors a pixel along x, by those along y
  double keystone = 0.0; ///< relative change of the scale to the right border
};

/** A condition under which coded frames are taken. */
struct Condition {
  /** Electrons that white makes in an exposure without masks; an element that
   * is open in one slot of n gets an nth of them. 0: noise-free. */
  double electrons = 0.0;
  double read_noise = 0.0;
  /** Analog gain; 0: white in the element that is open longest is white. */
  double gain = 0.0;
  double shift = 0.0; ///< of mirrors against pixels, px, in x and in y
  double blur = 0.0;  ///< standard deviation, px
  std::optional<View> view = {}; ///< in place of the shift
  /** A mapping of the camera, which has its blur and view, corrects them. */
  bool mapped = false;
  bool second = false; ///< camera: what it does not know is seen to be so
  double black_level = 0.0;
  std::uint64_t seed = 0; ///< of the noise

  /** The same camera in another place, with noise of its own. */
  Condition of_partner () const
  {
    Condition other = *this;
    other.seed++;
    other.second = true;
    return other;
  }
};

/** Scores of a method for a scene. */
struct Score {
  /** Against the scene's pixel at the place of the subframe's element, in the
   * slot of the subframe. */
  PooledError point;
  /** Against the mean of the cell in that slot. */
  PooledError cell;
  /** Against every pixel of the scene in that slot, the gaps between samples
   * filled linearly (upsample.h), without the border. */
  PooledError full;
  std::uint64_t pixels = 0; ///< of all subframes
  /** Pixels whose rank in their cell is not their slot; ties count as right. */
  std::uint64_t mislabelled = 0;
  std::uint64_t cells = 0;
  std::uint64_t mislabelled_cells = 0;

  Score &operator+= (const Score &other);
};

/** The coded frames of a scene, n slots each; slots left over at the end make
 * none. Noise depends on the number of the frame only.
 * @p errors  get those of each frame, if they are not null and there is a
 *            mapping. */
std::vector<Picture> take (const Scene &scene, const Schedule &schedule,
    const Condition &condition, std::vector<Image<float>> *errors = nullptr);

/** A coded frame of a camera that has a mapping. */
struct Corrected {
  Picture frame;
  Image<float> errors; ///< see Rectifier::run ()
};
Corrected corrected (
    const Picture &coded, const Schedule &schedule, const Condition &condition);

/** Corrects the frames of a second camera that has a mapping, which take () has
 * made under @p condition, by what the first one tells.
 * @p schedule  of the first camera, whose @p coded frames they are partners of.
 * @p errors    of take (), or null. */
void correct_partners (std::vector<Picture> &partners,
    const std::vector<Picture> &coded, const Schedule &schedule,
    const Condition &condition, std::vector<Image<float>> *errors = nullptr);

/** The subframes of one coded frame, as they are, before any Reading. */
std::vector<Picture> split (const Picture &coded, const Way &way);

/** Scores of each coded frame of the scene. */
std::vector<Score> score_frames (
    const Scene &scene, const Way &way, const Condition &condition);

/** Their sum: one mean over all slots and frames of the scene. */
Score score_scene (
    const Scene &scene, const Way &way, const Condition &condition);

} // namespace codedexposure::quality
