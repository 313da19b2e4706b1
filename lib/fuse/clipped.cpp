/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/clipped.h"

#include <cstddef>

namespace codedexposure::fuse
{

namespace
{

/* Along a line of @count values, @step apart. */
void
spread (std::uint8_t *line, int count, std::ptrdiff_t step)
{
  std::vector<int> last (static_cast<std::size_t> (count)); // marks before
  int mark = -kClippedReach - 1;
  for (int k = 0; k < count; k++)
    last[std::size_t (k)] = mark = line[k * step] != 0 ? k : mark;
  int next = count + kClippedReach;
  for (int k = count - 1; k >= 0; k--) {
    next = line[k * step] != 0 ? k : next;
    line[k * step] =
        k - last[std::size_t (k)] <= kClippedReach || next - k <= kClippedReach;
  }
}

} // namespace

std::vector<std::uint8_t>
near_marks (std::vector<std::uint8_t> marks, int width, int height)
{
  for (int y = 0; y < height; y++)
    spread (marks.data () + std::ptrdiff_t (y) * width, width, 1);
  for (int x = 0; x < width; x++)
    spread (marks.data () + x, height, width);
  return marks;
}

} // namespace codedexposure::fuse
