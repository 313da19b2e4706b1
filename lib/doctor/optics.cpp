/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "optics": where each pixel looks, by gratings and by a chessboard, and
 * how sharply. */
#include <algorithm>
#include <array>
#include <cmath>

#include "base/text.h"
#include "base/try.h"
#include "calibrate/calibration.h"
#include "doctor/blur_map.h"
#include "doctor/chessboard.h"
#include "doctor/defects.h"
#include "doctor/lens_fit.h"
#include "doctor/stack.h"
#include "doctor/view.h"

namespace codedexposure
{

namespace
{

constexpr int kFrames = 2; // of a pattern
constexpr int kBoardFrames = 4;
constexpr int kPeriod = 12; // of the gratings, mirrors
/* Least error of a place of the gratings and of the chessboard, mirrors. */
constexpr double kGratingError = 0.005, kCornerError = 0.02;
constexpr double kAgree = 0.1; // rms difference of both, mirrors

/* Where warnings begin, and failures. */
struct Rule {
  double warn, fail;
};
constexpr Rule kRotation = {0.8, 1.5};      // degrees
constexpr Rule kScale = {0.02, 0.04};       // part
constexpr Rule kTilt = {0.006, 0.012};      // part
constexpr Rule kDistortion = {0.005, 0.01}; // part
constexpr Rule kBlur = {0.95, 1.4};         // pixels
constexpr Rule kGrowth = {0.6, 1.2};        // pixels
constexpr Rule kUncovered = {0.03, 0.1};    // part of the pixels
constexpr double kCentred = 5.0;            // mirrors
constexpr double kDustFail = 0.01;          // part of the pixels
constexpr double kFaint = 0.15; // modulation of gratings that are too blurred

std::optional<Verdict>
verdict_of (double value, double sigma, const Rule &rule)
{
  if (!(std::abs (value) - 2.0 * sigma > rule.warn))
    return std::nullopt;
  return std::abs (value) > rule.fail ? Verdict::fail : Verdict::warn;
}

class OpticsRun
{
public:
  explicit OpticsRun (Examination &examination)
      : examination_ (examination),
        mirrors_ (examination.rig.parts ().dmd.shown ())
  {
  }

  Result<Finding> run ();

private:
  Result<void> show_patterns ();
  Result<void> keep (
      const Pattern &pattern, const std::vector<SeenFrame> &frames);
  Result<void> see_chessboard ();
  std::vector<PlacePair> pairs_of (
      const Chessboard &board, const std::vector<Position> &corners) const;
  void compare (const std::vector<PlacePair> &pairs);
  void measure_mapping ();
  void measure_blur ();
  double modulation () const;
  void report_pose (const LensFit &lens, const std::string &how);
  void report_share ();
  void diagnose_pose ();
  void diagnose_blur ();
  void diagnose_no_mapping (const Error &why);
  void diagnose_dust ();
  void diagnose (const char *id, Verdict severity, const std::string &cause,
      const std::string &remedy)
  {
    finding_.diagnoses.push_back ({id, severity, cause, remedy});
  }
  void show_blur ();

  Examination &examination_;
  Extent mirrors_, camera_;
  Finding finding_ = {
      "optics", "Gray codes and gratings in x and y, and a chessboard"};
  GratingStack stack_;
  Defects defects_;
  std::optional<CoarseView> view_;
  std::optional<Calibration> calibration_;
  std::optional<CalibrationResult> result_;
  std::optional<LensFit> lens_;
  std::optional<double> disagreement_; // of chessboard and gratings, mirrors
  BlurMap blur_;
  std::optional<FocusTilt> focus_;
};

/* Adds the frames of a pattern to what needs them. */
Result<void>
OpticsRun::keep (const Pattern &pattern, const std::vector<SeenFrame> &frames)
{
  Image<float> mean;
  int count = 0;
  for (const SeenFrame &frame : frames) {
    const Image<std::uint16_t> &picture = frame.picture;
    if (!calibration_) {
      camera_ = {picture.width (), picture.height ()};
      const auto patterns = calibration_patterns (mirrors_, kPeriod);
      ASSIGN_OR_RETURN (
          calibration_, Calibration::make (camera_, mirrors_, patterns));
    }
    RETURN_IF_ERROR (calibration_->add (
        pattern, picture.view (), examination_.rig.parts ().bits));
    if (count++ == 0)
      mean = Image<float> (camera_.width, camera_.height);
    for (int y = 0; y < camera_.height; y++)
      for (int x = 0; x < camera_.width; x++)
        mean.at (x, y) += float (picture.at (x, y));
  }
  for (int y = 0; y < camera_.height; y++)
    for (int x = 0; x < camera_.width; x++)
      mean.at (x, y) /= float (count);
  using Kind = Pattern::Kind;
  if (pattern.kind == Kind::dark)
    stack_.dark = std::move (mean);
  else if (pattern.kind == Kind::white)
    stack_.white = std::move (mean);
  else if (pattern.kind == Kind::grating)
    (pattern.axis == Axis::x ? stack_.x : stack_.y)
        .push_back (std::move (mean));
  return {};
}

Result<void>
OpticsRun::show_patterns ()
{
  for (const Pattern &pattern : calibration_patterns (mirrors_, kPeriod)) {
    const StillMask mask = {.name = pattern.text (),
        .on = [pattern] (int x, int y) { return pattern.on (x, y); }};
    ASSIGN_OR_RETURN (const auto frames,
        look_for_whole_frames (examination_, mask, 1, kFrames));
    RETURN_IF_ERROR (keep (pattern, frames));
  }
  defects_ =
      find_defects (stack_.dark, stack_.white, largest_number (examination_));
  return {};
}

/* The corners in the order of the board: OpenCV may begin at any of its
 * corners and go either way. */
std::vector<PlacePair>
OpticsRun::pairs_of (
    const Chessboard &board, const std::vector<Position> &corners) const
{
  const int columns = board.columns - 1, rows = board.rows - 1;
  std::vector<PlacePair> best;
  double least = 0.0;
  for (const bool turned_x : {false, true})
    for (const bool turned_y : {false, true}) {
      std::vector<PlacePair> pairs;
      double squares = 0.0;
      for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++) {
          const Position seen =
              corners[std::size_t (j) * std::size_t (columns) +
                      std::size_t (i)];
          const Position mirror = board.corner (
              turned_x ? columns - 1 - i : i, turned_y ? rows - 1 - j : j);
          const Position at = view_->camera_at (mirror);
          squares += std::pow (at.x - seen.x, 2) + std::pow (at.y - seen.y, 2);
          pairs.push_back ({seen, mirror});
        }
      if (best.empty () || squares < least) {
        least = squares;
        best = std::move (pairs);
      }
    }
  return best;
}

/* One frame, of a board that fills most of what the camera sees. */
Result<void>
OpticsRun::see_chessboard ()
{
  const auto note = [this] (const std::string &text) {
    finding_.notes.push_back ({"chessboard", text});
    return Result<void> ();
  };
  if (!has_chessboard ())
    return note (find_corners ({}, 0, 0).error ().message);
  const auto view = look_where (
      examination_, stack_.dark, stack_.white, defects_.good.view ());
  if (!view && view.error ().code != ErrorCode::invalid_argument)
    return view.error ();
  if (!view)
    return note (view.error ().message);
  view_ = *view;
  Chessboard board;
  if (view->orientation ().turned % 180 != 0)
    std::swap (board.columns, board.rows);
  const Extent seen = board.columns > board.rows
                          ? camera_
                          : Extent{camera_.height, camera_.width};
  const double side = std::min (
      seen.width / (board.columns + 2.5), seen.height / (board.rows + 2.5));
  board.square = std::max (4, int (side / view->pixels_per_mirror ()));
  const Position centre =
      view->mirror_at ({0.5 * (camera_.width - 1), 0.5 * (camera_.height - 1)});
  board.first = {int (centre.x) - board.square * board.columns / 2,
      int (centre.y) - board.square * board.rows / 2};
  ASSIGN_OR_RETURN (const Stack stack,
      look_at_light (examination_, board.mask (), 1, kBoardFrames));
  Image<float> light (camera_.width, camera_.height);
  for (int y = 0; y < camera_.height; y++)
    for (int x = 0; x < camera_.width; x++)
      light.at (x, y) =
          (stack.mean.at (x, y) - stack_.dark.at (x, y)) /
          std::max (1.0f, stack_.white.at (x, y) - stack_.dark.at (x, y));
  const Image<std::uint8_t> picture = picture_of (light, -0.1, 1.1);
  if (examination_.exhibits)
    finding_.exhibits.push_back ({"Chessboard", picture});
  auto corners =
      find_corners (std::as_const (picture).view (), board.columns, board.rows);
  if (!corners)
    return note (corners.error ().message);
  for (Position &corner : *corners)
    corner = refine_corner (
        light, corner, board.square * view->pixels_per_mirror ());
  compare (without_outliers (pairs_of (board, *corners), 0.5));
  return {};
}

void
OpticsRun::compare (const std::vector<PlacePair> &pairs)
{
  const auto lens = fit_lens (pairs, camera_, mirrors_, kCornerError);
  if (!lens) {
    finding_.notes.push_back (
        {"chessboard", "its corners do not determine a mapping"});
    return;
  }
  report_pose (*lens, ", chessboard");
  if (!result_) {
    lens_ = lens;
    return;
  }
  double squares = 0.0;
  for (const PlacePair &pair : pairs) {
    const Position at = result_->mapping.mirror_at (pair.pixel.x, pair.pixel.y);
    squares += 0.5 * (std::pow (pair.mirror.x - at.x, 2) +
                         std::pow (pair.mirror.y - at.y, 2));
  }
  const double apart = std::sqrt (squares / double (pairs.size ()));
  const double sigma = std::max (lens->rms, kCornerError) /
                       std::sqrt (2.0 * double (pairs.size ()));
  finding_.readings.push_back ({"chessboard against gratings", {apart, sigma},
      "mirrors", "at most " + real_text (kAgree)});
  if (apart - 3.0 * sigma > kAgree)
    disagreement_ = apart;
}

void
OpticsRun::report_pose (const LensFit &lens, const std::string &how)
{
  finding_.readings.push_back ({"rotation" + how, lens.rotation, "degrees"});
  finding_.readings.push_back (
      {"magnification" + how, lens.magnification, "pixels a mirror"});
  finding_.readings.push_back ({"shift in x" + how, lens.shift_x, "mirrors"});
  finding_.readings.push_back ({"shift in y" + how, lens.shift_y, "mirrors"});
}

/* Pose and distortion from the mapping, as a lens would have them. */
void
OpticsRun::measure_mapping ()
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
  report_pose (*lens_, "");
  finding_.readings.push_back ({"perspective in x",
      {100 * lens_->tilt_x.value, 100 * lens_->tilt_x.sigma}, "%",
      "at most " + real_text (100 * kTilt.warn)});
  finding_.readings.push_back ({"perspective in y",
      {100 * lens_->tilt_y.value, 100 * lens_->tilt_y.sigma}, "%",
      "at most " + real_text (100 * kTilt.warn)});
  finding_.readings.push_back ({"distortion",
      {100 * lens_->distortion.value, 100 * lens_->distortion.sigma}, "%",
      "at most " + real_text (100 * kDistortion.warn)});
}

/* Mean amplitude of the first harmonic of gratings, relative to the light. */
double
OpticsRun::modulation () const
{
  double low = 0.0, high = 0.0, light = 0.0;
  for (int y = 0; y < camera_.height; y += 2)
    for (int x = 0; x < camera_.width; x += 2) {
      if (defects_.good.at (x, y) == 0)
        continue;
      float least = stack_.x[0].at (x, y), most = least;
      for (const Image<float> &frame : stack_.x) {
        least = std::min (least, frame.at (x, y));
        most = std::max (most, frame.at (x, y));
      }
      low += double (least);
      high += double (most);
      light += double (stack_.white.at (x, y) - stack_.dark.at (x, y));
    }
  return (high - low) / std::max (1.0, light);
}

void
OpticsRun::measure_blur ()
{
  const double magnification = lens_   ? lens_->magnification.value
                               : view_ ? view_->pixels_per_mirror ()
                                       : 1.0;
  blur_ = map_blur (stack_, defects_.good.view (), magnification,
      result_ ? &result_->mapping : nullptr);
  focus_ = fit_focus (blur_, camera_);
  const double sigma = blur_.median ();
  examination_.profile.psf_sigma = {result_ ? result_->psf_sigma : sigma, 0.02};
  finding_.readings.push_back ({"blur", *examination_.profile.psf_sigma,
      "pixels", "at most " + real_text (kBlur.warn)});
  if (!focus_)
    return;
  finding_.readings.push_back ({"growth of the blur over the frame",
      focus_->growth, "pixels", "at most " + real_text (kGrowth.warn)});
  if (focus_->growth.value > 3.0 * focus_->growth.sigma)
    finding_.readings.push_back (
        {"direction of the growth", focus_->direction, "degrees"});
}

void
OpticsRun::report_share ()
{
  if (!result_)
    return;
  const Mapping &mapping = result_->mapping;
  double seen = 0.0, mirrors = 0.0;
  for (int y = 0; y < camera_.height; y++)
    for (int x = 0; x < camera_.width; x++)
      seen += mapping.covers (mapping.mirror_at (x, y));
  std::vector<Position> row (std::size_t (mirrors_.width));
  for (int y = 0; y < mirrors_.height; y++) {
    mapping.camera_row (y, row);
    mirrors += double (std::ranges::count_if (row, [&] (const Position &at) {
      return at.x > -0.5 && at.y > -0.5 && at.x < camera_.width - 0.5 &&
             at.y < camera_.height - 0.5;
    }));
  }
  const double pixels = double (camera_.width) * camera_.height;
  const double share = seen / pixels;
  finding_.readings.push_back ({"pixels that see a mirror", {100 * share, 0.0},
      "%", "at least " + real_text (100 * (1 - kUncovered.warn))});
  finding_.readings.push_back ({"mirrors that are seen",
      {100 * mirrors / (double (mirrors_.width) * mirrors_.height), 0.0}, "%"});
  const auto verdict = verdict_of (1.0 - share, 0.0, kUncovered);
  if (!verdict)
    return;
  const std::string blind =
      fixed (100 * (1 - share), 0) + " % of the pixels see no mirror";
  const std::string centre =
      "move the camera until its centre looks at that of the array";
  if (!lens_)
    return diagnose ("shift", *verdict, blind, centre);
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
  if (fits && centred && !finding_.diagnoses.empty ())
    return; // what was found explains it
  if (fits)
    diagnose ("shift", *verdict,
        blind + ": the camera looks " + fixed (lens_->shift_x.value, 0) +
            " mirrors to the right of the centre of the array and " +
            fixed (lens_->shift_y.value, 0) + " below it",
        centre);
  else
    diagnose ("field", Verdict::warn,
        "the camera sees " + fixed (width, 0) + " x " + fixed (height, 0) +
            " mirrors, more than the array has",
        "set the region of the camera to where mirrors are seen");
}

void
OpticsRun::diagnose_pose ()
{
  const double turn =
      lens_->rotation.value - 90.0 * std::round (lens_->rotation.value / 90.0);
  if (const auto verdict = verdict_of (turn, lens_->rotation.sigma, kRotation))
    diagnose ("rotation", *verdict,
        "the camera is rotated against the mirrors by " + fixed (turn, 2) +
            " degrees",
        "rotate it back; gst-launch with moirecalib or pipelines/calibrate "
        "show it live");
  const double target = std::max (1.0, std::round (lens_->magnification.value));
  const double off = lens_->magnification.value / target - 1.0;
  if (const auto verdict =
          verdict_of (off, lens_->magnification.sigma / target, kScale))
    diagnose ("scale", *verdict,
        "a mirror covers " + fixed (lens_->magnification.value, 3) +
            " pixels, where " + fixed (target, 0) + " is best",
        off > 0 ? "move the lens away from the camera, or towards the mirrors' "
                  "side that makes the picture smaller, and focus again"
                : "change the distance of lens and camera until the picture is "
                  "that much larger, and focus again");
  const double tilt = std::hypot (lens_->tilt_x.value, lens_->tilt_y.value);
  const double tilt_sigma = std::max (lens_->tilt_x.sigma, lens_->tilt_y.sigma);
  if (const auto verdict = verdict_of (tilt, tilt_sigma, kTilt))
    diagnose ("perspective", *verdict,
        "mirrors look " + fixed (200 * std::abs (lens_->tilt_x.value), 1) +
            " % smaller at the " +
            (lens_->tilt_x.value > 0 ? "right" : "left") + " border and " +
            fixed (200 * std::abs (lens_->tilt_y.value), 1) + " % at the " +
            (lens_->tilt_y.value > 0 ? "lower" : "upper") +
            " one than at the opposite ones",
        "tilt the camera about the vertical and the horizontal axis until "
        "opposite borders look the same");
  if (const auto verdict = verdict_of (
          lens_->distortion.value, lens_->distortion.sigma, kDistortion))
    diagnose ("distortion", *verdict,
        "the lens shifts the corners by " +
            fixed (100 * lens_->distortion.value, 2) +
            " % of their distance from the centre",
        "use a lens with less distortion, or decode with the mapping, which "
        "has it");
}

void
OpticsRun::diagnose_blur ()
{
  const double blur = blur_.median ();
  const auto uneven =
      focus_ ? verdict_of (focus_->growth.value, focus_->growth.sigma, kGrowth)
             : std::nullopt;
  if (uneven) {
    diagnose ("focus-tilt", *uneven,
        "the blur grows by " + fixed (focus_->growth.value, 1) +
            " pixels over the frame, towards " +
            fixed (focus_->direction.value, 0) +
            " degrees (0: right, 90: down)",
        "tilt the camera (or the relay lens) so that this side comes closer; "
        "if the blur grows, tilt it the other way: one picture does not tell "
        "which side of the focus it is");
    if (focus_->sharpest < kBlur.warn)
      return;
  }
  if (const auto verdict = verdict_of (blur, 0.02, kBlur))
    diagnose ("blur", *verdict,
        "mirrors are blurred by " + fixed (blur, 2) +
            " pixels (standard deviation)",
        "focus the lens on the mirrors; open and close its aperture to see "
        "whether it is the lens");
}

/* A picture that is too bright or too blurred is a better reason than that of
 * the fit. */
void
OpticsRun::diagnose_no_mapping (const Error &why)
{
  const float largest = float (largest_number (examination_));
  double full = 0.0;
  for (int y = 0; y < camera_.height; y++)
    for (int x = 0; x < camera_.width; x++)
      full += stack_.white.at (x, y) >= largest;
  const double pixels = double (camera_.width) * camera_.height;
  if (full > 0.3 * pixels)
    return diagnose ("bright", Verdict::fail,
        fixed (100 * full / pixels, 0) + " % of the pixels have the largest "
                                         "DN",
        "reduce the light");
  if (modulation () < kFaint)
    return diagnose ("blur", Verdict::fail,
        "gratings of " + std::to_string (kPeriod) +
            " mirrors vanish: the picture is out of focus",
        "focus the lens on the mirrors");
  diagnose_blur ();
  if (finding_.diagnoses.empty ())
    diagnose ("mapping", Verdict::fail,
        "the patterns give no mapping: " + why.message,
        "align the camera with pipelines/calibrate");
}

void
OpticsRun::diagnose_dust ()
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
  diagnose ("dust", part > kDustFail ? Verdict::fail : Verdict::warn,
      std::to_string (defects_.dust.size ()) +
          (defects_.dust.size () == 1 ? " spot, " : " spots, ") +
          fixed (100 * part, 2) + " % of the picture, block light",
      "blow dust off the window of the DMD, the lens and the sensor");
}

void
OpticsRun::show_blur ()
{
  const double most = std::max (1.5, 2.0 * blur_.median ());
  Image<float> sigma (blur_.variance.width (), blur_.variance.height ());
  for (int y = 0; y < sigma.height (); y++)
    for (int x = 0; x < sigma.width (); x++)
      sigma.at (x, y) = std::sqrt (std::max (0.0f, blur_.variance.at (x, y)));
  const Image<std::uint8_t> small = picture_of (sigma, 0.0, most);
  Image<std::uint8_t> whole (camera_.width, camera_.height);
  for (int y = 0; y < camera_.height; y++)
    for (int x = 0; x < camera_.width; x++)
      whole.at (x, y) =
          small.at (std::min (x / blur_.block, small.width () - 1),
              std::min (y / blur_.block, small.height () - 1));
  finding_.exhibits.push_back (
      {"Blur, white: " + fixed (most, 1) + " pixels", std::move (whole)});
}

Result<Finding>
OpticsRun::run ()
{
  RETURN_IF_ERROR (show_patterns ());
  auto solved = calibration_->solve ();
  if (solved)
    result_ = *std::move (solved);
  if (result_)
    measure_mapping ();
  RETURN_IF_ERROR (see_chessboard ());
  measure_blur ();
  if (result_)
    diagnose_blur ();
  else
    diagnose_no_mapping (solved.error ());
  if (lens_)
    diagnose_pose ();
  report_share ();
  if (disagreement_ && finding_.diagnoses.empty ())
    diagnose ("mapping", Verdict::warn,
        "the chessboard and the gratings differ by " +
            fixed (*disagreement_, 2) + " mirrors",
        "see that nothing moves, and run this check again");
  diagnose_dust ();
  std::ranges::stable_sort (
      finding_.diagnoses, std::greater<> (), &Diagnosis::severity);
  if (examination_.exhibits)
    show_blur ();
  return std::move (finding_);
}

} // namespace

Result<Finding>
check_optics (Examination &examination)
{
  return or_no_frames (OpticsRun (examination).run (), "optics");
}

} // namespace codedexposure
