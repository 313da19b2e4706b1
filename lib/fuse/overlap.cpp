/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/overlap.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "base/try.h"

namespace codedexposure::fuse
{

namespace
{

/* Light that leaked is that of the coded frame's other slots, not of those of
 * the exposure between. */
constexpr double kMaxLeak = 0.01;

/* Weights of a coded frame's own estimate, at its ends and in its middle. */
constexpr float kAtEnds = 0.3f, kInMiddle = 0.7f;

float
own_weight (int slot, int slots)
{
  const float sine = std::sin (
      std::numbers::pi_v<float> * (float (slot) + 0.5f) / float (slots));
  return kAtEnds + (kInMiddle - kAtEnds) * sine * sine;
}

} // namespace

std::string
Overlap::why_not (const Schedule &schedule, const FuseOptions &options)
{
  const std::string text = schedule.text ();
  if (options.partner)
    return "the frames of a second camera cannot be divided into slots";
  if (!schedule.code ().one_hot () || schedule.slots () < 2)
    return text + " has pixels that see more than one slot, which cannot be "
                  "divided";
  if (schedule.leak () > kMaxLeak)
    return text + ": mirrors that are off pass " +
           real_text (std::round (1000.0 * schedule.leak ()) / 10.0) +
           " % of the light of slots that the exposure between two frames has "
           "not; it must be " +
           real_text (100.0 * kMaxLeak) + " % at most";
  return {};
}

Result<std::unique_ptr<Overlap>>
Overlap::make (const Schedule &schedule, int width, int height,
    const FuseOptions &options, double steps, std::stop_token stop)
{
  FuseOptions between = options;
  between.overlap = false;
  between.lookahead = 0;
  ASSIGN_OR_RETURN (auto engine,
      Engine::make (schedule.from_slot (schedule.slots () / 2), nullptr, width,
          height, between, steps, std::move (stop)));
  return std::unique_ptr<Overlap> (new Overlap (schedule, std::move (engine)));
}

Overlap::Overlap (const Schedule &schedule, std::unique_ptr<Engine> engine)
    : slots_ (schedule.slots ()), first_ (slots_ / 2),
      late_ (engine->size ().width, engine->size ().height),
      engine_ (std::move (engine))
{
  for (int y = 0; y < late_.height (); y++)
    for (int x = 0; x < late_.width (); x++)
      for (int s = first_; s < slots_; s++)
        late_.row (y)[x] |= std::uint8_t (schedule.on (x, y, s));
}

/* The exposure after the middle of a coded frame. */
void
Overlap::take (const CodedFrames &frames)
{
  const CodedFrame &now = *frames.now, &next = *frames.after;
  CodedFrame &between = engine_->stream ().next ();
  const auto join = [&] (const Field &a, const Field &b, Field &to) {
    for (int y = 0; y < late_.height (); y++)
      for (int x = 0; x < late_.width (); x++)
        to.row (y)[x] = (late_.row (y)[x] ? a : b).row (y)[x];
  };
  join (now.light, next.light, between.light);
  if (!now.errors.empty () && !next.errors.empty ()) {
    between.errors = Field (late_.width (), late_.height ());
    join (now.errors, next.errors, between.errors);
  }
  engine_->stream ().take (engine_->kernels ());
}

bool
Overlap::fuse (
    Fused &to, bool deviations, Workers &workers, std::stop_token stop)
{
  const auto keep_in = [] (std::vector<Field> &fields) {
    return [&fields] (int slot, int y, const float *row) {
      Field &field = fields[std::size_t (slot)];
      std::copy_n (row, field.width (), field.row (y));
    };
  };
  const auto [width, height] = engine_->size ();
  to.light.resize (std::size_t (slots_), Field (width, height));
  const auto keep_light = keep_in (to.light);
  const RowSink sink = [&] (int y, const float *const *rows) {
    for (int s = 0; s < slots_; s++)
      keep_light (s, y, rows[s]);
  };
  Uncertainty::Sink of_deviations;
  if (!deviations) {
    to.deviations.clear ();
  } else {
    to.deviations.resize (std::size_t (slots_), Field (width, height));
    of_deviations = [keep = keep_in (to.deviations)] (
                        const Uncertainty::Row &row) {
      keep (row.slot, row.y, row.deviations);
    };
  }
  to.known = engine_->fuse (sink, workers, std::move (stop), of_deviations);
  return to.known;
}

bool
Overlap::run (const CodedFrames &frames, bool deviations, Workers &workers,
    std::stop_token stop)
{
  std::swap (before_, after_);
  after_.known = false;
  if (engine_->stream ().pending () > 0 &&
      !fuse (before_, deviations, workers, stop))
    return false;
  if (!frames.after)
    return true;
  take (frames);
  return fuse (after_, deviations, workers, std::move (stop));
}

void
Overlap::pass (const CodedFrames &frames, Workers &workers)
{
  before_.known = after_.known = false;
  if (engine_->stream ().pending () > 0)
    engine_->pass (workers);
  if (frames.after)
    take (frames);
}

void
Overlap::forget ()
{
  before_.known = after_.known = false;
  engine_->forget ();
}

const float *
Overlap::mix (std::vector<Field> Fused::*which, int slot, int y,
    const float *own, const float *is_static)
{
  Fused &between = slot < first_ ? before_ : after_;
  std::vector<Field> &fields = between.*which;
  if (!between.known || fields.empty ())
    return own;
  const int its_slot = slot < first_ ? slot + slots_ - first_ : slot - first_;
  Field &other = fields[std::size_t (its_slot)];
  float *row = other.row (y);
  const float weight = own_weight (slot, slots_);
  for (int x = 0; x < other.width (); x++)
    row[x] =
        own[x] + (1.0f - is_static[x]) * (1.0f - weight) * (row[x] - own[x]);
  return row;
}

} // namespace codedexposure::fuse
