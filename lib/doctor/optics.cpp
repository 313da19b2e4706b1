/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "optics": where each pixel looks, by Gray codes and gratings, and how
 * sharply. */
#include <algorithm>
#include <array>
#include <cmath>

#include "base/statistics.h"
#include "base/try.h"
#include "calibrate/calibration.h"
#include "doctor/blur_map.h"
#include "doctor/defects.h"
#include "doctor/lens_fit.h"
#include "doctor/stack.h"
#include "doctor/view.h"

namespace codedexposure
{

namespace
{

constexpr int kFrames = 2;  // of a pattern
constexpr int kPeriod = 12; // of the gratings, mirrors
/* Least error of a place of the gratings, mirrors. */
constexpr double kGratingError = 0.005;
constexpr double kCentred = 5.0; // mirrors
constexpr double kFaint = 0.15;  // modulation of gratings that are too blurred

/* Of the calibration: its fit needs some million pixels. */
int
row_step_of (Extent camera)
{
  constexpr double kPixels = 3e6;
  return std::max (
      1, int (std::ceil (double (camera.width) * camera.height / kPixels)));
}

class OpticsRun
{
public:
  explicit OpticsRun (Examination &examination)
      : examination_ (examination),
        mirrors_ (examination.rig.parts ().dmd.shown ())
  {
  }

  Result<Finding> run ()
  {
    RETURN_IF_ERROR (show_patterns ());
    auto solved = calibration_->solve ();
    if (solved)
      result_ = *std::move (solved);
    calibration_.reset (); // most of the memory
    defects_ = find_defects (
        stack_.dark, stack_.white, examination_.rig.parts ().largest ());
    if (result_) {
      measure_mapping ();
    } else if (const auto view = look_where (examination_, stack_.dark,
                   stack_.white, defects_.good.view ())) {
      view_ = *view; // roughly
    } else if (view.error ().code != ErrorCode::invalid_argument) {
      return view.error ();
    }
    measure_blur ();
    if (result_)
      diagnose_blur ();
    else
      diagnose_no_mapping (solved.error ());
    if (lens_)
      diagnose_pose ();
    report_share ();
    if (result_ && !finding_.is_ill ())
      finding_.judge ("mapping", {result_->gray_difference, 0.0});
    diagnose_dust ();
    finding_.sort ();
    if (examination_.exhibits)
      show_blur ();
    return std::move (finding_);
  }

private:
  Result<void> show_patterns ()
  {
    for (const Pattern &pattern : calibration_patterns (mirrors_, kPeriod)) {
      const StillMask mask = {.name = pattern.text (),
          .on = [pattern] (int x, int y) { return pattern.on (x, y); }};
      Image<float> mean;
      float frames = 0.0f;
      Result<void> kept;
      RETURN_IF_ERROR (look_for_whole_frames (
          examination_, mask, 1, kFrames, [&] (const SeenFrame &frame) {
            if (kept)
              kept = keep (pattern, frame);
            const Image<std::uint16_t> &picture = frame.picture;
            if (frames++ == 0.0f)
              mean = Image<float> (picture.width (), picture.height ());
            each_pixel (mean,
                [&] (int x, int y) { mean.at (x, y) += picture.at (x, y); });
          }));
      RETURN_IF_ERROR (kept);
      for (float &sum : mean.pixels ())
        sum /= frames;
      keep (pattern, std::move (mean));
    }
    return {};
  }

  Result<void> keep (const Pattern &pattern, const SeenFrame &frame)
  {
    const Image<std::uint16_t> &picture = frame.picture;
    if (!calibration_) {
      camera_ = {picture.width (), picture.height ()};
      stack_.step = thinning_of (camera_);
      const auto patterns = calibration_patterns (mirrors_, kPeriod);
      ASSIGN_OR_RETURN (calibration_, Calibration::make (camera_, mirrors_,
                                          patterns, row_step_of (camera_)));
    }
    return calibration_->add (
        pattern, picture.view (), examination_.rig.parts ().bits);
  }

  void keep (const Pattern &pattern, Image<float> mean)
  {
    using Kind = Pattern::Kind;
    if (pattern.kind == Kind::dark)
      stack_.dark = std::move (mean);
    else if (pattern.kind == Kind::white)
      stack_.white = std::move (mean);
    else if (pattern.kind == Kind::grating)
      (pattern.axis == Axis::x ? stack_.x : stack_.y)
          .push_back (thinned (mean, stack_.step));
  }

  /* Pose and distortion from the mapping, as a lens would have them. */
  void measure_mapping ()
  {
    constexpr int kGrid = 17;
    /* A displacement is less well known at the border. */
    const double margin = std::min (camera_.width, camera_.height) / 10.0;
    std::vector<PlacePair> pairs;
    for (int j = 0; j < kGrid; j++)
      for (int i = 0; i < kGrid; i++) {
        const Position at = {
            margin + (camera_.width - 1.0 - 2 * margin) * i / (kGrid - 1),
            margin + (camera_.height - 1.0 - 2 * margin) * j / (kGrid - 1)};
        const Position mirror = result_->mapping.mirror_at (at.x, at.y);
        if (result_->mapping.covers (mirror))
          pairs.push_back ({at, mirror});
      }
    lens_ = fit_lens (pairs, camera_, mirrors_, kGratingError);
    examination_.profile.mapping = result_->mapping;
    if (!lens_)
      return;
    finding_.readings.push_back ({"rotation", lens_->rotation, "degrees"});
    finding_.readings.push_back (
        {"magnification", lens_->magnification, "pixels a mirror"});
    finding_.readings.push_back ({"shift in x", lens_->shift_x, "mirrors"});
    finding_.readings.push_back ({"shift in y", lens_->shift_y, "mirrors"});
    finding_.add ("perspective in x", scaled (lens_->tilt_x, 100));
    finding_.add ("perspective in y", scaled (lens_->tilt_y, 100));
    finding_.add ("distortion", scaled (lens_->distortion, 100));
    finding_.add (
        "Gray codes against gratings", {result_->gray_difference, 0.0});
  }

  void measure_blur ()
  {
    const double magnification = lens_   ? lens_->magnification.value
                                 : view_ ? view_->pixels_per_mirror ()
                                         : 1.0;
    blur_ = map_blur (stack_, defects_.good.view (), magnification,
        result_ ? &result_->mapping : nullptr);
    focus_ = fit_focus (blur_, camera_);
    const double sigma = blur_.median ();
    examination_.profile.psf_sigma = {
        result_ ? result_->psf_sigma : sigma, 0.02};
    finding_.add ("blur", *examination_.profile.psf_sigma);
    if (!focus_)
      return;
    finding_.add ("growth of the blur over the frame", focus_->growth);
    if (focus_->growth.value > 3.0 * focus_->growth.sigma)
      finding_.readings.push_back (
          {"direction of the growth", focus_->direction, "degrees"});
  }

  /* Mean amplitude of the first harmonic of gratings, relative to the light. */
  double modulation () const
  {
    double low = 0.0, high = 0.0, light = 0.0;
    each_pixel (stack_.x[0], [&] (int x, int y) {
      const Offset at = {x * stack_.step, y * stack_.step};
      if (defects_.good.at (at.x, at.y) == 0)
        return;
      float least = stack_.x[0].at (x, y), most = least;
      for (const Image<float> &frame : stack_.x) {
        least = std::min (least, frame.at (x, y));
        most = std::max (most, frame.at (x, y));
      }
      low += double (least);
      high += double (most);
      light +=
          double (stack_.white.at (at.x, at.y) - stack_.dark.at (at.x, at.y));
    });
    return (high - low) / std::max (1.0, light);
  }

  void report_share ()
  {
    if (!result_)
      return;
    const Mapping &mapping = result_->mapping;
    double seen = 0.0, mirrors = 0.0;
    each_pixel (camera_, [&] (int x, int y) {
      seen += mapping.covers (mapping.mirror_at (x, y));
    });
    std::vector<Position> row (std::size_t (mirrors_.width));
    for (int y = 0; y < mirrors_.height; y++) {
      mapping.camera_row (y, row);
      mirrors += double (std::ranges::count_if (
          row, [&] (Position at) { return mapping.in_frame (at); }));
    }
    const Measured share{100 * seen / camera_.width / camera_.height, 0.0};
    finding_.add ("pixels that see a mirror", share);
    finding_.readings.push_back ({"mirrors that are seen",
        {100 * mirrors / (double (mirrors_.width) * mirrors_.height), 0.0},
        "%"});
    if (verdict_of ("shift", share) == Verdict::pass)
      return;
    const std::string blind =
        fixed (100 - share.value, 0) + " % of the pixels see no mirror";
    if (!lens_) {
      finding_.judge ("shift", share, blind);
      return;
    }
    const bool turned =
        std::lround (std::abs (lens_->rotation.value) / 90.0) % 2 != 0;
    double width = camera_.width / lens_->magnification.value;
    double height = camera_.height / lens_->magnification.value;
    if (turned)
      std::swap (width, height);
    const bool fits =
        width < 1.02 * mirrors_.width && height < 1.02 * mirrors_.height;
    const bool centred =
        std::hypot (lens_->shift_x.value, lens_->shift_y.value) < kCentred;
    if (fits && centred && finding_.is_ill ())
      return; // what was found explains it
    if (fits)
      finding_.judge ("shift", share,
          blind + ": the camera looks " + fixed (lens_->shift_x.value, 0) +
              " mirrors to the right of the centre of the array and " +
              fixed (lens_->shift_y.value, 0) + " below it");
    else
      finding_.blame ("field",
          "the camera sees " + fixed (width, 0) + " x " + fixed (height, 0) +
              " mirrors, more than the array has",
          Verdict::warn);
  }

  void diagnose_pose ()
  {
    Measured turn = lens_->rotation;
    turn.value -= 90.0 * std::round (turn.value / 90.0);
    finding_.judge ("rotation", turn);
    const double joined = 1.0 / lens_->magnification.value; // mirrors a pixel
    if (joined > 1.5 && std::abs (joined / std::round (joined) - 1.0) < 0.04)
      return finding_.blame (
          "binning", "a pixel sees " + fixed (joined, 2) +
                         " mirrors in x and in y, as it does where the camera "
                         "joins pixels "
                         "or leaves some out");
    const double target =
        std::max (1.0, std::round (lens_->magnification.value));
    Measured off = scaled (lens_->magnification, 100.0 / target);
    off.value -= 100.0;
    finding_.judge ("scale", off,
        "a mirror covers " + fixed (lens_->magnification.value, 3) +
            " pixels, where " + fixed (target, 0) + " is best");
    const double x = 100 * lens_->tilt_x.value, y = 100 * lens_->tilt_y.value;
    finding_.judge ("perspective",
        {std::hypot (x, y),
            100 * std::max (lens_->tilt_x.sigma, lens_->tilt_y.sigma)},
        "mirrors look " + fixed (2 * std::abs (x), 1) + " % smaller at the " +
            (x > 0 ? "right" : "left") + " border and " +
            fixed (2 * std::abs (y), 1) + " % at the " +
            (y > 0 ? "lower" : "upper") + " one than at the opposite ones");
    finding_.judge ("distortion", scaled (lens_->distortion, 100));
  }

  void diagnose_blur ()
  {
    if (focus_ &&
        finding_.judge ("focus-tilt", focus_->growth,
            "the blur grows by " + fixed (focus_->growth.value, 1) +
                " pixels over the frame, towards " +
                fixed (focus_->direction.value, 0) +
                " degrees (0: right, 90: down)") >= Verdict::warn &&
        verdict_of ("blur", {focus_->sharpest, 0.0}) == Verdict::pass)
      return;
    finding_.judge ("blur", {blur_.median (), 0.02});
  }

  /* A picture that is too bright or too blurred is a better reason than that of
   * the fit. */
  void diagnose_no_mapping (const Error &why)
  {
    const float largest = float (examination_.rig.parts ().largest ());
    const double full = double (std::ranges::count_if (stack_.white.pixels (),
        [&] (float light) { return light >= largest; }));
    const double part = full / camera_.width / camera_.height;
    if (part > 0.3)
      return finding_.blame ("bright", fixed (100 * part, 0) +
                                           " % of the pixels have the largest "
                                           "DN");
    if (modulation () < kFaint)
      return finding_.blame (
          "blur", "gratings of " + std::to_string (kPeriod) +
                      " mirrors vanish: the picture is out of focus");
    diagnose_blur ();
    if (!finding_.is_ill ())
      finding_.blame (
          "mapping", "the patterns give no mapping: " + why.message);
  }

  void diagnose_dust ()
  {
    double pixels = 0.0;
    std::vector<Position> places;
    for (const DefectSpot &spot : defects_.dust) {
      pixels += spot.pixels;
      places.push_back (spot.centre);
    }
    finding_.readings.push_back (
        {"spots of dust", {double (defects_.dust.size ()), 0.0}, ""});
    if (defects_.dust.empty ())
      return;
    finding_.notes.push_back ({"dust at the pixels", places_text (places)});
    const double part = pixels / (double (camera_.width) * camera_.height);
    finding_.judge ("dust", {100 * part, 0.0},
        std::to_string (defects_.dust.size ()) +
            (defects_.dust.size () == 1 ? " spot, " : " spots, ") +
            fixed (100 * part, 2) + " % of the picture, block light");
  }

  void show_blur ()
  {
    const double most = std::max (1.5, 2.0 * blur_.median ());
    Image<float> sigma (blur_.variance.width (), blur_.variance.height ());
    each_pixel (sigma, [&] (int x, int y) {
      sigma.at (x, y) = std::sqrt (std::max (0.0f, blur_.variance.at (x, y)));
    });
    const Image<std::uint8_t> small = picture_of (sigma, 0.0, most);
    Image<std::uint8_t> whole (camera_.width, camera_.height);
    each_pixel (whole, [&] (int x, int y) {
      whole.at (x, y) =
          small.at (std::min (x / blur_.block, small.width () - 1),
              std::min (y / blur_.block, small.height () - 1));
    });
    finding_.exhibits.push_back (
        {"Blur, white: " + fixed (most, 1) + " pixels", std::move (whole)});
  }

  Examination &examination_;
  Extent mirrors_, camera_;
  Finding finding_ = {"optics", "Gray codes and gratings in x and y"};
  GratingStack stack_;
  Defects defects_;
  std::optional<CoarseView> view_;
  std::optional<Calibration> calibration_;
  std::optional<CalibrationResult> result_;
  std::optional<LensFit> lens_;
  BlurMap blur_;
  std::optional<FocusTilt> focus_;
};

} // namespace

Result<Finding>
check_optics (Examination &examination)
{
  return or_no_frames (OpticsRun (examination).run (), "optics");
}

} // namespace codedexposure
