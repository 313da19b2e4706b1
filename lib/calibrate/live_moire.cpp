/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/live_moire.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include "base/try.h"
#include "base/view_check.h"
#include "extract/saturation.h"

namespace codedexposure
{

namespace
{

using Phasor = std::complex<float>;
constexpr double kTwoPi = 2.0 * std::numbers::pi;

constexpr int kMinSampling = 3;
constexpr int kMaxSampling = 64;
constexpr int kMinPeriods = 8;

/* Blocks with less than this part of the reference amplitude show no grating.
 */
constexpr float kFaint = 0.4f;

/* Required correlation of neighbouring phasors. */
constexpr double kCoherent = 0.5;

double
sinc (double x)
{
  const double a = std::numbers::pi * x;
  return std::abs (a) < 1e-9 ? 1.0 : std::sin (a) / a;
}

/* cos and sin of 2 pi t / T, and both times t / T. Linear interpolation between
 * every T-th sample weights samples by a triangle: its rising side is t / T,
 * its falling side 1 - t / T. */
struct Carrier {
  int period;
  std::vector<float> cosine, sine, rising_cosine, rising_sine;

  explicit Carrier (int samples) : period (samples)
  {
    for (int t = 0; t < samples; t++) {
      const double angle = kTwoPi * t / samples;
      const double part = double (t) / samples;
      cosine.push_back (float (std::cos (angle)));
      sine.push_back (float (std::sin (angle)));
      rising_cosine.push_back (float (part * std::cos (angle)));
      rising_sine.push_back (float (part * std::sin (angle)));
    }
  }

  /* Of T values: without a weight, and with the rising side. */
  void demodulate (const float *values, std::size_t step, Phasor &whole,
      Phasor &rising) const
  {
    float wc = 0, ws = 0, rc = 0, rs = 0;
    for (std::size_t t = 0; t < std::size_t (period); t++) {
      const float value = values[t * step];
      wc += cosine[t] * value;
      ws += sine[t] * value;
      rc += rising_cosine[t] * value;
      rs += rising_sine[t] * value;
    }
    whole = {wc, -ws};
    rising = {rc, -rs};
  }

  /* Correction of variances for the pixels that neighbouring windows share. */
  double overlap () const
  {
    double squares = 0.0;
    for (int t = -period; t <= period; t++)
      squares += std::pow (1.0 - std::abs (double (t) / period), 2);
    return period / squares;
  }
};

/* Phasors of one grating, one per block of T x T pixels. */
struct Phasors {
  double first_x, first_y; // centre of the first one, pixels
  Image<Phasor> all;
  Fringes fringes = {Image<float> (all.width (), all.height ()),
      Image<float> (all.width (), all.height ())};
  float reference = 0.0f; // amplitude of blocks that show the grating
  double power = 0.0;

  bool is_seen (Phasor z) const
  {
    return std::norm (z) > kFaint * kFaint * reference * reference;
  }

  /* Sum of the products of each phasor with the one @lag_x, @lag_y further. */
  std::complex<double> product (int lag_x, int lag_y) const
  {
    std::complex<double> sum = 0.0;
    for (int r = 0; r + lag_y < all.height (); r++) {
      const Phasor *here = all.view ().row (r);
      const Phasor *there = all.view ().row (r + lag_y) + lag_x;
      float re = 0.0f, im = 0.0f;
      for (int c = 0; c + lag_x < all.width (); c++) {
        re += here[c].real () * there[c].real () +
              here[c].imag () * there[c].imag ();
        im += here[c].real () * there[c].imag () -
              here[c].imag () * there[c].real ();
      }
      sum += std::complex<double> (re, im);
    }
    return sum;
  }

  /* Radians from block to block, from longer and longer baselines. */
  double slope (bool along_y) const
  {
    double slope = 0.0;
    const int length = along_y ? all.height () : all.width ();
    for (int lag = 1; lag <= length / 2; lag *= 4) {
      const auto sum = along_y ? product (0, lag) : product (lag, 0);
      slope += std::arg (sum * std::polar (1.0, -lag * slope)) / lag;
    }
    return slope;
  }
};

/* phase = a xi + b eta + c, in coordinates relative to the frame's centre. */
struct Plane {
  Eigen::Vector3d at = Eigen::Vector3d::Zero ();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero ();
};

/* Sums over the blocks of a row: xi, and the residuals of the phases. */
struct RowSums {
  double n = 0, x = 0, xx = 0, rest = 0, rest_x = 0, squares = 0;

  void add (double xi, double residual)
  {
    n += 1;
    x += xi;
    xx += xi * xi;
    rest += residual;
    rest_x += residual * xi;
    squares += residual * residual;
  }
};

/* Normal equations of a plane's numbers. */
struct PlaneSums {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero ();
  Eigen::Vector3d right = Eigen::Vector3d::Zero ();
  double squares = 0.0;

  void add (const RowSums &row, double eta)
  {
    const double cross = row.x * eta, y = row.n * eta;
    normal += Eigen::Matrix3d{
        {row.xx, cross, row.x}, {cross, y * eta, y}, {row.x, y, row.n}};
    right += Eigen::Vector3d{row.rest_x, row.rest * eta, row.rest};
    squares += row.squares;
  }
  double variance () const { return squares / normal (2, 2); }

  /* None if the blocks do not determine a plane. */
  std::optional<Plane> solve () const
  {
    constexpr double kMinPivot = 1e-12;
    const Eigen::LDLT<Eigen::Matrix3d> factor (normal);
    const Eigen::Vector3d pivots = factor.vectorD ();
    if (!(pivots.minCoeff () > kMinPivot * pivots.maxCoeff ()))
      return std::nullopt;
    return Plane{
        factor.solve (right), factor.solve (Eigen::Matrix3d::Identity ())};
  }
};

/* Sine of the phase of @z after a rotation by @back; beyond 90 degrees, 1. */
double
rest_of (Phasor z, Phasor back)
{
  const Phasor left = {z.real () * back.real () - z.imag () * back.imag (),
      z.real () * back.imag () + z.imag () * back.real ()};
  return left.real () > 0.0f
             ? double (left.imag () / std::sqrt (std::norm (left)))
             : std::copysign (1.0, double (left.imag ()));
}

} // namespace

struct LiveMoire::State {
  State (const Mapping &where, const LiveMoireOptions &how, int samples)
      : expected (where), options (how), carrier (samples),
        blocks_x (where.camera ().width / samples),
        blocks_y (where.camera ().height / samples),
        x (Phasors{
            double (samples), 0.5 * (samples - 1), {blocks_x - 1, blocks_y}}),
        y (Phasors{
            0.5 * (samples - 1), double (samples), {blocks_x, blocks_y - 1}}),
        columns (std::size_t (blocks_x * samples)), row_sums (columns),
        rising (std::size_t (blocks_x))
  {
    sorted.reserve (std::size_t (blocks_x * blocks_y));
  }

  Mapping expected;
  LiveMoireOptions options;
  Carrier carrier;
  int blocks_x, blocks_y;
  Phasors x, y;
  double sum = 0.0;            // of the numbers in whole blocks
  std::vector<float> columns;  // sums over the rows of a block
  std::vector<float> row_sums; // of a block's T rows, T by T
  std::vector<Phasor> rising;
  std::vector<float> sorted;

  /* Phasors of the whole frame, T rows at a time. */
  template <typename Pixel>
  void collect (ImageView<const Pixel> frame)
  {
    const int samples = carrier.period;
    const int width = blocks_x * samples;
    sum = 0.0;
    for (int r = 0; r < blocks_y; r++) {
      std::fill (columns.begin (), columns.end (), 0.0f);
      for (int t = 0; t < samples; t++) {
        const Pixel *row = frame.row (r * samples + t);
        float *sums = row_sums.data () + std::ptrdiff_t (t) * blocks_x;
        for (int i = 0; i < width; i++)
          columns[std::size_t (i)] += float (row[i]);
        for (int c = 0; c < blocks_x; c++) {
          std::uint32_t total = 0;
          for (int i = 0; i < samples; i++)
            total += row[c * samples + i];
          sums[c] = float (total);
        }
      }
      for (int c = 0; c < width; c++)
        sum += double (columns[std::size_t (c)]);
      demodulate_x (r);
      demodulate_y (r);
    }
  }

  void demodulate_x (int block_row)
  {
    Phasor *out = x.all.view ().row (block_row);
    Phasor before = 0.0f;
    for (int c = 0; c < blocks_x; c++) {
      Phasor whole, rise;
      carrier.demodulate (columns.data () + c * carrier.period, 1, whole, rise);
      if (c > 0)
        out[c - 1] = before + whole - rise;
      before = rise;
    }
  }

  void demodulate_y (int block_row)
  {
    for (int c = 0; c < blocks_x; c++) {
      Phasor whole, rise;
      carrier.demodulate (
          row_sums.data () + c, std::size_t (blocks_x), whole, rise);
      if (block_row > 0)
        y.all.at (c, block_row - 1) = rising[std::size_t (c)] + whole - rise;
      rising[std::size_t (c)] = rise;
    }
  }

  /* Fills the maps of phase and amplitude; error if there is no grating. */
  Result<void> find_grating (Phasors &phasors, const char *name)
  {
    const float to_amplitude = 2.0f / float (carrier.period * carrier.period);
    phasors.power = 0.0;
    sorted.clear ();
    each_pixel (phasors.all, [&] (int c, int r) {
      const Phasor z = phasors.all.at (c, r);
      const float norm = std::norm (z);
      const float size = std::sqrt (norm);
      phasors.power += double (norm);
      phasors.fringes.phase.at (c, r) = std::atan2 (z.imag (), z.real ());
      phasors.fringes.amplitude.at (c, r) = to_amplitude * size;
      sorted.push_back (size);
    });
    const auto high =
        sorted.begin () + std::ptrdiff_t (sorted.size () * 9 / 10);
    std::nth_element (sorted.begin (), high, sorted.end ());
    phasors.reference = *high;

    const double common =
        std::abs (phasors.product (1, 0)) + std::abs (phasors.product (0, 1));
    if (phasors.power > 0.0 && common > 2.0 * kCoherent * phasors.power)
      return {};
    return Error{std::string ("no grating is seen in ") + name +
                 ": show a grating with a period of " +
                 std::to_string (options.period) +
                 " mirrors, focus on the mirrors, and bring magnification and "
                 "rotation close to the expected ones"};
  }

  Plane start (const Phasors &phasors, double sign, bool along_y) const
  {
    const auto [cx, cy, r] = CentredFrame (expected.camera ());
    double slope_x = phasors.slope (false), slope_y = phasors.slope (true);
    const double step = carrier.period;

    std::complex<double> mean = 0.0;
    each_pixel (phasors.all, [&] (int i, int j) {
      mean += std::complex<double> (phasors.all.at (i, j)) *
              std::polar (1.0, -(slope_x * i + slope_y * j));
    });
    const double origin = std::arg (mean) -
                          slope_x * (phasors.first_x - cx) / step -
                          slope_y * (phasors.first_y - cy) / step;
    /* One period of the carrier per block is invisible in the phasors. */
    (along_y ? slope_y : slope_x) += kTwoPi;
    Plane plane;
    plane.at = Eigen::Vector3d{sign * slope_x / step * r,
        sign * slope_y / step * r,
        sign * (origin +
                   kTwoPi *
                       (along_y ? cy - phasors.first_y : cx - phasors.first_x) /
                       step)};
    return plane;
  }

  Result<Plane> fit (const Phasors &phasors, double sign, bool along_y) const
  {
    Plane plane = start (phasors, sign, along_y);
    /* The limit shrinks, so that blocks at the edge of the array are left out.
     */
    double variance = 1.0;
    for (int round = 0; round < 4 && variance >= 0.0; round++)
      variance = refine (phasors, plane, sign, 3.0 * std::sqrt (variance));
    if (!(variance >= 0.0))
      return Error{"the grating is seen in too small a part of the frame"};
    plane.covariance *= variance * carrier.overlap ();
    return plane;
  }

  /* One round of least squares on the residuals of @plane below @limit; returns
   * their variance, or -1 where they do not determine a plane. */
  double refine (
      const Phasors &phasors, Plane &plane, double sign, double limit) const
  {
    const auto [cx, cy, r] = CentredFrame (expected.camera ());
    const double step = carrier.period / r;
    const double xi0 = (phasors.first_x - cx) / r;
    const Phasor rotation (std::polar (1.0, -sign * plane.at[0] * step));
    PlaneSums sums;
    for (int j = 0; j < phasors.all.height (); j++) {
      const double eta = (phasors.first_y - cy) / r + j * step;
      Phasor back (std::polar (
          1.0, -sign * (plane.at[0] * xi0 + plane.at[1] * eta + plane.at[2])));
      RowSums row;
      for (int i = 0; i < phasors.all.width (); i++, back *= rotation) {
        const Phasor z = phasors.all.at (i, j);
        const double rest = rest_of (z, back);
        if (phasors.is_seen (z) && std::abs (rest) <= limit)
          row.add (xi0 + i * step, rest);
      }
      sums.add (row, eta);
    }
    const auto change = sums.solve ();
    if (!change)
      return -1.0;
    plane.at += sign * change->at;
    plane.covariance = change->covariance;
    return sums.variance ();
  }

  /* The mapping from the phases of both gratings. */
  Result<Mapping> combine (const Plane &px, const Plane &py) const
  {
    const double to_mirrors = options.period / kTwoPi;
    /* Mirror of phase 0: the middle of those that are bright. */
    const double origin = 0.5 * (options.period / 2 - 1) +
                          (options.off_beam ? options.period / 2 : 0);
    const Homography known = expected.centred ();
    Homography h = {0, 0, 0, 0, 0, 0, 0, 0, 1};
    Mapping::Covariance covariance = {};
    Eigen::Map<
        Eigen::Matrix<double, Mapping::kParameters, Mapping::kParameters>>
        all (covariance.data ());
    const Plane *planes[] = {&px, &py};
    for (Eigen::Index d = 0; d < 2; d++) {
      Eigen::Map<Eigen::Vector3d> (h.data () + 3 * d) =
          to_mirrors * planes[d]->at;
      const Eigen::Matrix3d &noise = planes[d]->covariance;
      all.block<3, 3> (3 * d, 3 * d) =
          to_mirrors * to_mirrors / 2.0 * (noise + noise.transpose ());
      const auto at = std::size_t (3 * d + 2);
      h[at] += origin;
      h[at] +=
          options.period * std::round ((known[at] - h[at]) / options.period);
    }
    ASSIGN_OR_RETURN (const Mapping mapping,
        Mapping::from_centred (expected.camera (), expected.mirrors (), h));
    return Mapping::make ({expected.camera (), expected.mirrors (),
        mapping.homography (), covariance});
  }

  template <typename Pixel>
  Result<LiveReading> solve (ImageView<const Pixel> frame)
  {
    const Extent camera = expected.camera ();
    RETURN_IF_ERROR (check_view (
        ViewBytes::of (frame), "frame", camera.width, camera.height));
    collect (frame);
    for (const auto &[phasors, name] :
        {std::pair (&x, "x"), std::pair (&y, "y")})
      RETURN_IF_ERROR (find_grating (*phasors, name));

    const Homography known = expected.centred ();
    ASSIGN_OR_RETURN (
        const Plane plane_x, fit (x, known[0] < 0.0 ? -1.0 : 1.0, false));
    ASSIGN_OR_RETURN (
        const Plane plane_y, fit (y, known[4] < 0.0 ? -1.0 : 1.0, true));
    ASSIGN_OR_RETURN (Mapping mapping, combine (plane_x, plane_y));

    LiveReading reading = {std::move (mapping), {}, 0.0, 0};
    const double pixels =
        double (blocks_x) * blocks_y * carrier.period * carrier.period;
    const double largest =
        sum / pixels * 4.0 / std::numbers::pi * sinc (1.0 / carrier.period);
    const double to_contrast =
        2.0 / (carrier.period * carrier.period * std::max (1e-9, largest));
    reading.contrast = {
        to_contrast * double (x.reference), to_contrast * double (y.reference)};
    std::size_t seen = 0, all = 0;
    for (const Phasors *phasors : {&x, &y})
      for (const Phasor z : phasors->all.pixels ()) {
        seen += phasors->is_seen (z);
        all++;
      }
    reading.coverage = double (seen) / double (all);
    reading.saturated = count_saturated (frame, options.bits);
    return reading;
  }
};

Result<LiveMoire>
LiveMoire::make (const Mapping &expected, const LiveMoireOptions &options)
try {
  const Pose pose = expected.pose ();
  const double pixels = options.period * pose.magnification;
  const int samples = int (std::lround (pixels));
  if (options.period < 2 || options.period % 2 != 0)
    return Error{"the period of the live grating is " +
                 std::to_string (options.period) +
                 " mirrors; it must be even and 2 or more"};
  if (samples < kMinSampling || samples > kMaxSampling)
    return Error{"a period of the live grating has " +
                 std::to_string (samples) + " pixels; it must have " +
                 std::to_string (kMinSampling) + " to " +
                 std::to_string (kMaxSampling) + ", use another period"};
  const Extent camera = expected.camera ();
  if (std::min (camera.width, camera.height) < kMinPeriods * samples)
    return Error{"a frame of " + size_text (camera) +
                 " pixels holds less than " + std::to_string (kMinPeriods) +
                 " periods of the live grating"};
  return LiveMoire (std::make_shared<State> (expected, options, samples));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<LiveReading>
LiveMoire::solve (ImageView<const std::uint8_t> frame)
{
  return state_->solve (frame);
}

Result<LiveReading>
LiveMoire::solve (ImageView<const std::uint16_t> frame)
{
  return state_->solve (frame);
}

FringePair
LiveMoire::fringes () const
{
  return {state_->x.fringes, state_->y.fringes};
}

} // namespace codedexposure
