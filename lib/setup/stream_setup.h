/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a stream carries in its tag: its schedule and, if known, its mapping and
 * the profile of its bench. */
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/geometry.h"
#include "base/result.h"
#include "mapping/mapping.h"
#include "schedule/schedule.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** The second camera, in the beam of the mirrors that are off. */
struct PartnerSetup {
  Extent size = {}; ///< of its frames
  std::optional<Mapping> mapping = {};
  int black = 0; ///< level without light, DN
  /** Of its profile, 0 where they are not known: e-/DN, e- rms, and its DN of
   * light for each DN of the first camera (BenchProfile::light_ratio). */
  double electrons = 0.0, read_noise = 0.0, light_ratio = 0.0;

  bool operator== (const PartnerSetup &) const = default;
};

/** All that was decided and measured before the exposure. */
struct StreamSetup {
  /** Bound on the JSON form, in bytes. */
  static constexpr std::size_t kMaxJsonSize = Schedule::kMaxJsonSize +
                                              2 * Mapping::kMaxJsonSize +
                                              BenchProfile::kMaxJsonSize;

  Schedule schedule;
  std::optional<Mapping> mapping = {};
  /** Of the coded frames when they left the camera: what differs from it was
   * cropped, scaled or timed anew. */
  std::optional<Extent> size = {};
  std::optional<FrameRate> rate = {};
  /** Significant bits of their pixels, counted from the lowest, if they are
   * fewer than the format's; 0: all, or unknown. */
  int bits = 0;
  /** A track with a line for each frame accompanies the frames. */
  bool track = false;
  /** The frames are those of a simulated bench. */
  bool simulated = false;
  /** Of the camera and the DMD. */
  std::optional<BenchProfile> bench = {};
  /** The camera is in the beam of the mirrors that are off: its frames are
   * partners of those of another stream. */
  bool off_beam = false;
  /** Frames have partners. */
  std::optional<PartnerSetup> partner = {};

  /** The JSON form of the schedule with keys more that may be left out:
   * "mapping", which holds the JSON form of a mapping, "size", "rate", "bits",
   * "track", "simulated", "bench", which holds that of a bench profile,
   * "beam", which is "off", and "partner" with "size", "mapping",
   * "black", "electrons", "read_noise" and "light_ratio". */
  static Result<StreamSetup> from_json (std::string_view json);
  /** One line. Without the others it is schedule.to_json (). */
  std::string to_json () const;

  /** What is known of the second camera, whose setup this is, with frames of
   * @p frames. */
  PartnerSetup as_partner (Extent frames) const;

  /** That of the stream, else that of its bench profile. */
  std::optional<Mapping> known_mapping () const
  {
    return mapping || !bench ? mapping : bench->known_mapping ();
  }

  bool operator== (const StreamSetup &) const = default;
};

} // namespace codedexposure
