/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/view_check.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "base/geometry.h"

namespace codedexposure
{

namespace
{

/** One past the last byte. */
std::uintptr_t
end_of (const ViewBytes &view)
{
  return view.begin + std::uintptr_t ((view.height - 1) * view.stride +
                                      view.width * view.pixel);
}

bool
share_pixels (const ViewBytes &a, const ViewBytes &b)
{
  if (a.begin > b.begin)
    return share_pixels (b, a);
  if (end_of (a) <= b.begin)
    return false;
  if (a.stride != b.stride)
    return true;
  /* Images side by side in one larger image: b begins in row @rows of a, @left
   * bytes to the right, and its rows may reach into the row below. */
  const auto distance = std::ptrdiff_t (b.begin - a.begin);
  const std::ptrdiff_t rows = distance / a.stride, left = distance % a.stride;
  return (left < a.width * a.pixel && rows < a.height) ||
         (left + b.width * b.pixel > a.stride && rows + 1 < a.height);
}

/** The quick way to know for most sets of images: no two ranges of bytes
 * overlap. */
bool
lie_apart (std::span<const ViewBytes> outputs, const ViewBytes *input)
{
  constexpr std::size_t kMost =
      257; // a subframe for each element, and the input
  std::array<std::pair<std::uintptr_t, std::uintptr_t>, kMost> ranges;
  std::size_t count = 0;
  if (outputs.size () >= kMost)
    return false;
  if (input)
    ranges[count++] = {input->begin, end_of (*input)};
  for (const ViewBytes &output : outputs)
    ranges[count++] = {output.begin, end_of (output)};

  const std::span used (ranges.data (), count);
  if (!std::ranges::is_sorted (used))
    std::ranges::sort (used);
  const auto overlap = [] (const auto &a, const auto &b) {
    return a.second > b.first;
  };
  return std::ranges::adjacent_find (used, overlap) == used.end ();
}

} // namespace

Result<void>
check_view (const ViewBytes &view, const char *what, int width, int height)
{
  const auto error = [what] (const std::string &why) {
    return Error{std::string ("the ") + what + ' ' + why};
  };
  if (view.width != width || view.height != height)
    return error ("has " + size_text ({view.width, view.height}) +
                  " pixels instead of " + size_text ({width, height}));
  if (view.begin == 0)
    return error ("has no memory");
  if (view.stride < view.width * view.pixel)
    return error ("has a stride of " + std::to_string (view.stride) +
                  " bytes; its rows take " +
                  std::to_string (view.width * view.pixel));
  if (view.begin % std::uintptr_t (view.pixel) != 0 ||
      view.stride % view.pixel != 0)
    return error ("has rows that are not aligned to its pixels");
  return {};
}

Result<void>
check_apart (std::span<const ViewBytes> outputs, const ViewBytes *input)
{
  if (lie_apart (outputs, input))
    return {};
  for (std::size_t i = 0; i < outputs.size (); i++) {
    if (input && share_pixels (outputs[i], *input))
      return Error{"output " + std::to_string (i) + " overlaps the input"};
    for (std::size_t j = 0; j < i; j++)
      if (share_pixels (outputs[i], outputs[j]))
        return Error{"output " + std::to_string (i) + " overlaps output " +
                     std::to_string (j)};
  }
  return {};
}

} // namespace codedexposure
