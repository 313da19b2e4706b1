/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Everything that was decided before the exposure, as one value. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "schedule/code.h"
#include "schedule/tile.h"
#include "schedule/timing.h"

namespace codedexposure
{

/**
 * An area of the frame with a tile and a code of its own, and so with a frame
 * rate of its own. Its tile begins at its own corner: pixel (rect.x + x, rect.y
 * + y) bears label tile.label (x + phase.x, y + phase.y).
 */
struct Region {
  Rect rect;
  Tile tile;
  Code code;
  std::vector<int> order = {}; ///< as in Schedule::Parts
  Offset phase = {};

  bool operator== (const Region &) const = default;
};

/**
 * Tile, code and timing of a coded exposure.
 *
 * The DMD driver renders masks from it, the simulator integrates light with
 * it, the demultiplexer decodes with it, the recorder stores it.
 *
 * A pixel's label, its place in the tile, becomes its element, its row of the
 * code, through the order. An immutable value: make () is the only way in, so
 * that every schedule there is can be shown and decoded.
 *
 * Regions have their own tile and code; tile and code of the schedule are those
 * of the rest, the background. All share one exposure: it has as many slots as
 * the least common multiple L of those of all codes, and a code of n slots
 * holds each of its masks for L / n of them. background () and region () are
 * the schedules of the parts, which pictures are extracted with; what shows
 * masks or collects light takes the whole.
 */
class Schedule
{
public:
  /** Bound on pilot rows and on the phase: no array of mirrors is larger. */
  static constexpr int kMaxMirrors = 16384;
  static constexpr double kMaxLeak = 0.5;
  static constexpr int kMaxRegions = 64;
  /** Bound on the slots of an exposure, with regions as without. */
  static constexpr int kMaxSlots = Tile::kMaxElements;
  /** Bound on the JSON form, in bytes. */
  static constexpr std::size_t kMaxJsonSize = std::size_t (1) << 20;

  struct Parts {
    Tile tile;
    Code code;
    Timing timing = {};
    /** Element of each label, a permutation of 0..n-1; empty: the labels. */
    std::vector<int> order = {};
    /** Pixel (x, y) bears label tile.label (x + phase.x, y + phase.y). */
    Offset phase = {};
    /** Light of a mirror that is off, as a part of one that is on; [0, 0.5]. */
    double leak = 0.0;
    /** Rows at the bottom of the array that show the pilot (pilot.h) instead
     * of the code; 0: no pilot. */
    int pilot_rows = 0;
    /** None overlaps another; sides are multiples of the region's cell. */
    std::vector<Region> regions = {};

    bool operator== (const Parts &) const = default;
  };

  /** sequential:2x2, the default everywhere. */
  Schedule ();
  /** Error when tile and code differ in n, the order is no permutation, the
   * tile has no cell at this phase, a number is out of its range, or regions
   * overlap, are empty, hold a part of a cell, need too many slots or cannot
   * be written in kMaxJsonSize bytes. */
  static Result<Schedule> make (Parts parts);

  /**
   * A preset or the path of a JSON file. What begins with the name of a code
   * and ':' is a preset; of the rest, what holds a '/' or ends in ".json" is a
   * path, and everything else a preset again, a wrong one. (So
   * "./staircase:2x2" is a path, and "sequential:lattice:8/3" is not.)
   */
  static Result<Schedule> parse (std::string_view preset_or_path);
  /**
   * "CODE:TILE[,key=value...]". CODE and TILE as Code::named () and
   * Tile::parse () know them; each key at most once, in any order:
   *   active, switching, readout   times, parse_time ()
   *   order   raster (the default), bit-reversal, or the element of each
   *           label, as in 0/2/1/3. bit-reversal lists the numbers below n in
   *           the order of their reversed binary digits; where n is no power
   *           of two, as many digits as n - 1 has
   *   phase   x/y
   *   leak    0 to 0.5
   *   pilot   rows
   *   region  WxH+X+Y:CODE:TILE[:order=...][:phase=x/y]; this key may stand
   *           more than once
   */
  static Result<Schedule> from_preset (std::string_view preset);
  /** The strict, versioned text form: unknown, missing and doubled keys, other
   * types and other versions are errors. See docs/formats.md. */
  static Result<Schedule> from_json (std::string_view json);
  /** One line; equal schedules have equal texts. */
  std::string to_json () const;
  /** A preset that parses back to this schedule; for a tile or code that was
   * written out, a description in the same manner that does not. */
  std::string text () const;

  const Tile &tile () const { return parts_.tile; }
  const Code &code () const { return parts_.code; }
  const Timing &timing () const { return parts_.timing; }
  const std::vector<int> &order () const { return parts_.order; }
  Offset phase () const { return parts_.phase; }
  double leak () const { return parts_.leak; }
  int pilot_rows () const { return parts_.pilot_rows; }
  /** Whether mirrors of the pilot are on where pilot_on () says off: in a
   * complement (). */
  bool pilot_inverted () const { return pilot_inverted_; }
  const std::vector<Region> &regions () const { return parts_.regions; }

  /** Region @p i as a schedule of its own, of the pixels of its rectangle. It
   * has the leak and the white of the whole, slots as long as those for which
   * the whole holds its masks, no pilot and no regions. */
  const Schedule &region (int i) const { return in_region_[std::size_t (i)]; }
  /** The schedule without its regions, but with the white and the times of the
   * whole, as region () has them. */
  Schedule background () const;
  /** Region in which pixel (x, y) lies; -1: the background. */
  int region_at (int x, int y) const;
  /** The same with another leak. */
  Result<Schedule> with_leak (double leak) const;
  /** Of a schedule without regions: that of an exposure which begins in slot
   * @p first, and goes on with the first slots of the next one. It has no text
   * form of its own. */
  Schedule from_slot (int first) const;
  /** What the beam of the mirrors that are off has of this schedule: all codes
   * and the pilot complemented. It has no text form of its own. Error where an
   * element is on in every slot. */
  Result<Schedule> complement () const;
  /** Error where a region does not lie within @p width x @p height pixels,
   * above the pilot. */
  Result<void> check_size (int width, int height) const;

  /** Of the tile, which is that of the background. */
  int elements () const { return parts_.tile.elements (); }
  /** Slots of the exposure: those of the code, or of all codes together. */
  int slots () const { return slots_; }
  /** Which mask of @p code, one of its parts', stands in a slot. */
  int mask_of (const Code &code, int slot) const
  {
    return slot * code.slots () / slots_;
  }
  /** The block of pixels that becomes one pixel of every subframe. Cells lie on
   * the grid that starts at the coded frame's pixel (0, 0). */
  Extent cell () const { return cell_; }

  /** Element of the pixel (x, y) of the background, pilot or not. */
  int element_at (int x, int y) const
  {
    const int label =
        parts_.tile.label (x + parts_.phase.x, y + parts_.phase.y);
    return parts_.order[std::size_t (label)];
  }

  /** Whether the mirror of pixel (x, y), no pilot's, is on in a slot. */
  bool on (int x, int y, int slot) const
  {
    return in_region_.empty () ? parts_.code.on (element_at (x, y), slot)
                               : on_in_part (x, y, slot);
  }

  /** Masks in one period of what the DMD shows: N, or 2 N with a pilot. */
  int masks () const { return slots () * (parts_.pilot_rows > 0 ? 2 : 1); }

  /** Light that an element of the background lets through in a slot, of what a
   * mirror that is on does: 1, or the leak. */
  double light (int element, int slot) const
  {
    const Code &code = parts_.code;
    return code.light (element, mask_of (code, slot), parts_.leak);
  }
  /** The same in all slots. */
  double light (int element) const;
  /** Of a mirror that is on in @p on_slots of the slots. */
  double light_of (int on_slots) const
  {
    return on_slots + parts_.leak * (slots_ - on_slots);
  }

  /** Slots in which the mirror is on that is on longest. */
  int max_on_slots () const;
  /** Slots' worth of white light that make white in the coded frame, so that
   * the element with the most light () just fills the range. Of a part of
   * another schedule, it is the white of that one, which may be more than any
   * element of the part sees. */
  double white_slots () const { return white_slots_; }

  bool operator== (const Schedule &other) const
  {
    return parts_ == other.parts_ && white_slots_ == other.white_slots_ &&
           pilot_inverted_ == other.pilot_inverted_;
  }

private:
  Schedule (Parts parts, Extent cell);
  Result<void> add_regions ();
  void fit_into (const Schedule &whole);
  bool on_in_part (int x, int y, int slot) const;

  Parts parts_;
  Extent cell_;
  /* These follow from parts_, but for the white of a part. */
  int slots_;
  double white_slots_;
  bool pilot_inverted_ = false;
  std::vector<Schedule> in_region_;
};

} // namespace codedexposure
