/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The options behind the name of a DMD. */
#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dmd/dlpc350_protocol.h"
#include "dmd/hid_link.h"
#include "dmd/pattern_timing.h"
#include "schedule/mirror_array.h"

namespace codedexposure
{

/**
 * Options of a real DMD: "SCHEME:WHICH[,key=value...]" with the keys
 *   master=dmd|camera    which device triggers; default dmd
 *   layout=address|lattice|cell  of the tile on a diamond array
 *   region=WxH[+X+Y]     mirrors that show masks; the others stay off and
 *                        upload in almost no time
 *   trigger-delay=TIME   from the camera's edge to light (DLPC900: default
 *                        105 us, or the min time of a mask if that is longer)
 *   edge=rising|falling  of the camera's signal
 *   pulse=high|low       level of the pulses to the camera (USB boards)
 *   patience=TIME        how long a job waits for a USB board that does not
 *                        answer or is not ready; default 2 s. A DLPC900 has
 *                        10 s or more for a table
 *   guard=on|off         stop_guard.h; default on
 * for boards whose masks come from elsewhere (DLPC350),
 *   images=A[/B...]      flash images that hold the masks, 24 each
 *   source=flash|video
 * and for what the documents leave open, see docs/dmd.md:
 *   polarity-bit=0|1     of the DLPC350 that pulse=low sets
 *   odd-rows=right|left  where they are shifted to on a diamond array
 *   gap=TIME             between two masks of a DLP3000, default 250 us
 */
struct DmdOptions {
  std::string which; ///< what stands between the scheme and the first comma
  std::vector<std::string> keys = {}; ///< of the options that follow
  Master master = Master::dmd;
  Placement placement = {};
  std::optional<Nanoseconds> trigger_delay = {};
  bool falling_edge = false;
  bool pulse_low = false;
  std::chrono::milliseconds patience = HidLink::kPatience;
  std::vector<int> images = {};
  dlpc350::Source source = dlpc350::Source::flash;
  bool guard = true;
  int polarity_bit = 0;
  Nanoseconds gap = 250'000;

  /** @p device  with its scheme, which the message names. */
  static Result<DmdOptions> parse (std::string_view device);
};

/** A key of a device name, for drivers with options of their own. */
struct DeviceKey {
  std::string name;
  std::string values; ///< for people: "on|off"
  /** Sets the option; false for a value that it does not have. */
  std::function<bool (std::string_view value)> set;
};

/** Sets the options that @p device, "SCHEME:WHICH[,key=value...]", names.
 * Returns WHICH. */
Result<std::string> parse_device (
    std::string_view device, std::span<const DeviceKey> keys);

/** A key that sets @p option to one of @p values by its name. */
template <typename T>
DeviceKey
choice_key (std::string name, T &option,
    std::initializer_list<std::pair<std::string_view, T>> values)
{
  DeviceKey key{std::move (name), "", {}};
  for (const auto &[known, value] : values) {
    if (!key.values.empty ())
      key.values += '|';
    key.values += known;
  }
  key.set = [&option, values = std::vector (values)] (std::string_view text) {
    for (const auto &[known, value] : values)
      if (text == known) {
        option = value;
        return true;
      }
    return false;
  };
  return key;
}

/** A key whose value @p parse reads into @p option; @p parse returns a Result
 * or a std::optional. */
template <typename T, typename Parse>
DeviceKey
value_key (std::string name, std::string values, T &option, Parse parse)
{
  return {std::move (name), std::move (values),
      [&option, parse] (std::string_view text) {
        const auto value = parse (text);
        if (value)
          option = *value;
        return bool (value);
      }};
}

} // namespace codedexposure
