/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A bench with an emulated board on an emulated USB and an emulated camera that
 * sees its mirrors, for other processes. */
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "emulation/gige_camera.h"

namespace codedexposure
{

class LiveBench;

class ServedBench
{
public:
  /** @p board   "dlp6500" or "dlp5500".
   *  @p faults  words with '@' are of frames; the others are of the bench, such
   *  as "dmd-busy".
   *  @p size    of the cameras, pixels.
   *  @p cameras their settings, which faults may change: of the first one and,
   *  if there are two, of that in the beam of the mirrors that are off.
   *  Fails if this build has no emulated USB. */
  static Result<std::unique_ptr<ServedBench>> open (const std::string &board,
      const std::string &faults, Extent size,
      std::vector<GigeCameraOptions> cameras);
  ~ServedBench ();
  ServedBench (const ServedBench &) = delete;
  ServedBench &operator= (const ServedBench &) = delete;

  /** As the cameras serve. */
  const std::vector<GigeCameraOptions> &camera_options () const
  {
    return options_;
  }
  /** What a process needs in its environment to see the USB. */
  std::vector<std::pair<std::string, std::string>> environment () const;

private:
  struct Usb;

  ServedBench ();

  bool slow_disk_ = false;
  std::vector<GigeCameraOptions> options_;
  std::unique_ptr<LiveBench> bench_;
  std::unique_ptr<Usb> usb_;
  std::vector<std::unique_ptr<GigeCamera>> cameras_;
};

/** Prints a line of JSON for a frame that the camera at @p address sent. */
void print_sent (const std::string &address, const SentFrame &sent);

} // namespace codedexposure
