/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* An emulated LightCrafter 6500 or 9000: its registers, its memory and the
 * commands that it rejects. Written from the documentation of the controller,
 * not from the driver. */
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <optional>

#include "base/geometry.h"
#include "dmd/boards.h"
#include "emulation/hid.h"
#include "emulation/spld_decoder.h"

namespace codedexposure::emulated
{

class EmulatedDlpc900 : public EmulatedDlpc
{
  const int type_;
  const BoardFacts &facts_;

public:
  using Mirrors = Image<std::uint8_t>;

  struct Line {
    std::uint32_t exposure = 0, dark = 0;
    bool waits = false, pulses = false;
    int image = 0, plane = 0;
    /** Black follows it. It belongs to the line that stands in the table before
     * one that waits, wherever the order shows either of them. */
    bool black_after = false;
  };

  /** @p type  of the hardware, as find_dlpc900 () has it; of another one, it
   * only tells its type. */
  explicit EmulatedDlpc900 (int type = 1)
      : EmulatedDlpc (0, {{0x0200, 1}, {0x0201, 1}, {0x0609, 1}, {0x1A1B, 1},
                             {0x1A1E, 5}, {0x1A24, 1}, {0x1A2A, 6}, {0x1A2C, 6},
                             {0x1A31, 6}, {0x1A34, 12}, {0x1A35, 3}}),
        type_ (type),
        facts_ (find_dlpc900 (type) ? *find_dlpc900 (type) : *find_dlpc900 (1))
  {
  }

  /** Called after its patterns were started or stopped. */
  std::function<void (bool running)> on_run = {};

  bool firmware_has_minima = true;
  /** Min exposure of a binary mask and min delay of its trigger, us. */
  std::uint32_t minimum = facts_.limits.minimum_exposure;
  int firmware_major = 6, firmware_minor = 0;

  bool idle () const { return idle_; }
  int park_cycles () const { return park_cycles_; }
  int images_received () const { return images_received_; }
  bool dual () const { return facts_.controllers == 2; }
  Extent size () const { return facts_.size; }

  /** Loses its power and restarts, without a mode and without masks. */
  void power_cycle ()
  {
    mode_ = 0;
    idle_ = true;
    running_ = configured_ = false;
    defined_.clear ();
    lines_.clear ();
    order_.clear ();
    loading_ = {};
    images_ = {};
  }

  /** Lines of the table in the order in which they are shown. */
  std::vector<Line> shown () const
  {
    std::vector<Line> lines;
    for (const int line : order_)
      lines.push_back (lines_.at (line));
    return lines;
  }
  /** The mirrors that line @p at of shown () shows. */
  Mirrors mirrors (int at) const
  {
    const Line line = shown ().at (std::size_t (at));
    const Pixels &left = images_[0].at (line.image);
    const int parts = facts_.controllers;
    Mirrors out (left.width () * parts, left.height ());
    for (int part = 0; part < parts; part++) {
      const Pixels &image = images_[std::size_t (part)].at (line.image);
      for (int y = 0; y < left.height (); y++)
        for (int x = 0; x < left.width (); x++)
          out.at (part * left.width () + x, y) =
              image.at (x, y) >> line.plane & 1;
    }
    return out;
  }

private:
  static constexpr int kBadPlane = 10, kNoImage = 11, kBadDark = 12,
                       kBadDelay = 13, kBadExposure = 14, kBadNumber = 15,
                       kBadPattern = 16;

  struct Loading {
    int index = -1;
    std::size_t size = 0;
    Data bytes = {};
  };

  std::optional<Data> answer (int command) override
  {
    Data data;
    switch (command) {
    case 0x0100:
      return Data{std::uint8_t (error_)};
    case 0x0101: {
      data = {'n', 'o'};
      data.resize (128);
      return data;
    }
    case 0x0205:
      data = {
          3, 0, std::uint8_t (firmware_minor), std::uint8_t (firmware_major)};
      data.resize (16);
      return data;
    case 0x0206:
      data = {std::uint8_t (type_), 'L', 'C', 'R'};
      data.resize (32);
      return data;
    case 0x1A0A:
      return Data{std::uint8_t (dual () ? 0x11 : 0x01)};
    case 0x1A42: {
      if (!firmware_has_minima)
        return std::nullopt;
      const std::array<unsigned, 8> minima{
          minimum, 304, 394, 823, 1215, 1487, 1998, 4046};
      for (const unsigned us : minima) {
        data.push_back (std::uint8_t (us));
        data.push_back (std::uint8_t (us >> 8));
      }
      return data;
    }
    default:
      return std::nullopt;
    }
  }

  int execute (int command, const Data &data) override
  {
    switch (command) {
    case 0x1A24:
      return run (data[0]);
    case 0x0201:
      idle_ = data[0] == 1;
      return running_ ? kNotNow : 0;
    case 0x0609:
      park_cycles_ += data[0] == 0;
      return running_ ? kNotNow : 0;
    case 0x1A1B:
      if (running_)
        return kNotNow;
      mode_ = data[0];
      return 0;
    case 0x1A1E:
      return 0;
    case 0x1A35:
      return word (data, 0) < minimum ? kBadDelay : 0;
    case 0x1A34:
      return define (data);
    case 0x1A31:
      return configure (int (word (data, 0)));
    case 0x1A32:
      return reorder (data);
    case 0x1A2A:
      return announce (0, data);
    case 0x1A2C:
      return dual () ? announce (1, data) : kInvalid;
    case 0x1A2B:
    case 0x1A2D:
      return take_data (command == 0x1A2B ? 0 : 1, data);
    default:
      return kUnknown;
    }
  }

  int define (const Data &data)
  {
    if (mode_ != 3 || running_)
      return kNotNow;
    const int index = int (word (data, 0));
    const Line line{number (data, 2, 3), number (data, 6, 3),
        (data[5] & 0x80) != 0, (data[9] & 1) == 0,
        int (word (data, 10) & 0x7FF), int (word (data, 10) >> 11)};
    if (index > 399)
      return kBadNumber;
    if ((data[5] >> 1 & 7) != 0)
      return kBadPattern; // only binary ones here
    if (line.exposure < minimum)
      return kBadExposure;
    if (line.dark > 0 && line.dark < facts_.limits.minimum_dark)
      return kBadDark;
    if (line.plane > 23)
      return kBadPlane;
    if (line.image > 17)
      return kNoImage;
    if (defined_.empty () || configured_) {
      defined_.clear ();
      configured_ = false;
    }
    defined_[index] = line;
    return 0;
  }

  int configure (int count)
  {
    if (mode_ != 3 || running_)
      return kNotNow;
    if (count < 1 || count > 400)
      return kInvalid;
    for (int line = 0; line < count; line++)
      if (!defined_.contains (line))
        return kBadNumber;
    // A new number of planes invalidates the stored images.
    bool same = lines_.size () == std::size_t (count);
    for (int line = 0; same && line < count; line++)
      same = lines_[line].image == defined_[line].image &&
             lines_[line].plane == defined_[line].plane;
    if (!same)
      images_ = {};
    lines_ = defined_;
    for (int line = 0; line < count; line++)
      lines_[line].black_after = lines_[(line + 1) % count].waits;
    configured_ = true;
    last_index_ = {18, 18};
    order_.clear ();
    for (int line = 0; line < count; line++)
      order_.push_back (line);
    return 0;
  }

  int reorder (const Data &data)
  {
    if (!configured_ || running_ || firmware_major < 5 || data.size () < 6)
      return kNotNow;
    const std::size_t count = word (data, 0);
    if (data.size () != 6 + 2 * count)
      return kInvalid;
    std::vector<int> order;
    for (std::size_t i = 0; i < count; i++) {
      const int line = int (word (data, 6 + 2 * i));
      if (!lines_.contains (line))
        return kBadNumber;
      order.push_back (line);
    }
    order_ = order;
    return 0;
  }

  int announce (std::size_t half, const Data &data)
  {
    const int index = int (word (data, 0));
    if (mode_ != 3 || running_ || !configured_)
      return kNotNow;
    if (index >= last_index_[half])
      return kBadNumber; // they come from the highest down
    last_index_[half] = index;
    loading_[half] = {index, number (data, 2, 4)};
    images_[half].erase (index);
    return 0;
  }

  int take_data (std::size_t half, const Data &data)
  {
    constexpr int kBadCompression = 9;
    Loading &loading = loading_[half];
    if (loading.index < 0 || data.size () < 2 ||
        data.size () - 2 != word (data, 0) || data.size () > 506)
      return kInvalid;
    loading.bytes.insert (loading.bytes.end (), data.begin () + 2, data.end ());
    if (loading.bytes.size () < loading.size)
      return 0;
    const auto image = decode_spld (loading.bytes);
    const bool fits = image && loading.bytes.size () == loading.size &&
                      image->width () * facts_.controllers == size ().width &&
                      image->height () == size ().height;
    if (fits)
      images_[half][loading.index] = *image;
    images_received_++;
    loading = {};
    return fits ? 0 : kBadCompression;
  }

  int run (int what)
  {
    const int error = what == 2 ? start () : 0;
    if (what != 2)
      running_ = false;
    if (error == 0 && on_run)
      on_run (running_);
    return error;
  }

  int start ()
  {
    if (mode_ != 3 || !configured_ || idle_ || order_.empty ())
      return kNotNow;
    for (const auto &[index, line] : lines_) {
      for (std::size_t half = 0; half < (dual () ? 2u : 1u); half++)
        if (!images_[half].contains (line.image))
          return kNoImage;
      const bool whole =
          std::any_of (lines_.begin (), lines_.end (), [&] (const auto &other) {
            return other.second.image == line.image && other.second.plane == 0;
          });
      if (!whole)
        return kBadPattern;
    }
    running_ = true;
    return 0;
  }

  bool idle_ = true;
  bool configured_ = false;
  int park_cycles_ = 0;
  int images_received_ = 0;
  std::map<int, Line> defined_; // sent since the last configuration
  std::map<int, Line> lines_;   // in force
  std::vector<int> order_;
  std::array<int, 2> last_index_{18, 18};
  std::array<Loading, 2> loading_;
  std::array<std::map<int, Pixels>, 2> images_;
};

} // namespace codedexposure::emulated
