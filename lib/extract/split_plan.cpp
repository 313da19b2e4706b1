/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/split_plan.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/try.h"

namespace codedexposure
{

namespace
{

/* The element whose exposure is the k-th shortest; none where another one is
 * as long. */
std::optional<int>
element_of_rank (const Code &code, int k)
{
  for (int element = 0; element < code.elements (); element++) {
    int shorter = 0, equal = 0;
    for (int other = 0; other < code.elements (); other++) {
      shorter += code.on_slots (other) < code.on_slots (element);
      equal += code.on_slots (other) == code.on_slots (element);
    }
    if (shorter == k && equal == 1)
      return element;
  }
  return std::nullopt;
}

/* First and last slot in which the light of subframe @k fell. */
std::pair<int, int>
slots_of (const Code &code, Method method, int k)
{
  if (method == Method::kDecode ||
      (method == Method::kSelect && code.one_hot ()))
    return {k, k};
  const auto element = method == Method::kRank ? element_of_rank (code, k) : k;
  int first = 0, last = code.slots () - 1;
  while (element && !code.on (*element, first))
    first++;
  while (element && !code.on (*element, last))
    last--;
  return {first, last};
}

std::vector<Nanoseconds>
even_steps (FrameRate rate, int n)
{
  std::vector<Nanoseconds> boundaries;
  for (int k = 0; k <= n; k++)
    boundaries.push_back (rate.time_of (0, k, n));
  return boundaries;
}

template <typename Pixel>
Result<AnyExtractor>
make_extractor (
    const Schedule &part, Extent size, const ExtractOptions &options)
{
  ASSIGN_OR_RETURN (auto made,
      Extractor<Pixel>::make (part, size.width, size.height, options));
  return AnyExtractor (std::move (made));
}

/* @region -1: the background. */
Result<SplitPart>
make_part (const Schedule &whole, int region, const SplitFormat &format,
    ExtractOptions options)
{
  const Rect rect = region < 0
                        ? Rect{0, 0, format.size.width, format.size.height}
                        : whole.regions ()[std::size_t (region)].rect;
  const Schedule &decoded = region < 0 ? whole : whole.region (region);
  options.gain *= double (decoded.code ().slots ()) / whole.code ().slots ();
  const Extent size{rect.width, rect.height};
  const auto make = format.wide ? make_extractor<std::uint16_t>
                                : make_extractor<std::uint8_t>;
  ASSIGN_OR_RETURN (auto extractor, make (decoded, size, options));
  SplitPart part{region, region < 0 ? whole.background () : decoded, rect,
      std::move (extractor), {}, {}};
  part.boundaries = even_steps (format.rate, part.schedule.slots ());
  part.windows = light_windows (part.schedule, part.method (), format.slots);
  return part;
}

} // namespace

std::vector<LightWindow>
light_windows (const Schedule &part, Method method, const SlotPlan &slots)
{
  /* Slots of the exposure for which the part holds each of its masks. */
  const int held = slots.slots () / part.slots ();
  std::vector<LightWindow> windows;
  for (int k = 0; k < part.slots (); k++) {
    const auto [first, last] = slots_of (part.code (), method, k);
    const Nanoseconds start = slots.start (first * held);
    const Nanoseconds end =
        slots.start (last * held + held - 1) + slots.active ();
    windows.push_back ({start, end - start});
  }
  return windows;
}

Method
SplitPart::method () const
{
  return std::visit ([] (const auto &e) { return e.method (); }, extractor);
}

double
SplitPart::gain () const
{
  return std::visit ([] (const auto &e) { return e.gain (); }, extractor);
}

Result<std::vector<SplitPart>>
make_split_plan (const Schedule &schedule, const SplitFormat &format,
    const ExtractOptions &options)
try {
  RETURN_IF_ERROR (schedule.check_size (format.size.width, format.size.height));
  std::vector<SplitPart> parts;
  for (int i = -1; i < int (schedule.regions ().size ()); i++) {
    ASSIGN_OR_RETURN (auto part, make_part (schedule, i, format, options));
    parts.push_back (std::move (part));
  }
  return parts;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

std::vector<SplitTurn>
order_subframes (const std::vector<SplitPart> &parts, bool backwards)
{
  std::vector<SplitTurn> turns;
  for (std::size_t i = 0; i < parts.size (); i++) {
    const auto n = std::size_t (parts[i].subframes ());
    for (std::size_t k = 0; k < n; k++)
      turns.push_back ({i, backwards ? n - 1 - k : k});
  }
  const auto time = [&parts] (const SplitTurn &turn) {
    return parts[turn.part].boundaries[turn.subframe];
  };
  std::stable_sort (turns.begin (), turns.end (),
      [&] (const SplitTurn &a, const SplitTurn &b) {
        return backwards ? time (a) > time (b) : time (a) < time (b);
      });
  return turns;
}

} // namespace codedexposure
