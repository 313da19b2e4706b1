/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/linear_filter.h"

#include <algorithm>
#include <optional>

namespace codedexposure::fuse
{

namespace
{

/* Squared errors of filters beyond those with all taps, as a part of them,
 * which are smaller with a partner. */
constexpr double kExcess = 0.015, kExcessWithPartner = 0.05;
/* Rows that a thread takes at a time. */
constexpr int kBandRows = 16;

} // namespace

LinearFilter::LinearFilter (
    const FilterPlan &plan, const Models &models, const PartnerFit *fit)
    : plan_ (plan), models_ (models), fit_ (fit)
{
  for (const bool before : {false, true}) {
    const Neighbours usual = models_.used (plan.usual (before));
    filters_.get (usual, [&] { return make_filters (usual); });
  }
}

LinearFilter::Banks
LinearFilter::make_filters (Neighbours neighbours) const
{
  const std::vector<SceneClass> &models = models_.with (neighbours);
  const double radius = plan_.radius + 0.5;
  const std::vector<Tap> wide = taps_around (
                             radius, kNeighbourRadius, neighbours.none ()),
                         all =
                             taps_around (radius, kNeighbourRadius, neighbours);
  const int slots = plan_.observation.slots ();
  Banks banks;
  for (const SceneClass &model : models) {
    /* What moves fast has left the pixel in other frames. */
    const std::vector<Tap> &taps = &model == &models.back () ? wide : all;
    FilterBank &bank = banks.emplace_back (plan_, slots);
    for_each_sparse_phase (plan_, model, taps, Sought::kSlots,
        neighbours.partner ? kExcessWithPartner : kExcess,
        [&] (int row, int x, const std::vector<float> &weights) {
          for (int s = 0; s < slots; s++)
            bank.set (row, x, s, taps,
                std::span (weights).subspan (
                    std::size_t (s) * taps.size (), taps.size ()));
        });
  }
  return banks;
}

/* The estimates of one row, in parts. */
struct LinearFilter::Room {
  Parts parts;
  int blocks;                     ///< of a part, kRunBlock values each
  Field shares;                   ///< of the models, as rows
  Field split;                    ///< the same in parts
  Field light;                    ///< of the slots in parts
  Field rows;                     ///< of the slots
  Field still;                    ///< static light times its weight
  std::vector<std::uint8_t> kept; ///< blocks of each model
  std::vector<Run> runs;          ///< of one model
  std::vector<const std::int32_t *> sources;
  std::optional<PartnerFit::Room> of_fit;

  Room (int width, int period, int models, int slots)
      : parts{period, SplitField::split_length (width, period), width},
        blocks (int (parts.stride) / kRunBlock), shares (width, models),
        split (int (parts.stride) * period, models),
        light (int (parts.stride) * period, slots), rows (width, slots),
        still (width, 1), kept (std::size_t (models * blocks))
  {
  }

  void find_runs (int model)
  {
    runs.clear ();
    for (int b = 0; b < blocks; b++)
      if (kept[std::size_t (model * blocks + b)])
        add_block (runs, b);
  }
};

void
LinearFilter::share (const Predictions::Found &predicted,
    const StaticPixels::Found &still, int y, Room &to) const
{
  std::vector<const float *> preferences;
  for (const Field &preference : predicted.preferences)
    preferences.push_back (
        preference.row (std::min (y / 2, preference.height () - 1)));
  std::vector<float *> shares;
  for (int model = 0; model < to.shares.height (); model++)
    shares.push_back (to.shares.row (model));
  plan_.kernels.share (
      {still.weight.row (y), still.light.row (y),
          preferences.empty () ? nullptr : preferences.data (),
          int (shares.size ()), kRunBlock * to.parts.period, to.parts.count},
      to.still.row (0), shares.data (), to.kept.data ());
  for (int model = 0; model < to.shares.height (); model++)
    plan_.kernels.split (to.parts, to.shares.row (model), to.split.row (model));
}

void
LinearFilter::estimate (
    const Banks &filters, const CodedFrames &frames, int y, Room &to) const
{
  const int slots = to.light.height ();
  const auto sources = plan_.sources.row (frames, y, to.sources);
  const int *phases = plan_.phases.of_row (y);
  for (int s = 0; s < slots; s++)
    std::fill_n (to.light.row (s), to.light.width (), 0.0f);
  for (std::size_t model = 0; model < filters.size (); model++) {
    to.find_runs (int (model));
    for (int column = 0; column < to.parts.period; column++) {
      const auto at = column * to.parts.stride;
      for (int s = 0; s < slots; s++) {
        float *light = to.light.row (s) + at;
        plan_.kernels.filter_add (
            filters[model].row (phases[column], column, s, sources, to.runs),
            to.split.row (int (model)) + at, &light);
      }
    }
  }
  for (int s = 0; s < slots; s++)
    plan_.kernels.join (
        to.parts, to.light.row (s), to.still.row (0), to.rows.row (s));
}

void
LinearFilter::run (const CodedFrames &frames,
    const Predictions::Found &predicted, const StaticPixels::Found &still,
    const RowSink &sink, const Task &task)
{
  const Neighbours used = models_.used (frames.neighbours ());
  const Banks &filters =
      filters_.get (used, [&] { return make_filters (used); });
  const int slots = plan_.observation.slots ();
  const int height = still.weight.height ();
  std::vector<std::optional<Room>> rooms (std::size_t (task.workers.count ()));
  task.run ((height + kBandRows - 1) / kBandRows, [&] (int part, int worker) {
    auto &room = rooms[std::size_t (worker)];
    if (!room)
      room.emplace (plan_.sources.width (), plan_.sources.period (),
          int (filters.size ()), slots);
    if (fit_ && !room->of_fit)
      room->of_fit.emplace (*fit_);
    std::vector<float *> rows;
    for (int s = 0; s < slots; s++)
      rows.push_back (room->rows.row (s));
    const int end = std::min ((part + 1) * kBandRows, height);
    for (int y = part * kBandRows; y < end; y++) {
      share (predicted, still, y, *room);
      estimate (filters, frames, y, *room);
      if (frames.has_partner ())
        fit_->run (
            y, frames.now->partner.light.row (y), rows.data (), *room->of_fit);
      sink (y, rows.data ());
    }
  });
}

} // namespace codedexposure::fuse
