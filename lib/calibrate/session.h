/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One run of a calibration, frame by frame. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "calibrate/calibration.h"
#include "calibrate/fringes.h"
#include "calibrate/gratings.h"
#include "calibrate/live_moire.h"
#include "calibrate/stage.h"
#include "calibrate/tile_phase.h"
#include "schedule/schedule.h"

namespace codedexposure
{

/**
 * Takes the frames of a run, in any of three ways: align () reads fringes until
 * the bench is aligned, collect () and solve () find the mapping, find_phase ()
 * finds the phase of a tile without patterns.
 *
 * Pixel is std::uint8_t or std::uint16_t, of frames of the camera's size.
 */
class CalibrationSession
{
public:
  /** A phase with this probability is accepted. */
  static constexpr double kSure = 0.999;

  struct Options {
    Extent camera;
    Extent mirrors;
    int bits = 0; ///< significant ones of a pixel; 0: all of its type
    std::vector<Pattern> patterns = {};    ///< of the mapping
    std::optional<Schedule> schedule = {}; ///< whose phase is sought
    /** The camera is in the beam of the mirrors that are off, and sees the
     * complement of every mask. */
    bool off_beam = false;
  };
  explicit CalibrationSession (Options options) : options_ (std::move (options))
  {
  }

  /** Which grating align () will see, and at which magnification. Error when
   * its fringes cannot be read. */
  Result<void> expect (const Pattern &grating, double pixels_per_mirror);

  struct Alignment {
    LiveReading reading;
    StageCorrection correction;
  };
  /** Reads a frame of the grating. None where no grating was expected;
   * error when none is seen. */
  template <typename Pixel>
  Result<std::optional<Alignment>> align (
      ImageView<const Pixel> frame, const StageOptions &stage);
  /** Alignments in a row, up to the last frame, that were within tolerance. */
  int aligned () const { return aligned_; }
  /** Fringes of the first and the last frame in which a grating was seen; no
   * last ones while none is seen. */
  const std::optional<FringePair> &first_fringes () const { return first_; }
  const std::optional<FringePair> &last_fringes () const { return last_; }

  /** Adds a frame of @p pattern, which is one of the patterns of the run. After
   * an error, the run has failed. */
  template <typename Pixel>
  Result<void> collect (const Pattern &pattern, ImageView<const Pixel> frame);
  int collected () const { return collected_; } ///< frames
  /** The mapping from all frames; once. None where none was collected. */
  Result<std::optional<CalibrationResult>> solve ();

  /** A tile's phase, and the schedule that has it. */
  struct Phase {
    TilePhase tile;
    Schedule schedule;
  };
  /** None while no frame reaches kSure; confidence () is the largest so far. */
  template <typename Pixel>
  Result<std::optional<Phase>> find_phase (ImageView<const Pixel> frame);
  double confidence () const { return confidence_; }

private:
  Options options_;
  std::optional<LiveMoire> live_;
  std::optional<Calibration> calibration_;
  std::optional<FringePair> first_, last_;
  int aligned_ = 0;
  int collected_ = 0;
  double confidence_ = 0.0;
};

/** An alignment in lines of text. */
std::vector<std::string> alignment_lines (
    const CalibrationSession::Alignment &alignment);
/** How far each axis of the stage is to travel. */
std::string travel_line (const StageCorrection &correction);
/** A mapping in lines of text, briefly and in full; @p correction is of its
 * mapping.
 */
std::vector<std::string> mapping_lines (
    const CalibrationResult &result, const StageCorrection &correction);
std::vector<std::string> report_lines (
    const CalibrationResult &result, const StageCorrection &correction);
/** Whether the camera is aligned to @p tolerance mirrors, and what to do
 * otherwise: one line. */
std::string alignment_verdict (
    const StageCorrection &correction, double tolerance);

} // namespace codedexposure
