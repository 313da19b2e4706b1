/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* An emulated LightCrafter 4500: its registers and the commands that it
 * rejects. Written from the documentation of the controller, not from the
 * driver. */
#pragma once

#include <array>
#include <map>
#include <optional>

#include "dmd/boards.h"
#include "emulation/hid.h"

namespace codedexposure::emulated
{

class EmulatedDlpc350 : public EmulatedDlpc
{
public:
  struct Line {
    int trigger = 0, plane = 0;
    bool next_image = false, black_after = false;
  };

  int flash_images = 2;
  bool video_locked = true;
  bool ignores_first_start = false;

  EmulatedDlpc350 ()
      : EmulatedDlpc (0, {{0x0200, 1}, {0x1A1A, 1}, {0x1A1B, 1}, {0x1A1E, 2},
                             {0x1A22, 1}, {0x1A23, 1}, {0x1A24, 1}, {0x1A29, 8},
                             {0x1A31, 4}, {0x1A32, 1}, {0x1A33, 1}})
  {
  }

  const std::vector<Line> &lines () const { return lines_; }
  const Data &images () const { return images_; }
  int source () const { return source_; }
  /** Polarity and delay of trigger output 2. */
  const Data &pulse () const { return pulse_; }
  int trigger_mode () const { return trigger_mode_; }
  std::uint32_t exposure () const { return exposure_; }
  std::uint32_t period () const { return period_; }
  /** Masks from one pulse of trigger output 2 to the next. */
  int per_trigger () const { return per_trigger_; }

private:
  std::optional<Data> answer (int command) override
  {
    switch (command) {
    case 0x0205:
      return Data (16, 4);
    case 0x1A0A:
      return Data{1};
    case 0x1A1A:
      // The validation takes time.
      if (busy_ > 0 && busy_-- > 0)
        return Data{0x80};
      return Data{std::uint8_t (verdict ())};
    case 0x1A42:
      return Data{std::uint8_t (flash_images)};
    default:
      return std::nullopt;
    }
  }

  int execute (int command, const Data &data) override
  {
    if (command == 0x1A24)
      return run (data[0]);
    if (running_)
      return kNotNow;
    if (command != 0x1A1A)
      valid_ = false;
    switch (command) {
    case 0x1A1A:
      busy_ = 2;
      valid_ = (verdict () & 3) == 0;
      return 0;
    case 0x1A1B:
      mode_ = data[0];
      return 0;
    case 0x1A1E:
      pulse_ = data;
      return 0;
    case 0x1A22:
      source_ = data[0];
      return source_ == 0 || source_ == 3 ? 0 : kInvalid;
    case 0x1A23:
      trigger_mode_ = data[0];
      return 0;
    case 0x1A29:
      exposure_ = number (data, 0, 4);
      period_ = number (data, 4, 4);
      return 0;
    case 0x1A31:
      entries_ = data[0] + 1;
      per_trigger_ = data[2] + 1;
      image_entries_ = data[3] + 1;
      return 0;
    case 0x1A32:
      return data[0] == 0 ? 0 : kInvalid;
    case 0x1A33:
      mailbox_ = data[0];
      return 0;
    case 0x1A34:
      return fill (data) ? 0 : kInvalid;
    default:
      return kUnknown;
    }
  }

  bool fill (const Data &data)
  {
    if (mailbox_ == 1) {
      images_ = data;
      return true;
    }
    if (mailbox_ != 2 || data.size () % 3 != 0)
      return false;
    lines_.clear ();
    for (std::size_t at = 0; at < data.size (); at += 3) {
      const auto bits = number (data, at, 3);
      if ((bits >> 8 & 15) != 1)
        return false; // only binary ones here
      lines_.push_back ({int (bits & 3), int (bits >> 2 & 63),
          (bits >> 18 & 1) != 0, (bits >> 17 & 1) != 0});
    }
    return true;
  }

  int verdict () const
  {
    int bits = 0;
    const bool gap = period_ != exposure_;
    const PatternLimits &limits = find_board ("dlp4500")->limits;
    if (exposure_ < limits.minimum_exposure || period_ < exposure_ ||
        exposure_ > limits.maximum_exposure || (trigger_mode_ == 0 && gap))
      bits |= 1;
    if (gap && period_ - exposure_ < limits.minimum_dark)
      bits |= 16;
    if (int (lines_.size ()) != entries_ || lines_.empty () ||
        !lines_.front ().next_image)
      bits |= 2;
    for (std::size_t at = 0; at < lines_.size (); at++) {
      const Line &before = lines_[(at == 0 ? lines_.size () : at) - 1];
      const bool edge = lines_[at].trigger == 1 || lines_[at].trigger == 2;
      if (lines_[at].plane > 24)
        bits |= 2;
      if (edge && !before.black_after)
        bits |= 8;
    }
    if (source_ == 3 && int (images_.size ()) != image_entries_)
      bits |= 2;
    for (const int image : images_)
      if (source_ == 3 && image >= flash_images)
        bits |= 2;
    return bits;
  }

  int run (int what)
  {
    if (what != 2) {
      running_ = false;
      valid_ = false;
      return 0;
    }
    if (ignores_first_start) {
      ignores_first_start = false;
      return 0;
    }
    // Without a successful validation, it acknowledges and does nothing.
    running_ =
        mode_ == 1 && valid_ && mailbox_ == 0 && (source_ == 3 || video_locked);
    return 0;
  }

  int source_ = 3, trigger_mode_ = 1, mailbox_ = 0;
  int entries_ = 0, per_trigger_ = 0, image_entries_ = 0, busy_ = 0;
  std::uint32_t exposure_ = 0, period_ = 0;
  bool valid_ = false;
  std::vector<Line> lines_;
  Data images_;
  Data pulse_{0, 0xBB}; // after a reset
};

} // namespace codedexposure::emulated
