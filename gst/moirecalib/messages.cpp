/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What moirecalib says on the bus; fields: docs/formats.md. */
#include "common/messages.h"
#include "moirecalib.h"

#define GST_CAT_DEFAULT moirecalib_debug

namespace codedexposure::gst::moire
{

namespace
{

StageMove
move_of (const StageCorrection &correction, const Pose &sigma)
{
  return {correction.offset.x, correction.offset.y, correction.rotation,
      correction.magnification, correction.deviation, correction.stage_x,
      correction.stage_y, correction.stage_theta, correction.magnify,
      sigma.shift_x, sigma.shift_y, sigma.rotation, sigma.magnification};
}

} // namespace

void
set_stage (GstMoireCalib *self, Stage stage)
{
  Stage before;
  {
    const ObjectLock lock (self);
    before = std::exchange (state (self).stage, stage);
  }
  if (before == stage)
    return;
  post_message (self,
      MoireState{session_stage_text (stage), session_stage_text (before)});
  g_object_notify (G_OBJECT (self), "state");
}

void
say_reading (GstMoireCalib *self, const Sample &sample,
    const LiveReading &reading, const StageCorrection &correction)
{
  post_message (
      self, MoireReading{{move_of (correction, reading.mapping.pose_sigma ())},
                sample.number, sample.pts,
                alignment_state_text (correction.state), reading.contrast.x,
                reading.contrast.y, reading.coverage, reading.saturated});
}

void
say_phase (GstMoireCalib *self, const Sample &sample,
    const CalibrationSession::Phase &found)
{
  const TilePhase &tile = found.tile;
  post_message (
      self, MoirePhase{sample.number, sample.pts, tile.phase.x, tile.phase.y,
                tile.confidence, tile.contrast, found.schedule.text ()});
}

void
say_mapping (GstMoireCalib *self, const CalibrationResult &result,
    const std::string &location, const std::string &report)
{
  const auto pixels = [&result] (PixelQuality what) {
    return guint64 (result.pixels (what));
  };
  const Pose pose = result.mapping.pose ();
  const StageCorrection correction =
      correct_stage (result.mapping, settings_of (self).stage);
  post_message (self,
      MoireMapping{{move_of (correction, result.mapping.pose_sigma ())},
          result.mapping.to_json (), location, report, pose.shift_x,
          pose.shift_y, pose.stretch, result.psf_sigma, result.misfit,
          pixels (PixelQuality::good), pixels (PixelQuality::uncovered),
          pixels (PixelQuality::low_contrast), pixels (PixelQuality::saturated),
          pixels (PixelQuality::outlier)});
}

} // namespace codedexposure::gst::moire
