/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The GenICam description of the simulated camera, and its registers that
 * Aravis' fake camera does not have. */
#pragma once

#include <string>
#include <vector>

#include <arv.h>

#include "base/free_with.h"
#include "emulation/gige_camera.h"

namespace codedexposure::genicam
{

/** Register in which a client enables the trigger. */
constexpr guint32 kTriggerMode = 0x400;
/** Registers of the lines, one after the other. */
constexpr guint32 kLineMode = 0x440, kLineSource = 0x444, kLineInverter = 0x448;
constexpr guint32 kNextLine = 0x20;
/** GigE Vision's own register of the packet size. */
constexpr guint32 kPacketSize = 0x0d04;
constexpr guint32 kGammaEnable = 0x50c, kGamma = 0x51c, kTriggerDelay = 0x520;

/** The format with that code on the wire. */
MonoFormat format_of (guint32 code);

/** The register of a feature that Aravis' camera does not have. */
struct ExtraFeature {
  const char *name;
  guint32 address;
  std::vector<std::string> values; ///< of an enumeration; none: a number
};
const std::vector<ExtraFeature> &extra_features ();

/** Writes a temporary file with the description: that of Aravis, with formats,
 * lines and features of this camera. Returns its name; the caller deletes it.
 */
Result<std::string> write_description (const GigeCameraOptions &options);

} // namespace codedexposure::genicam
