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

class ServedBench
{
public:
  /** @p board   "dlp6500" or "dlp5500".
   *  @p faults  words with '@' are of frames; the others are of the bench.
   *  @p size    of the camera, pixels.
   *  @p camera  its settings, which faults may change. */
  static Result<std::unique_ptr<ServedBench>> open (const std::string &board,
      const std::string &faults, Extent size, GigeCameraOptions camera);
  virtual ~ServedBench () = default;

  /** As the camera serves. */
  virtual const GigeCameraOptions &camera_options () const = 0;
  /** What a process needs in its environment to see the USB. */
  virtual std::vector<std::pair<std::string, std::string>>
  environment () const = 0;
};

/** The faults that a bench can have, a line each. */
std::string fault_help ();

/** Prints a line of JSON for a frame that was sent. */
void print_sent (const SentFrame &sent);

} // namespace codedexposure
