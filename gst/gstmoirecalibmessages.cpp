/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What moirecalib says on the bus; fields: docs/formats.md. */
#include "gstmoirecalibstate.h"

#define GST_CAT_DEFAULT moirecalib_debug

namespace cexp::gst::moire
{

namespace
{

void
post (GstMoireCalib *self, GstStructure *structure)
{
  gst_element_post_message (GST_ELEMENT (self),
      gst_message_new_element (GST_OBJECT (self), structure));
}

void
add_correction (GstStructure *structure, const StageCorrection &correction,
    const Stance &sigma)
{
  gst_structure_set (structure, "offset-x", G_TYPE_DOUBLE, correction.offset.x,
      "offset-y", G_TYPE_DOUBLE, correction.offset.y, "rotation", G_TYPE_DOUBLE,
      correction.rotation, "magnification", G_TYPE_DOUBLE,
      correction.magnification, "deviation", G_TYPE_DOUBLE,
      correction.deviation, "stage-x", G_TYPE_DOUBLE, correction.stage_x,
      "stage-y", G_TYPE_DOUBLE, correction.stage_y, "stage-theta",
      G_TYPE_DOUBLE, correction.stage_theta, "magnify", G_TYPE_DOUBLE,
      correction.magnify, "sigma-x", G_TYPE_DOUBLE, sigma.shift_x, "sigma-y",
      G_TYPE_DOUBLE, sigma.shift_y, "sigma-rotation", G_TYPE_DOUBLE,
      sigma.rotation, "sigma-magnification", G_TYPE_DOUBLE, sigma.magnification,
      nullptr);
}

} // namespace

const char *
stage_text (Stage stage)
{
  switch (stage) {
  case Stage::mapping:
    return "mapping";
  case Stage::solving:
    return "solving";
  case Stage::mapped:
    return "mapped";
  case Stage::failed:
    return "failed";
  case Stage::found:
    return "found";
  default:
    return alignment_state_text (AlignmentState (stage));
  }
}

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
  post (self, gst_structure_new ("moirecalib/state", "state", G_TYPE_STRING,
                  stage_text (stage), "before", G_TYPE_STRING,
                  stage_text (before), nullptr));
  g_object_notify (G_OBJECT (self), "state");
}

void
say_reading (GstMoireCalib *self, const Sample &sample,
    const LiveReading &reading, const StageCorrection &correction)
{
  GstStructure *structure = gst_structure_new ("moirecalib/reading", "frame",
      G_TYPE_UINT64, sample.number, "pts", G_TYPE_UINT64, sample.pts, "state",
      G_TYPE_STRING, alignment_state_text (correction.state), "contrast-x",
      G_TYPE_DOUBLE, reading.contrast.x, "contrast-y", G_TYPE_DOUBLE,
      reading.contrast.y, "coverage", G_TYPE_DOUBLE, reading.coverage,
      "saturated", G_TYPE_UINT64, guint64 (reading.saturated), nullptr);
  add_correction (structure, correction, reading.mapping.stance_sigma ());
  post (self, structure);
}

void
say_phase (GstMoireCalib *self, const Sample &sample, const FoundPhase &found)
{
  const TilePhase &tile = found.tile;
  post (self, gst_structure_new ("moirecalib/phase", "frame", G_TYPE_UINT64,
                  sample.number, "pts", G_TYPE_UINT64, sample.pts, "phase-x",
                  G_TYPE_INT, tile.phase.x, "phase-y", G_TYPE_INT, tile.phase.y,
                  "confidence", G_TYPE_DOUBLE, tile.confidence, "contrast",
                  G_TYPE_DOUBLE, tile.contrast, "schedule", G_TYPE_STRING,
                  found.schedule.text ().c_str (), nullptr));
}

void
say_progress (
    GstMoireCalib *self, GstProgressType type, const std::string &text)
{
  gst_element_post_message (
      GST_ELEMENT (self), gst_message_new_progress (GST_OBJECT (self), type,
                              "mapping", text.c_str ()));
}

void
say_mapping (GstMoireCalib *self, const CalibrationResult &result,
    const std::string &location, const std::string &report)
{
  const auto pixels = [&result] (PixelQuality what) {
    return guint64 (result.pixels (what));
  };
  const Stance stance = result.mapping.stance ();
  GstStructure *structure = gst_structure_new ("moirecalib/mapping", "mapping",
      G_TYPE_STRING, result.mapping.to_json ().c_str (), "location",
      G_TYPE_STRING, location.c_str (), "report", G_TYPE_STRING,
      report.c_str (), "shift-x", G_TYPE_DOUBLE, stance.shift_x, "shift-y",
      G_TYPE_DOUBLE, stance.shift_y, "stretch", G_TYPE_DOUBLE, stance.stretch,
      "psf-sigma", G_TYPE_DOUBLE, result.psf_sigma, "misfit", G_TYPE_DOUBLE,
      result.misfit, "good", G_TYPE_UINT64, pixels (PixelQuality::good),
      "uncovered", G_TYPE_UINT64, pixels (PixelQuality::uncovered),
      "low-contrast", G_TYPE_UINT64, pixels (PixelQuality::low_contrast),
      "saturated", G_TYPE_UINT64, pixels (PixelQuality::saturated), "outlier",
      G_TYPE_UINT64, pixels (PixelQuality::outlier), nullptr);
  add_correction (structure,
      correct_stage (result.mapping, settings_of (self).stage),
      result.mapping.stance_sigma ());
  post (self, structure);
}

} // namespace cexp::gst::moire
