/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Commands and tables of the DLPC350 controller, as bytes. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dmd/hid_link.h"
#include "dmd/pattern_timing.h"

namespace codedexposure::dlpc350
{

using namespace dlp;

constexpr HidCommand kSource{0x1A22, "choose the source of patterns"};
constexpr HidCommand kTriggerMode{0x1A23, "choose the trigger mode"};
constexpr HidCommand kTimes{0x1A29, "set exposure and period"};
constexpr HidCommand kConfigure{0x1A31, "set up the pattern table"};
constexpr HidCommand kMailboxOffset{0x1A32, "address the mailbox"};
constexpr HidCommand kMailbox{0x1A33, "open or close the mailbox"};
constexpr HidCommand kMailboxData{0x1A34, "fill the mailbox"};
constexpr HidCommand kValidate{0x1A1A, "validate the pattern table"};
constexpr HidCommand kFlashImages{0x1A42, "count the images in flash"};

constexpr std::uint8_t kModePattern = 1;
constexpr std::uint8_t kMailboxClosed = 0;
constexpr std::uint8_t kMailboxImages = 1;
constexpr std::uint8_t kMailboxPatterns = 2;

enum class Source : std::uint8_t { video = 0, flash = 3 };
/** What steps through the table: the frames of the video; or a timer or the
 * trigger input, entry by entry. */
enum class TriggerMode : std::uint8_t { video = 0, timer_or_input = 1 };
enum class Trigger : std::uint8_t {
  timer = 0,
  rising = 1,
  falling = 2,
  none = 3, ///< continues the pattern before
};

/** One line of the pattern table: a binary plane, all LEDs as they are. */
struct Entry {
  Trigger trigger = Trigger::timer;
  int plane = 0;           ///< of the image: 0..7 green, 8..15 red, 16..23 blue
  bool next_image = false; ///< takes the next image of the image table first
  bool black_after = false;
};
/** 3 bytes each, end to end. */
Bytes encode_entries (const std::vector<Entry> &entries);

/** @p per_trigger  patterns from one pulse of trigger output 2 to the next. */
Bytes encode_configuration (int entries, int per_trigger, int images);
/** Exposure and frame period, us. */
Bytes encode_times (const PatternTime &time);

/** Trigger output 2, without delay, as pulses to high or @p low level.
 * @p polarity_bit  of low ones, 0 or 1: documents disagree on which it is. */
Bytes encode_pulse (bool low, int polarity_bit);

/** The result of the validation. */
struct Verdict {
  bool busy;
  bool good;        ///< no error; it starts in spite of warnings
  std::string text; ///< errors and warnings, or ""
};
/** @p triggered  each frame waits for the camera: without black before it, its
 * last mask would stay on until then, which is an error. */
Verdict parse_verdict (std::uint8_t byte, bool triggered = false);

} // namespace codedexposure::dlpc350
