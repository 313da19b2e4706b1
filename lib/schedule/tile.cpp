/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/tile.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <optional>

#include "base/text.h"

namespace codedexposure
{

namespace
{

using std::to_string;

Error
bad_elements (const std::string &name, int elements)
{
  return {"tile '" + name + "' has " + to_string (elements) +
          " elements; a tile has 2 to " + to_string (Tile::kMaxElements)};
}

/** "diamond:N" is a tile for the N = 2r^2 + 2r + 1 with r >= 1. */
std::optional<int>
diamond_radius (int elements)
{
  for (int r = 1; 2 * r * r + 2 * r + 1 <= Tile::kMaxElements; r++)
    if (2 * r * r + 2 * r + 1 == elements)
      return r;
  return std::nullopt;
}

bool
holds_each_label_once (const Tile &tile, int left, int top, Extent block)
{
  std::vector<bool> seen (std::size_t (tile.elements ()));
  for (int y = top; y < top + block.height; y++) {
    for (int x = left; x < left + block.width; x++) {
      auto seen_label = seen[std::size_t (tile.label (x, y))];
      if (seen_label)
        return false;
      seen_label = true;
    }
  }
  return true;
}

/**
 * Whether @p block is a cell. Its sides divide the period: with g the greatest
 * common divisor of width and period, blocks stand at every multiple of g, and
 * what a step of g drops at a block's left it gains at its right. So the labels
 * of g columns come again after a width, after a period, and therefore after g
 * columns: only a block of g columns holds none of them twice.
 */
bool
is_cell (const Tile &tile, Offset phase, Extent block)
{
  if (tile.period_x () % block.width != 0 ||
      tile.period_y () % block.height != 0)
    return false;
  for (int y = 0; y < tile.period_y (); y += block.height)
    for (int x = 0; x < tile.period_x (); x += block.width)
      if (!holds_each_label_once (tile, x + phase.x, y + phase.y, block))
        return false;
  return true;
}

} // namespace

Tile::Tile (std::string name, int elements, int period_x, int period_y,
    std::vector<std::uint8_t> labels)
    : name_ (std::move (name)), elements_ (elements), period_x_ (period_x),
      period_y_ (period_y), labels_ (std::move (labels))
{
}

Result<Tile>
Tile::raster (int columns, int rows)
try {
  const std::string name = size_text ({columns, rows});
  if (columns < 1 || rows < 1 || columns > kMaxElements ||
      rows > kMaxElements || columns * rows < 2 ||
      columns * rows > kMaxElements)
    return Error{"tile '" + name +
                 "': a raster has at least one column and "
                 "one row and 2 to " +
                 to_string (kMaxElements) + " elements in all"};

  std::vector<std::uint8_t> labels (std::size_t (columns * rows));
  std::iota (labels.begin (), labels.end (), std::uint8_t (0));
  return Tile (name, columns * rows, columns, rows, std::move (labels));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<Tile>
Tile::lattice (int elements, int step)
try {
  const std::string name =
      "lattice:" + to_string (elements) + "/" + to_string (step);
  if (elements < 2 || elements > kMaxElements)
    return bad_elements (name, elements);
  if (step < 0 || step >= elements)
    return Error{"tile '" + name + "': the step " + to_string (step) +
                 " must lie in 0.." + to_string (elements - 1)};

  const int period_y = elements / std::gcd (elements, step);
  std::vector<std::uint8_t> labels;
  for (int y = 0; y < period_y; y++)
    for (int x = 0; x < elements; x++)
      labels.push_back (std::uint8_t ((x + step * y) % elements));
  return Tile (name, elements, elements, period_y, std::move (labels));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<Tile>
Tile::diamond (int elements)
try {
  const std::string name = "diamond:" + to_string (elements);
  const std::optional<int> radius = diamond_radius (elements);
  if (!radius)
    return Error{"tile '" + name +
                 "': a diamond has 5, 13, 25, 41, 61, 85, "
                 "113, 145, 181 or 221 elements"};

  auto tile = lattice (elements, 2 * *radius + 1);
  if (tile)
    tile->name_ = name;
  return tile;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<Tile>
Tile::from_labels (int period_x, int period_y, std::vector<std::uint8_t> labels)
try {
  if (period_x < 1 || period_y < 1 || period_x > kMaxPeriod ||
      period_y > kMaxPeriod)
    return Error{"label map of " + to_string (period_x) + " x " +
                 to_string (period_y) + " pixels: each side must lie in 1.." +
                 to_string (kMaxPeriod)};
  if (labels.size () != std::size_t (period_x * period_y))
    return Error{"label map of " + to_string (period_x) + " x " +
                 to_string (period_y) + " pixels needs " +
                 to_string (period_x * period_y) + " labels, not " +
                 to_string (labels.size ())};

  std::vector<bool> seen (kMaxElements);
  for (const std::uint8_t label : labels)
    seen[label] = true;
  const int elements = int (std::count (seen.begin (), seen.end (), true));
  for (int label = 0; label < elements; label++)
    if (!seen[std::size_t (label)])
      return Error{"label map with " + to_string (elements) +
                   " different labels lacks label " + to_string (label) +
                   "; labels must be 0.." + to_string (elements - 1)};
  if (elements < 2)
    return bad_elements ("labels", elements);
  return Tile ("labels", elements, period_x, period_y, std::move (labels));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<Tile>
Tile::parse (std::string_view text)
try {
  const Error malformed{
      "tile " + in_quotes (text) +
      " is none of WxH, lattice:N/B and diamond:N, such as 2x2, lattice:8/3 "
      "or diamond:13; any other is written out in a JSON file"};
  const auto after = [text] (std::string_view prefix) {
    return text.starts_with (prefix)
               ? std::optional (text.substr (prefix.size ()))
               : std::nullopt;
  };
  const auto pair = [] (std::string_view both, char separator) {
    const std::size_t at = both.find (separator);
    return at == both.npos
               ? std::pair (std::optional<int> (), std::optional<int> ())
               : std::pair (parse_int (both.substr (0, at)),
                     parse_int (both.substr (at + 1)));
  };

  if (const auto rest = after ("lattice:")) {
    const auto [elements, step] = pair (*rest, '/');
    return elements && step ? lattice (*elements, *step) : malformed;
  }
  if (const auto rest = after ("diamond:")) {
    const auto elements = parse_int (*rest);
    return elements ? diamond (*elements) : malformed;
  }
  const auto [columns, rows] = pair (text, 'x');
  return columns && rows ? raster (*columns, *rows) : malformed;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<Extent>
Tile::cell (Offset phase) const
{
  std::vector<Extent> blocks;
  for (int width = 1; width <= elements_; width++)
    if (elements_ % width == 0)
      blocks.push_back ({width, elements_ / width});
  std::stable_sort (
      blocks.begin (), blocks.end (), [] (const Extent &a, const Extent &b) {
        const int a_off = std::abs (a.width - a.height);
        const int b_off = std::abs (b.width - b.height);
        return a_off != b_off ? a_off < b_off : a.width > b.width;
      });

  for (const Extent &block : blocks)
    if (is_cell (*this, phase, block))
      return block;
  return Error{"tile '" + name_ + "' with phase " + to_string (phase.x) + "/" +
               to_string (phase.y) + " has no cell: no block of " +
               to_string (elements_) +
               " pixels, repeated from pixel (0, 0) on, holds each label "
               "exactly once"};
}

} // namespace codedexposure
