/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The element messages of the plugin; docs/streams.md describes them for users.
 * post_message () sends one, parse_message () reads it. Times are in ns, on the
 * clock of the PTS. */
#pragma once

#include "structure.h"

namespace codedexposure::gst
{

/** Coded frames never arrived. Posted once, by the element that finds it:
 * dmdsync, codedexposure-recorddemux for what the recording says, else a filter
 * of coded frames. */
struct FramesLost {
  static constexpr const char *kName = "codedexposure/frames-lost";
  guint64 count = 0;
  GstClockTime from = 0; ///< when the first of them was due
  GstClockTime to = 0;   ///< of the frame that came instead
  CODED_FIELDS (count, from, to);
};

/** A sequence of saturated frames begins or ends. */
struct Saturated {
  static constexpr const char *kName = "codedexposure/saturated";
  bool active = false;                ///< it begins
  std::optional<guint64> frame = {};  ///< at the beginning: its number
  std::optional<guint64> frames = {}; ///< at the end: how many there were
  GstClockTime from = 0;
  std::optional<GstClockTime> to = {}; ///< at the end
  /** Saturated pixels of the first frame; at the end, of the worst. */
  guint64 pixels = 0;
  CODED_FIELDS (active, frame, frames, from, to, pixels);
};

/** Coded frames begin or cease to go on without partners, from
 * codedexposure-pair. */
struct PartnerLost {
  static constexpr const char *kName = "codedexposure/partner-lost";
  bool active = false; ///< it begins
  /** Of the first: "missing", "damaged", one of the two, "other-schedule", as
   * the streams say, or "other-exposure", by the pixels. */
  std::string reason;
  std::optional<guint64> frames = {}; ///< at the end: how many there were
  GstClockTime from = 0;
  /** At the end: of the first that has a partner again; at the end of the
   * stream, of the last without. */
  std::optional<GstClockTime> to = {};
  CODED_FIELDS (active, reason, frames, from, to);
};

/** The second camera begins or ceases to see the mirrors where its mapping does
 * not have them, from codedexposure-pair. */
struct PartnerDrifted {
  static constexpr const char *kName = "codedexposure/partner-drift";
  bool active = false; ///< it begins
  /* Where that is worst, mirrors; as PartnerDrift::Shift. */
  gdouble x = 0, y = 0;
  gdouble uncertainty = 0;
  gdouble at_x = 0, at_y = 0;
  GstClockTime from = 0; ///< PTS of the frame that shows it
  CODED_FIELDS (active, x, y, uncertainty, at_x, at_y, from);
};

/** The last frames have become a recording, from codedexposure-keep. */
struct Kept {
  static constexpr const char *kName = "codedexposure/kept";
  std::string location = {};
  guint64 frames = 0;
  GstClockTime duration = 0;    ///< from the first frame to the last
  std::optional<guint64> frame; ///< number of the first
  CODED_FIELDS (location, frames, duration, frame);
};

/** Frames have changed suddenly, from codedexposure-keep. */
struct EventFound {
  static constexpr const char *kName = "codedexposure/event";
  std::string kind; ///< "mean" or "motion"
  std::optional<guint64> frame;
  GstClockTime time = 0;
  double jump = 0;        ///< part of the largest pixel value
  GstClockTime after = 0; ///< for which it is followed before it is kept
  CODED_FIELDS (kind, frame, time, jump, after);
};

/** Coded frames give way to frames of a pattern, which are not decoded. */
struct NotCoded {
  static constexpr const char *kName = "codedexposure/not-coded";
  std::string pattern; ///< as in the frame meta
  guint64 frame = 0;   ///< the first that shows it
  GstClockTime from = 0;
  CODED_FIELDS (pattern, frame, from);
};

/** How well the camera sees the mirrors, in numbers of mirrors. */
struct MirrorsSeen {
  static constexpr const char *kName = "codedexposure/mapping";
  guint64 exact = 0;    ///< one pixel sees the mirror, and nothing else
  guint64 weighted = 0; ///< estimated from pixels that see neighbours, too
  guint64 mixed = 0;    ///< of these, no pixel gets half of its light from it
  guint64 unseen = 0;   ///< no pixel sees the mirror; black
  CODED_FIELDS (exact, weighted, mixed, unseen);
};

/* From dmdsync; its numbers of frames count the lost ones, too. */
struct FrameDropped {
  static constexpr const char *kName = "dmdsync/frame-dropped";
  guint64 frame = 0;
  GstClockTime pts = 0;
  std::string reason;
  CODED_FIELDS (frame, pts, reason);
};
struct AtFrame {
  guint64 frame = 0;
  GstClockTime pts = 0;
  CODED_FIELDS (frame, pts);
};
struct FrameLate : AtFrame {
  static constexpr const char *kName = "dmdsync/frame-late";
};
struct FrameIncomplete {
  static constexpr const char *kName = "dmdsync/frame-incomplete";
  guint64 frame = 0;
  GstClockTime pts = 0;
  guint64 bytes = 0; ///< that came
  CODED_FIELDS (frame, pts, bytes);
};

/** The first frame that is known to be synchronised, of all or since a slip. */
struct Locked : AtFrame {
  static constexpr const char *kName = "dmdsync/locked";
};

/** Frames are no longer flagged after a slip: the DMD was restarted. */
struct SlipOver : AtFrame {
  static constexpr const char *kName = "dmdsync/slip-over";
};

/** The DMD slipped against the camera. */
struct Slip {
  static constexpr const char *kName = "dmdsync/slip";
  guint64 frame = 0;    ///< the first that is out of step
  gint slots = 0;       ///< by which it slipped
  bool certain = false; ///< no other number of slots explains the frames
  GstClockTime pts = 0; ///< of the frame at which this was found
  CODED_FIELDS (frame, slots, certain, pts);
};

/** Whether the time of frames is known has changed. */
struct TimeUncertainty {
  static constexpr const char *kName = "dmdsync/time-uncertainty";
  bool known = false;
  GstClockTime uncertainty = 0;
  guint64 frame = 0;
  GstClockTime pts = 0;
  CODED_FIELDS (known, uncertainty, frame, pts);
};

/** Frames come at another rate than the caps say. */
struct MeasuredRate {
  static constexpr const char *kName = "dmdsync/frame-rate";
  gdouble measured = 0; ///< frames/s
  FrameRate caps;
  CODED_FIELDS (measured, caps);
};

/** The first frame that shows a pattern. */
struct PatternShown {
  static constexpr const char *kName = "dmdsync/pattern-shown";
  std::string pattern;
  guint64 frame = 0;
  GstClockTime pts = 0;
  CODED_FIELDS (pattern, frame, pts);
};
/** The mirrors show the schedule again. */
struct PatternOver {
  static constexpr const char *kName = "dmdsync/pattern-over";
  std::string pattern, reason;
  CODED_FIELDS (pattern, reason);
};

/** codedexposure-camerasrc: the camera is gone, and is restarted. */
struct CameraLost {
  static constexpr const char *kName = "codedexposure/camera-lost";
  std::string reason;
  CODED_FIELDS (reason);
};
struct CameraBack {
  static constexpr const char *kName = "codedexposure/camera-back";
  GstClockTime silent = 0; ///< without frames
  guint tries = 0;
  CODED_FIELDS (silent, tries);
};

/** codedexposure-recorddemux: frames are not as they were recorded, or cannot
 * be compared; they are CORRUPTED. Posted when a sequence of them begins, and
 * when it is over. */
struct FramesDamaged {
  static constexpr const char *kName = "codedexposure/frames-damaged";
  bool active = false;               ///< it begins
  std::optional<guint64> frame = {}; ///< the first of them; none: not known
  std::optional<guint64> count = {}; ///< at the end: how many there were
  GstClockTime from = 0;
  std::string reason = {}; ///< of the first
  CODED_FIELDS (active, frame, count, from, reason);
};
/** codedexposure-recorddemux: the recording knows of frames that did not come.
 */
struct FramesMissing {
  static constexpr const char *kName = "codedexposure/frames-missing";
  guint64 count = 0;
  GstClockTime from = 0; ///< of the first of them
  CODED_FIELDS (count, from);
};
/** codedexposure-recorddemux: the stream ended without the last line of its
 * track: a recording that was cut off, or a sender that was killed. */
struct StreamCut {
  static constexpr const char *kName = "codedexposure/stream-cut";
  guint64 frames = 0; ///< that came
  CODED_FIELDS (frames);
};
/** codedexposure-recorddemux: the last line of the track counts more frames
 * than came and were missed: the beginning is missing, or parts with their
 * lines. */
struct StreamIncomplete {
  static constexpr const char *kName = "codedexposure/stream-incomplete";
  guint64 count = 0;
  CODED_FIELDS (count);
};

/** codedexposure-sim: an exposure that got too few input frames. */
struct ExposureDropped {
  static constexpr const char *kName = "codedexposure/frame-dropped";
  std::string reason;
  GstClockTime pts = 0;
  gint inputs = 0, needed = 0; ///< input frames
  guint64 frames_dropped = 0;  ///< since the start
  CODED_FIELDS (reason, pts, inputs, needed, frames_dropped);
};

/** The stage travel that moirecalib recommends, with standard deviations. */
struct StageMove {
  gdouble offset_x = 0, offset_y = 0; ///< from the aligned position, mirrors
  gdouble rotation = 0;               ///< degrees
  gdouble magnification = 1;          ///< pixels a mirror
  gdouble deviation = 0;              ///< largest distance of a corner, mirrors
  gdouble stage_x = 0, stage_y = 0;   ///< µm
  gdouble stage_theta = 0;            ///< thousandths of a degree
  gdouble magnify = 0;                ///< thousandths
  gdouble sigma_x = 0, sigma_y = 0, sigma_rotation = 0;
  gdouble sigma_magnification = 0; ///< standard deviations
  CODED_FIELDS (offset_x, offset_y, rotation, magnification, deviation, stage_x,
      stage_y, stage_theta, magnify, sigma_x, sigma_y, sigma_rotation,
      sigma_magnification);
};

/** moirecalib has come to another stage. */
struct MoireState {
  static constexpr const char *kName = "moirecalib/state";
  std::string state, before;
  CODED_FIELDS (state, before);
};

/** A frame of the live grating was read. */
struct MoireReading {
  static constexpr const char *kName = "moirecalib/reading";
  StageMove move;
  guint64 frame = 0;
  GstClockTime pts = 0;
  std::string state;
  gdouble contrast_x = 0, contrast_y = 0; ///< 1: as sharp as can be
  gdouble coverage = 0; ///< part of the frame that shows the grating
  guint64 saturated = 0;
  CODED_FIELDS (
      frame, pts, state, contrast_x, contrast_y, coverage, saturated, move);
};

/** The phase of the tile was found. */
struct MoirePhase {
  static constexpr const char *kName = "moirecalib/phase";
  guint64 frame = 0;
  GstClockTime pts = 0;
  gint phase_x = 0, phase_y = 0;
  gdouble confidence = 0;
  gdouble contrast = 0;
  std::string schedule; ///< with this phase
  CODED_FIELDS (frame, pts, phase_x, phase_y, confidence, contrast, schedule);
};

/** The mapping was found. */
struct MoireMapping {
  static constexpr const char *kName = "moirecalib/mapping";
  StageMove move;
  std::string mapping;          ///< JSON
  std::string location, report; ///< files that were written; empty: none
  gdouble shift_x = 0, shift_y = 0, stretch = 0;
  gdouble psf_sigma = 0; ///< pixels
  gdouble misfit = 0;
  guint64 good = 0, uncovered = 0, low_contrast = 0, saturated = 0;
  guint64 outlier = 0; ///< numbers of pixels
  CODED_FIELDS (mapping, location, report, shift_x, shift_y, stretch, psf_sigma,
      misfit, good, uncovered, low_contrast, saturated, outlier, move);
};

/** That of a second camera, in the other beam. */
struct MoireSecondMapping {
  static constexpr const char *kName = "moirecalib/second-mapping";
  MoireMapping of;
  CODED_FIELDS (of);
};

} // namespace codedexposure::gst
