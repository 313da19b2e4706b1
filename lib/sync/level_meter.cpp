/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/level_meter.h"

#include <algorithm>

namespace codedexposure
{

namespace
{

constexpr int kCodeRows = 64;
constexpr int kPilotRows = 16;

/** At most @p wanted of the numbers 0..available - 1, evenly spaced. */
std::vector<int>
spread (int available, int wanted)
{
  const int count = std::min (available, wanted);
  std::vector<int> chosen;
  for (int i = 0; i < count; i++)
    chosen.push_back (int (std::int64_t (i) * available / count));
  return chosen;
}

template <typename Pixel>
void
add_row (const Pixel *row, std::vector<std::uint32_t> &sums)
{
  const std::size_t width = sums.size ();
  for (std::size_t x = 0; x < width; x++)
    sums[x] += row[x];
}

} // namespace

LevelMeter::LevelMeter (
    const Schedule &schedule, int width, int height, double black)
    : width_ (width), black_ (black), tile_rows_ (schedule.tile ().period_y ()),
      tile_columns_ (schedule.tile ().period_x ()),
      pixels_ (std::size_t (schedule.elements ())),
      column_sums_ (std::size_t (width))
{
  levels_.elements.resize (pixels_.size ());
  for (int y = 0; y < tile_rows_; y++)
    for (int x = 0; x < tile_columns_; x++)
      element_.push_back (schedule.element_at (x, y));

  const int code_rows = std::max (0, height - schedule.pilot_rows ());
  blocks_ =
      spread (code_rows / tile_rows_, std::max (1, kCodeRows / tile_rows_));
  for (int &block : blocks_)
    block *= tile_rows_;
  for (std::size_t at = 0; at < element_.size (); at++) {
    const int x = int (at) % tile_columns_;
    const int columns = (width - x + tile_columns_ - 1) / tile_columns_;
    pixels_[std::size_t (element_[at])] +=
        double (columns) * double (blocks_.size ());
  }

  /* The lens blurs light of the code into the row next to it. */
  const int margin = schedule.pilot_rows () > 2 ? 1 : 0;
  pilot_rows_ =
      spread (std::min (height, schedule.pilot_rows ()) - margin, kPilotRows);
  for (int &row : pilot_rows_)
    row += code_rows + margin;

  complete_ = std::all_of (pixels_.begin (), pixels_.end (),
                  [] (double pixels) { return pixels > 0; }) &&
              (schedule.pilot_rows () == 0 ||
                  (!pilot_rows_.empty () && width >= kPilotColumns));
}

template <typename Pixel>
const Levels &
LevelMeter::measure (ImageView<const Pixel> frame)
{
  std::fill (levels_.elements.begin (), levels_.elements.end (), 0.0);
  for (int y = 0; y < tile_rows_; y++) {
    std::fill (column_sums_.begin (), column_sums_.end (), 0u);
    for (const int block : blocks_)
      add_row (frame.row (block + y), column_sums_);
    const int *element = &element_[std::size_t (y * tile_columns_)];
    for (int x = 0; x < width_; x++)
      levels_.elements[std::size_t (element[x % tile_columns_])] +=
          column_sums_[std::size_t (x)];
  }
  for (std::size_t e = 0; e < pixels_.size (); e++)
    levels_.elements[e] = std::max (
        0.0, levels_.elements[e] / std::max (pixels_[e], 1.0) - black_);

  levels_.pilot.fill (0.0);
  std::fill (column_sums_.begin (), column_sums_.end (), 0u);
  for (const int row : pilot_rows_)
    add_row (frame.row (row), column_sums_);
  for (int x = 0; x < width_; x++)
    levels_.pilot[std::size_t (x % kPilotColumns)] +=
        column_sums_[std::size_t (x)];
  for (int column = 0; column < kPilotColumns; column++) {
    const int columns = (width_ - column + kPilotColumns - 1) / kPilotColumns;
    double &level = levels_.pilot[std::size_t (column)];
    level /= std::max (1.0, double (columns) * double (pilot_rows_.size ()));
    level = std::max (0.0, level - black_);
  }
  return levels_;
}

template const Levels &LevelMeter::measure (ImageView<const std::uint8_t>);
template const Levels &LevelMeter::measure (ImageView<const std::uint16_t>);

} // namespace codedexposure
