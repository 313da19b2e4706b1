/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "base/statistics.h"

namespace codedexposure::fuse
{

namespace
{

/* Surroundings over which the error of a class is averaged, in blocks of 2x2
 * pixels: they are so much larger that classes are weighted block by block. */
constexpr double kSigma = 1.6;
constexpr int kReach = 5;
/* Rows of blocks that a thread takes at a time: many, as it computes errors of
 * 2 kReach more. */
constexpr int kBandRows = 48;
/* Classes whose error is measured at a time: the outputs of a filter. */
constexpr std::size_t kChunk = 8;
/* Errors of this size, in grey levels squared, do not tell classes apart. */
constexpr float kErrorFloor = 1.0f;
/* Classes with less weight relative to the best one are left out. */
constexpr float kMinWeight = 0.01f;
/* The pixels of each neighbouring coded frame that a follower uses. */
constexpr std::size_t kFollowedTaps = 12;
/* With these pixels more, some wrong motion fits by chance: the error of a
 * follower counts as this part at least of the error without them. */
constexpr float kLeastPart = 0.8f;

/* Of both axes together 1/4, as sums of blocks become means of pixels. */
std::array<float, 2 * kReach + 1>
gaussian ()
{
  std::array<float, 2 * kReach + 1> weights;
  double sum = 0.0;
  for (int i = -kReach; i <= kReach; i++)
    sum += std::exp (-0.5 * i * i / (kSigma * kSigma));
  for (int i = -kReach; i <= kReach; i++)
    weights[std::size_t (i + kReach)] =
        float (0.5 * std::exp (-0.5 * i * i / (kSigma * kSigma)) / sum);
  return weights;
}

/* The values around @source, @step apart. */
void
blur (const Kernels &kernels, const float *source, std::ptrdiff_t step,
    int count, float *to)
{
  static const auto kWeights = gaussian ();
  kernels.blur (source - kReach * step, step, kWeights.data (),
      int (kWeights.size ()), count, to);
}

/* The blocks of a part of a row, kRunBlock values each, with others than 0. */
void
find_runs (const float *values, int count, std::vector<Run> &runs)
{
  runs.clear ();
  for (int block = 0; block < count / kRunBlock; block++) {
    bool any = false;
    for (int i = 0; i < kRunBlock; i++)
      any |= values[block * kRunBlock + i] != 0.0f;
    if (any)
      add_block (runs, block);
  }
}

} // namespace

/* Of a thread: rows first .. first + rows - 1 of the blocks of a frame. */
struct MotionFilter::Room {
  Room (int width, int period, int slots, std::vector<float> factors_of_classes)
      : factors (std::move (factors_of_classes)), blocks ((width + 1) / 2),
        part (SplitField::split_length (width, period)),
        squares (width, 2 * kChunk, 2 * kReach),
        sums (kChunk, Field (blocks, kBandRows, kReach)),
        along (blocks, kBandRows + 2 * kReach),
        fit_rows (blocks, kBandRows * int (factors.size ())),
        shares (part * (period / 2), 1),
        parts (part * period, std::max (2 * slots, int (kChunk)))
  {
  }

  /* Of class @c: error, then weight. Rows of all classes lie together, as they
   * are compared. */
  float *fit (std::size_t c, int y)
  {
    return fit_rows.row (y * int (factors.size ()) + int (c));
  }

  int first = 0, rows = 0;
  std::vector<float> factors; ///< of each class
  int blocks;                 ///< of a row
  int part;                   ///< length of the parts of a row of pixels
  Field squares;              ///< of a chunk: squared residuals of two rows
  std::vector<Field> sums;    ///< of a chunk: the same of blocks
  Field along;                ///< blurred along x
  Field fit_rows;
  Field shares; ///< weights of a class in a row of blocks, in parts
  Field parts;  ///< rows of outputs in parts
  std::vector<Run> runs;
  std::vector<const std::int32_t *> sources[2];
};

MotionFilter::MotionFilter (const FilterPlan &plan)
    : plan_ (plan), models_ (motion_models ())
{
  of_frame ({});
  of_frame (plan.usual (false));
}

/* Predictions of the pixels of one phase by several classes, which need not
 * have the same taps. */
class MotionFilter::Chunk
{
public:
  void add (std::span<const Tap> taps, std::span<const float> weights)
  {
    for (std::size_t t = 0; t < taps.size (); t++) {
      const Tap &tap = taps[t];
      weights_[{tap.frame, tap.y, tap.x}][classes_] = weights[t];
    }
    classes_++;
  }
  void set (FilterBank &bank, int row, int x, int group, float scale) const
  {
    std::vector<Tap> taps;
    std::vector<float> weights (weights_.size () * classes_);
    for (const auto &[place, of_classes] : weights_) {
      const auto [frame, tap_y, tap_x] = place;
      for (std::size_t c = 0; c < classes_; c++)
        weights[c * weights_.size () + taps.size ()] = scale * of_classes[c];
      taps.push_back ({tap_x, tap_y, frame});
    }
    bank.set (row, x, group, taps, weights);
  }

private:
  std::size_t classes_ = 0;
  /** By frame, y and x of the taps: in this order, neighbours are pairs. */
  std::map<std::array<int, 3>, std::array<float, kChunk>> weights_;
};

/* Under a class whose motion brings several samples to the same places of the
 * patch, pixels are predicted well and the gaps between these places are not.
 * Errors therefore count by how much larger the class expects those of the
 * slots to be. Half of this ratio's logarithm, as gaps are easier to fill than
 * the class says where light changes along one direction only.
 *
 * With a partner, its pixels are predicted as well, and the error is the mean
 * of both, each in units of what the classes expect of it. */
MotionFilter::Set
MotionFilter::make_set (std::span<const SceneClass> classes,
    std::span<const Tap> taps, std::size_t per_neighbour) const
{
  const std::size_t chunks = (classes.size () + kChunk - 1) / kChunk;
  Set set{{}, FilterBank (plan_, int (chunks)), {},
      FilterBank (plan_, int (classes.size ())), {}};
  /* Of each phase and chunk. */
  std::map<std::array<int, 3>, Chunk> residuals, of_partner;
  std::vector<double> sought, predicted, partner;
  for (std::size_t c = 0; c < classes.size (); c++) {
    const int chunk = int (c / kChunk);
    for (std::vector<double> *sum : {&sought, &predicted, &partner})
      sum->push_back (0.0);
    for_each_phase (
        plan_, classes[c], taps,
        [&] (int row, int x, std::span<const Tap> used,
            const PhaseWeights &weights) {
          set.filters.set (row, x, int (c), used, weights.slots);
          residuals[{row, x, chunk}].add (used, weights.residual);
          predicted.back () += weights.predicted_variance;
          partner.back () += weights.partner_variance;
          if (!weights.partner_residual.empty ())
            of_partner[{row, x, chunk}].add (used, weights.partner_residual);
          sought.back () += std::accumulate (weights.slot_variances.begin (),
                                weights.slot_variances.end (), 0.0) /
                            plan_.observation.slots ();
        },
        per_neighbour);
  }
  const double ratio =
      of_partner.empty () ? 0.0 : median (predicted) / median (partner);
  const double part = of_partner.empty () ? 1.0 : 0.5;
  const auto set_bank = [] (FilterBank &bank, const auto &chunks_of,
                            double by) {
    for (const auto &[place, chunk] : chunks_of)
      chunk.set (bank, place[0], place[1], place[2], float (std::sqrt (by)));
  };
  set_bank (set.residuals, residuals, part);
  if (!of_partner.empty ()) {
    set.of_partner.emplace (plan_, int (chunks));
    set_bank (*set.of_partner, of_partner, part * ratio);
  }
  for (std::size_t c = 0; c < classes.size (); c++)
    set.factors.push_back (float (
        std::sqrt (sought[c] / (part * (predicted[c] + ratio * partner[c])))));
  return set;
}

MotionFilter::Set
MotionFilter::make_followers (Neighbours neighbours) const
{
  std::vector<SceneClass> classes;
  for (const std::size_t number : models_.followed)
    classes.push_back (follower (models_.of_frame[number]));
  const double radius = plan_.radius + 0.5;
  Set set = make_set (
      classes, taps_around (radius, radius, neighbours), kFollowedTaps);
  set.followed = models_.followed;
  return set;
}

const MotionFilter::Set &
MotionFilter::of_frame (Neighbours neighbours)
{
  const Neighbours none = neighbours.none ();
  return of_frame_.get (none, [&] {
    return make_set (models_.of_frame,
        taps_around (plan_.radius + 0.5, kNeighbourRadius, none));
  });
}

std::vector<const MotionFilter::Set *>
MotionFilter::sets_for (Neighbours neighbours)
{
  if (!neighbours.any ())
    return {&of_frame (neighbours)};
  return {&of_frame (neighbours),
      &over_frames_.get (neighbours,
          [&] {
            return make_set (models_.over_frames,
                taps_around (plan_.radius + 0.5, kNeighbourRadius, neighbours));
          }),
      &followers_.get (
          neighbours, [&] { return make_followers (neighbours); })};
}

/* The squared residuals of a chunk of classes in row @y of pixels. */
void
MotionFilter::measure_row (const CodedFrames &frames, const Set &set, int group,
    int y, float *const *to, Room &room) const
{
  const int period = plan_.sources.period ();
  const auto sources = plan_.sources.row (frames, y, room.sources[0]);
  const int *phases = plan_.phases.of_row (y);
  const Run whole{0, room.part};
  std::array<float *, kChunk> parts;
  for (int k = 0; k < int (kChunk); k++)
    std::fill_n (room.parts.row (k), room.parts.width (), 0.0f);
  int outputs = 0;
  for (const FilterBank *bank :
      {&set.residuals, set.of_partner ? &*set.of_partner : nullptr})
    for (int column = 0; bank && column < period; column++) {
      const FilterRow row =
          bank->row (phases[column], column, group, sources, {&whole, 1});
      outputs = row.outputs;
      for (int k = 0; k < outputs; k++)
        parts[std::size_t (k)] = room.parts.row (k) + column * room.part;
      plan_.kernels.filter_squared (row, parts.data ());
    }
  for (int k = 0; k < outputs; k++)
    plan_.kernels.join ({period, room.part, frames.now->light.width ()},
        room.parts.row (k), nullptr, to[k]);
}

/* The same in all blocks of the room's rows and around them. */
void
MotionFilter::measure_blocks (
    const CodedFrames &frames, const Set &set, int group, Room &room) const
{
  const int width = frames.now->light.width ();
  const int height = frames.now->light.height ();
  for (int y = -kReach; y < room.rows + kReach; y++) {
    std::array<float *, 2 * kChunk> to;
    for (std::size_t i = 0; i < 2 * kChunk; i++)
      to[i] = room.squares.row (int (i));
    for (const int half : {0, 1})
      measure_row (frames, set, group,
          mirrored (2 * (room.first + y) + half, height),
          to.data () + (half ? kChunk : 0), room);
    for (std::size_t i = 0; i < kChunk; i++) {
      for (float *square : {to[i], to[i + kChunk]})
        for (int x = 1; x <= 2 * kReach + 1; x++) {
          square[-x] = square[mirrored (-x, width)];
          square[width - 1 + x] = square[mirrored (width - 1 + x, width)];
        }
      plan_.kernels.sum_blocks (to[i] - 2 * kReach, to[i + kChunk] - 2 * kReach,
          room.blocks + 2 * kReach, room.sums[i].row (y) - kReach);
    }
  }
}

/* The squared error of the classes of @set around each block of the room, whose
 * classes of the frame come first. */
void
MotionFilter::measure (const CodedFrames &frames, const Set &set,
    std::size_t first, Room &room) const
{
  for (std::size_t c = 0; c < set.factors.size (); c++) {
    if (c % kChunk == 0)
      measure_blocks (frames, set, int (c / kChunk), room);
    const Field &sums = room.sums[c % kChunk];
    for (int y = -kReach; y < room.rows + kReach; y++)
      blur (plan_.kernels, sums.row (y), 1, room.blocks,
          room.along.row (y + kReach));
    for (int y = 0; y < room.rows; y++)
      blur (plan_.kernels, room.along.row (y + kReach), room.along.stride (),
          room.blocks, room.fit (first + c, y));
  }
  for (std::size_t c = 0; c < set.followed.size (); c++)
    for (int y = 0; y < room.rows; y++) {
      const float *alone = room.fit (set.followed[c], y);
      float *fit = room.fit (first + c, y);
      for (int x = 0; x < room.blocks; x++)
        fit[x] = std::max (fit[x], kLeastPart * alone[x]);
    }
}

/* Weights (best error / error) ^ 8. Were the errors independent, the number of
 * those in the surroundings would ask for a power of some 20; but they are not,
 * and a mean of several filters is truer than the one that happens to fit best.
 */
void
MotionFilter::set_weights (Room &room, Field &misfit) const
{
  std::vector<float *> fit (room.factors.size ());
  for (int y = 0; y < room.rows; y++) {
    for (std::size_t c = 0; c < fit.size (); c++)
      fit[c] = room.fit (c, y);
    plan_.kernels.weigh ({fit.data (), room.factors.data (), int (fit.size ()),
                             kErrorFloor, kMinWeight, room.blocks},
        misfit.row (room.first + y));
  }
}

/* The sum of all classes by their weights, for row @y of the room's blocks. */
void
MotionFilter::mix (const CodedFrames &frames, std::span<const Set *const> sets,
    int y, std::span<Field> slots, Room &room) const
{
  const int period = plan_.sources.period (), n = int (slots.size ());
  const int width = slots[0].width ();
  const int first = 2 * (room.first + y);
  const int end = std::min (first + 2, slots[0].height ());
  const Parts of_shares{period / 2, room.part, room.blocks};
  const int *phases[2];
  for (int row = first; row < end; row++) {
    plan_.sources.row (frames, row, room.sources[row - first]);
    phases[row - first] = plan_.phases.of_row (row);
  }
  for (int i = 0; i < 2 * n; i++)
    std::fill_n (room.parts.row (i), room.parts.width (), 0.0f);
  std::vector<float *> to (slots.size ());
  std::size_t c = 0;
  for (const Set *set : sets)
    for (int of_set = 0; of_set < set->filters.groups (); of_set++, c++) {
      plan_.kernels.split (of_shares, room.fit (c, y), room.shares.row (0));
      for (int column = 0; column < period; column++) {
        const float *share =
            room.shares.row (0) + column / 2 * std::ptrdiff_t (room.part);
        if (column % 2 == 0)
          find_runs (share, room.part, room.runs);
        if (room.runs.empty ())
          continue;
        for (int row = first; row < end; row++) {
          for (int s = 0; s < n; s++)
            to[std::size_t (s)] = room.parts.row ((row - first) * n + s) +
                                  column * std::ptrdiff_t (room.part);
          plan_.kernels.filter_add (
              set->filters.row (phases[row - first][column], column, of_set,
                  room.sources[row - first], room.runs),
              share, to.data ());
        }
      }
    }
  for (int row = first; row < end; row++)
    for (int s = 0; s < n; s++)
      plan_.kernels.join ({period, room.part, width},
          room.parts.row ((row - first) * n + s), nullptr,
          slots[std::size_t (s)].row (row));
}

void
MotionFilter::run (const CodedFrames &frames, std::span<Field> slots,
    Field &misfit, const Task &task)
{
  const std::vector<const Set *> sets = sets_for (frames.neighbours ());
  std::vector<float> factors;
  for (const Set *set : sets)
    std::ranges::copy (set->factors, std::back_inserter (factors));
  std::vector<std::optional<Room>> rooms (std::size_t (task.workers.count ()));
  const int rows = misfit.height ();
  task.run ((rows + kBandRows - 1) / kBandRows, [&] (int part, int worker) {
    auto &room = rooms[std::size_t (worker)];
    if (!room)
      room.emplace (slots[0].width (), plan_.sources.period (),
          int (slots.size ()), factors);
    room->first = part * kBandRows;
    room->rows = std::min (kBandRows, rows - room->first);
    std::size_t first = 0;
    for (const Set *set : sets) {
      measure (frames, *set, first, *room);
      first += set->factors.size ();
    }
    set_weights (*room, misfit);
    for (int y = 0; y < room->rows; y++)
      mix (frames, sets, y, slots, *room);
  });
}

} // namespace codedexposure::fuse
