/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A bench in true time, with all its faults: light, mirrors, lens, camera. */
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "bench/exposure_light.h"
#include "bench/lens.h"
#include "bench/processing.h"
#include "bench/sick_options.h"
#include "mapping/mapping.h"
#include "setup/bench_profile.h"

namespace codedexposure
{

/** What the mirrors show again and again, with a trigger at the start of each
 * frame period. */
struct MirrorProgram {
  /** Mirrors that are on (not 0), of the whole array. */
  using Mask = std::shared_ptr<const Image<std::uint8_t>>;
  /** All mirrors are off outside stretches. */
  struct Stretch {
    Nanoseconds begin = 0, end = 0; ///< from the first trigger on
    std::size_t mask = 0;           ///< of `masks`
  };

  Nanoseconds period = 0; ///< of the trigger
  int periods = 1;        ///< after which it repeats itself
  std::vector<Mask> masks = {};
  std::vector<Stretch> stretches = {};
  Nanoseconds slot = 0; ///< by which a missed trigger is late

  /** What the beam of the mirrors that are off has of it. @p mirrors: of the
   * array. */
  MirrorProgram complement (Extent mirrors) const;
};

/** An exposure of the camera. */
struct Shot {
  std::uint64_t number = 0;
  Nanoseconds trigger = 0;
  Nanoseconds begin = 0, end = 0; ///< of the exposure
  bool lost = false;              ///< it does not arrive
};

/** What is true of a bench, as the doctor may measure it. */
struct BenchTruth {
  BenchProfile profile; ///< without uncertainties
  SickBenchOptions options;
  std::vector<Offset> hot, dead;           ///< pixels
  std::vector<Offset> stuck_on, stuck_off; ///< mirrors
  std::vector<Offset> dust;                ///< pixels
};

/**
 * Light, mirrors, lens, sensor and trigger of a bench; times are those of one
 * true clock, which begins at 0 and must not go back.
 *
 * The mirrors trigger the camera at the start of each period; SickBenchOptions
 * says what becomes of that.
 */
class SickBench
{
public:
  /** Fails where a number is out of its range. */
  static Result<SickBench> make (const SickBenchOptions &options);

  const BenchTruth &truth () const { return truth_; }

  /** The mirrors are parked until @p time and repeat @p program from then on.
   */
  void show (Nanoseconds time, MirrorProgram program);
  void park (Nanoseconds time);
  /** The exposure time of the shots that follow; none: the longest. */
  void expose (std::optional<Nanoseconds> time) { exposure_ = time; }

  /** The next exposure, if it is triggered before @p until. */
  std::optional<Shot> next (Nanoseconds until);
  /** The frame of one of the last exposures, of the camera's size. Everything
   * that is shown until its end must have been told. */
  void take (const Shot &shot, ImageView<std::uint16_t> picture);

private:
  struct Shown {
    Nanoseconds start = 0;
    Nanoseconds stop = std::numeric_limits<Nanoseconds>::max ();
    MirrorProgram program = {};
    enum class Kind { on, off, picture };
    std::vector<Kind> kinds = {}; // of its masks
  };
  /** Seconds of light that mirrors passed. */
  struct Passed {
    double on = 0.0; // all of them
    /* In the order in which they are shown, so that sums are always the same.
     */
    std::vector<std::pair<MirrorProgram::Mask, double>> pictures = {};

    void add (const MirrorProgram::Mask &mask, double light)
    {
      for (auto &[known, sum] : pictures)
        if (known == mask) {
          sum += light;
          return;
        }
      pictures.emplace_back (mask, light);
    }
  };
  struct HotPixel {
    Offset at;
    float light;
  };

  SickBench (const SickBenchOptions &options, Mapping mapping);
  void find_view ();
  void draw_defects ();
  void draw_groups ();
  Offset draw_pixel ();
  Offset draw_mirror ();
  void fill_profile ();
  void measure_field ();
  float passed_by (int x, int y, const std::vector<float> &dust) const;

  Nanoseconds delay () const;
  Nanoseconds longest () const;
  Nanoseconds exposed_time () const;
  std::optional<Nanoseconds> next_trigger (Nanoseconds until);
  const Shot &exposed_for (const Shot &shot) const;
  void add_light (const Shot &shot, const ExposureLight &exposure,
      const Shown &shown, Passed &passed) const;
  /** Rows of the frame that are exposed together. */
  struct Rows {
    int begin = 0, end = 0;
  };
  void collect (const Shot &shot);
  void collect_rows (const Shot &shot, const Rows &rows);
  const Image<float> &picture_of (const MirrorProgram::Mask &mask);
  void add_picture (
      const Image<float> &seen, float light, float part, const Rows &rows);
  void add_sum (const Passed &passed, double unit, const Rows &rows);
  void add_pictures (const Passed &passed, double unit, const Rows &rows);
  void read_out (const Shot &shot, ImageView<std::uint16_t> picture);

  Image<float> mirrors_of (const MirrorProgram::Mask &mask) const;
  void look (const Image<float> &mirrors, Image<float> &seen);

  SickBenchOptions options_;
  BenchTruth truth_;
  Mapping mapping_;
  Rect view_; // mirrors that the camera may see
  std::unique_ptr<Lens> lens_;
  LightOverTime light_over_time_;
  Processing processing_;

  std::deque<Shown> shown_;   // the last ones, in their order
  std::size_t at_ = 0;        // the one that triggers next
  std::int64_t triggers_ = 0; // of it, or of a camera that runs free
  std::uint64_t shots_ = 0;
  std::deque<Shot> past_; // for frames that are late
  std::optional<Nanoseconds> exposure_;

  /* Light on a pixel, in full wells, of a longest exposure: if all mirrors are
   * on or off; what leaks; and for the light from its mirrors. */
  Image<float> on_, off_, leaked_, field_;
  Image<float> light_;
  /* Pictures of the masks of the last frames. */
  struct Seen {
    MirrorProgram::Mask mask;
    Image<float> picture;
  };
  std::deque<Seen> seen_;
  std::vector<HotPixel> hot_;
  std::uint64_t places_ = 0; // that were drawn
};

} // namespace codedexposure
