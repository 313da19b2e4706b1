/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/partner_fit.h"

#include <algorithm>
#include <array>

namespace codedexposure::fuse
{

namespace
{

/* Of the surroundings of a pixel, px, which are summed in two steps: kPart
 * pixels, and as many of these sums. */
constexpr int kPart = 5;
constexpr int kCount = kPart * kPart;
constexpr int kAround = kCount / 2;
/* Noise of r, in units of that of the partner's pixel. */
constexpr float kNoise = 1.5f;
constexpr float kFloor = 1e-3f;

enum Row { kMissed, kSquared, kParts, kSum, kSquares, kRows };

/* Sums over the kCount pixels around each one of @row, whose ends are repeated
 * in its margin. */
void
sum_around (
    const Kernels &kernels, float *row, int width, float *parts, float *to)
{
  std::fill_n (row - kAround, kAround, row[0]);
  std::fill_n (row + width, kAround, row[width - 1]);
  constexpr int kInner = kAround - kPart / 2; // margin of parts
  std::array<const float *, kPart> around;
  for (int i = 0; i < kPart; i++)
    around[std::size_t (i)] = row - kInner + i - kPart / 2;
  kernels.sum (around.data (), kPart, width + 2 * kInner, parts - kInner);
  for (int i = 0; i < kPart; i++)
    around[std::size_t (i)] = parts + (i - kPart / 2) * kPart;
  kernels.sum (around.data (), kPart, width, to);
}

} // namespace

PartnerFit::PartnerFit (const Kernels &kernels, const Schedule &schedule,
    const Observation &partner, Extent size)
    : kernels_ (kernels), noise_ (schedule, partner, size),
      responses_ (std::size_t (partner.slots ()),
          Field (size.width,
              std::min (size.height, schedule.tile ().period_y ()))),
      steps_ (responses_.front ())
{
  for (int y = 0; y < steps_.height (); y++)
    for (int x = 0; x < size.width; x++) {
      double squares = 0.0;
      for (const auto &[slot, response] :
          partner.shares (schedule.element_at (x, y))) {
        responses_[std::size_t (slot)].row (y)[x] = float (response);
        squares += response * response;
      }
      steps_.row (y)[x] = float (1.0 / squares);
    }
}

PartnerFit::Room::Room (const PartnerFit &fit)
    : rows_ (fit.steps_.width (), kRows, kAround)
{
}

void
PartnerFit::make (int y, const float *const *light, float *to) const
{
  const int width = steps_.width ();
  std::fill_n (to, width, 0.0f);
  for (std::size_t s = 0; s < responses_.size (); s++) {
    const float *response = responses_[s].row (y % steps_.height ());
    for (int x = 0; x < width; x++)
      to[x] += response[x] * light[s][x];
  }
}

void
PartnerFit::follow (int y, int slot, float *to) const
{
  const int row = y % steps_.height ();
  const float *response = responses_[std::size_t (slot)].row (row);
  const float *step = steps_.row (row);
  for (int x = 0; x < steps_.width (); x++)
    to[x] = response[x] * step[x];
}

void
PartnerFit::run (
    int y, const float *partner, float *const *light, Room &room) const
{
  const int width = steps_.width (), slots = int (responses_.size ());
  room.responses_.clear ();
  for (const Field &response : responses_)
    room.responses_.push_back (response.row (y % steps_.height ()));
  const float *const *responses = room.responses_.data ();
  float *missed = room.rows_.row (kMissed);
  float *squared = room.rows_.row (kSquared);
  kernels_.miss ({light, responses, slots, partner, width}, missed, squared);
  float *parts = room.rows_.row (kParts), *sum = room.rows_.row (kSum);
  float *squares = room.rows_.row (kSquares);
  sum_around (kernels_, missed, width, parts, sum);
  sum_around (kernels_, squared, width, parts, squares);
  kernels_.move (
      {missed, sum, squares, kCount, partner, noise_.slopes (y),
          noise_.offsets (y), kNoise, kFloor, steps_.row (y % steps_.height ()),
          responses, slots, width},
      light);
}

} // namespace codedexposure::fuse
