/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/partner_correction.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/pixels.h"
#include "base/try.h"
#include "base/workers.h"
#include "fuse/lone_fuser.h"
#include "schedule/element_map.h"

namespace codedexposure
{

namespace
{

/* Of the errors of a partner, after the correction: 0.3 to 0.5 on clips, the
 * less the more of them there were. */
constexpr float kLeft = 0.45f;

/** Light of an element: `all` times the sum of all slots, and `more` times
 * that of some. */
struct SlotSum {
  float all, more;
  std::vector<int> slots;
};

/* Of few slots: of those in which the mirror is on or off. */
SlotSum
slot_sum (const ElementMap &elements, int element, float scale)
{
  const int slots = elements.schedule ().slots ();
  const float leak = float (elements.schedule ().leak ());
  std::vector<int> on, off;
  for (int s = 0; s < slots; s++)
    (elements.on (element, s) ? on : off).push_back (s);
  if (on.size () <= off.size ())
    return {leak * scale, (1.0f - leak) * scale, std::move (on)};
  return {scale, (leak - 1.0f) * scale, std::move (off)};
}

} // namespace

template <typename Pixel>
struct PartnerCorrection<Pixel>::State {
  Rectifier rectifier;
  fuse::LoneFuser<Pixel> fuser;
  std::unique_ptr<Workers> workers;
  Pixel largest;
  std::vector<SlotSum> sums;       ///< of each element of the complement
  Image<std::uint16_t> elements;   ///< of each mirror but the pilot's
  Image<std::uint16_t> light = {}; ///< that the partner must have got

  void add_up (int y)
  {
    std::vector<float> all (std::size_t (light.width ()));
    std::vector<const Pixel *> rows;
    for (const Image<Pixel> &slot : fuser.slots ()) {
      rows.push_back (slot.view ().row (y));
      for (std::size_t x = 0; x < all.size (); x++)
        all[x] += float (rows.back ()[x]);
    }
    const std::uint16_t *numbers = elements.view ().row (y);
    std::uint16_t *to = light.view ().row (y);
    for (std::size_t x = 0; x < all.size (); x++) {
      const SlotSum &sum = sums[numbers[x]];
      float more = 0.0f;
      for (const int slot : sum.slots)
        more += float (rows[std::size_t (slot)][x]);
      to[x] = std::uint16_t (std::clamp (
          sum.all * all[x] + sum.more * more + 0.5f, 0.0f, 65535.0f));
    }
  }
};

template <typename Pixel>
Result<PartnerCorrection<Pixel>>
PartnerCorrection<Pixel>::make (const Schedule &schedule,
    const Rectifier &partner, const FuseOptions &options, std::stop_token stop)
try {
  FuseOptions threaded = options;
  auto workers = std::make_unique<Workers> (
      std::clamp (options.threads, 0, Workers::kMost));
  if (options.threads == 0)
    threaded.threads = workers->count ();
  ASSIGN_OR_RETURN (
      auto fuser, fuse::LoneFuser<Pixel>::make (schedule, partner.mirrors (),
                      threaded, std::move (stop)));
  ASSIGN_OR_RETURN (const Schedule complement, schedule.complement ());
  const ElementMap map (complement);
  double most = 0.0;
  for (int e = 0; e < map.elements (); e++)
    most = std::max (most, map.light (e));
  const Pixel largest = largest_pixel_of<Pixel> (options.bits);
  std::vector<SlotSum> sums;
  for (int e = 0; e < map.elements (); e++)
    sums.push_back (slot_sum (map, e, float (65535.0 / (most * largest))));
  const Extent size{
      fuser.slots ().front ().width (), fuser.slots ().front ().height ()};
  std::shared_ptr<State> state (new State{partner, std::move (fuser),
      std::move (workers), largest, std::move (sums), {size.width, size.height},
      {size.width, size.height}});
  for (int y = 0; y < size.height; y++)
    for (int x = 0; x < size.width; x++)
      state->elements.at (x, y) = std::uint16_t (map.at (x, y));
  return PartnerCorrection (std::move (state));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

template <typename Pixel>
Result<void>
PartnerCorrection<Pixel>::run (ImageView<const Pixel> coded,
    ImageView<Pixel> partner, const std::optional<ImageView<float>> &errors,
    std::stop_token stop)
{
  RETURN_IF_ERROR (state_->fuser.run (coded, std::move (stop)));
  state_->workers->run (
      state_->light.height (), [this] (int y, int) { state_->add_up (y); });
  for (int y = 0; errors && y < errors->height; y++)
    for (int x = 0; x < errors->width; x++)
      errors->at (x, y) *= kLeft;
  return state_->rectifier.correct (partner,
      std::as_const (state_->light).view (), *state_->workers, state_->largest);
}

template class PartnerCorrection<std::uint8_t>;
template class PartnerCorrection<std::uint16_t>;

} // namespace codedexposure
