/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The mapping of a second camera, in the beam of the mirrors that are off, from
 * the partners of the frames of the first. */
#pragma once

#include <optional>

#include "calibrate/session.h"
#include "common/partner.h"
#include "moirecalib.h"

namespace codedexposure::gst::moire
{

/** In the worker. */
class SecondSession
{
public:
  /** Beside a run of @p first, with @p settings. */
  SecondSession (const Geometry &first, const Settings &settings)
      : first_ (first), bits_ (settings.bits)
  {
  }

  /** A frame of @p pattern, whose first one says the size of all. */
  void collect (const Pattern &pattern, const Partner &partner);
  /** None: no frame came. */
  Result<std::optional<CalibrationResult>> solve ();

private:
  const Geometry first_;
  const int bits_; ///< that were set; 0: as the frames say
  std::optional<GstVideoInfo> info_;
  std::optional<CalibrationSession> session_;
  std::optional<Error> failure_; ///< the first one
};

} // namespace codedexposure::gst::moire
