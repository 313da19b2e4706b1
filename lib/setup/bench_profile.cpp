/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "setup/json.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/file.h"
#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

constexpr double kLongest = double (kTimeLimit);

constexpr BenchQuantity kQuantities[] = {
    {&BenchProfile::conversion_gain, "conversion_gain", "conversion gain",
        " e-/DN", 1e-6, 1e6},
    {&BenchProfile::full_well, "full_well", "full well", " e-", 1.0, 1e7},
    {&BenchProfile::read_noise, "read_noise", "read noise", " e-", 0.0, 1e5},
    {&BenchProfile::black_level, "black_level", "black level", " DN", 0.0,
        65534.0},
    {&BenchProfile::linearity_error, "linearity_error", "linearity error", "",
        0.0, 1.0},
    {&BenchProfile::leak, "leak", "leak", "", 0.0, Schedule::kMaxLeak},
    {&BenchProfile::trigger_delay, "trigger_delay_ns", "trigger delay", " ns",
        -kLongest, kLongest},
    {&BenchProfile::exposure, "exposure_ns", "exposure", " ns", 1.0, kLongest},
    {&BenchProfile::psf_sigma, "psf_sigma", "psf_sigma", " pixels", 0.0,
        Mapping::kMaxPsfSigma},
    {&BenchProfile::light_ratio, "light_ratio", "light ratio", "", 1e-6, 1e6},
};

Result<void>
check_numbers (const BenchProfile &profile)
{
  for (const auto &[member, key, name, unit, low, high] : kQuantities) {
    const auto &number = profile.*member;
    if (!number)
      continue;
    const auto outside = [after = unit] (const std::string &of, double value,
                             double from, double to) {
      return Error{of + " of " + real_text (value) + after + " is outside of " +
                   real_text (from) + " to " + real_text (to) + after +
                   "; leave out what was not measured"};
    };
    if (!(number->value >= low && number->value <= high))
      return outside (std::string ("the ") + name, number->value, low, high);
    if (!(number->sigma >= 0.0 &&
            number->sigma <= std::numeric_limits<double>::max ()))
      return outside (std::string ("the sigma of the ") + name, number->sigma,
          0.0, std::numeric_limits<double>::max ());
  }
  return {};
}

Result<void>
check_named (const std::string &what, const BenchProfile::Device &device)
{
  for (const std::string *name :
      {&device.vendor, &device.model, &device.serial})
    if (printable (*name, BenchProfile::kMaxName) != *name)
      return Error{"a name of the " + what + ", " + in_quotes (*name) +
                   ", is not one line of at most " +
                   std::to_string (BenchProfile::kMaxName) + " bytes"};
  const auto [width, height] = device.size;
  if (std::min (width, height) < 1 ||
      std::max (width, height) > Mapping::kMaxSize)
    return Error{"a " + what + " of " + size_text (device.size) +
                 " is none; sides are 1 to " +
                 std::to_string (Mapping::kMaxSize)};
  return {};
}

} // namespace

std::span<const BenchQuantity>
bench_quantities ()
{
  return kQuantities;
}

Result<void>
BenchProfile::check () const
{
  using namespace std::chrono;
  const year_month_day day (floor<days> (measured));
  if (int (day.year ()) < 0 || int (day.year ()) > 9999)
    return Error{"the time of the measurement is in the year " +
                 std::to_string (int (day.year ())) +
                 "; it must be in 0 to 9999"};
  RETURN_IF_ERROR (check_named ("camera", camera));
  if (dmd)
    RETURN_IF_ERROR (check_named ("DMD", *dmd));
  if (printable (pixel_format, kMaxName) != pixel_format)
    return Error{"the pixel format " + in_quotes (pixel_format) +
                 " is no name, such as Mono12"};
  if (bits < 1 || bits > 16)
    return Error{std::to_string (bits) + " bits of a pixel are not 1 to 16"};
  RETURN_IF_ERROR (check_numbers (*this));
  if (black () >= largest ())
    return Error{"a black level of " + real_text (black_level->value) +
                 " DN leaves nothing of the " + std::to_string (bits) +
                 " bits; measure it without light"};
  if (mapping && !(mapping->camera () == camera.size))
    return Error{"the mapping is for frames of " +
                 size_text (mapping->camera ()) + " pixels, but the camera " +
                 "has " + size_text (camera.size) + "; measure a new mapping"};
  if (light_ratio && !second.empty ())
    return Error{
        "a light ratio belongs to the second camera, not to the first; "
        "move it there"};
  for (const BenchProfile &other : second) {
    if (!other.second.empty ())
      return Error{
          "the second camera of a profile has no second one itself; leave "
          "it out"};
    RETURN_IF_ERROR (with_prefix (other.check (), "second camera: "));
    if (mapping && other.mapping &&
        !(mapping->mirrors () == other.mapping->mirrors ()))
      return Error{
          "the mappings of both cameras are to " +
          size_text (mapping->mirrors ()) + " and " +
          size_text (other.mapping->mirrors ()) +
          " mirrors, but they look at the same ones; measure both again"};
  }
  return {};
}

BenchProfile
BenchProfile::of_beam (bool off_beam) const
{
  BenchProfile one = off_beam && !second.empty () ? second.front () : *this;
  one.second.clear ();
  return one;
}

std::optional<Mapping>
BenchProfile::known_mapping () const
{
  if (mapping || !psf_sigma)
    return mapping;
  Mapping::Parts aligned{camera.size, camera.size};
  aligned.psf_sigma = psf_sigma->value;
  const auto made = Mapping::make (aligned);
  return made ? std::optional (*made) : std::nullopt;
}

Result<void>
BenchProfile::save (const std::string &path) const
try {
  RETURN_IF_ERROR (check ());
  return with_prefix (
      write_file (path, to_json () + '\n'), "the bench profile ");
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

std::vector<std::pair<std::string, std::string>>
BenchProfile::rows () const
{
  const auto device = [] (const Device &of) {
    std::string text;
    for (const std::string *name : {&of.vendor, &of.model, &of.serial})
      if (!name->empty ())
        text += (text.empty () ? "" : " ") + *name;
    return text.empty () ? "not known" : text;
  };
  std::vector<std::pair<std::string, std::string>> rows = {
      {"camera", device (camera)}, {"size", size_text (camera.size)},
      {"bits", std::to_string (bits)}};
  if (!pixel_format.empty ())
    rows.emplace_back ("pixel format", pixel_format);
  if (dmd) {
    rows.emplace_back ("DMD", device (*dmd));
    rows.emplace_back ("mirrors", size_text (dmd->size));
  }
  for (const auto &[member, key, name, unit, low, high] : kQuantities)
    if (const auto &number = this->*member)
      rows.emplace_back (name,
          real_text (number->value) + " ± " + real_text (number->sigma) + unit);
  rows.emplace_back ("mapping",
      mapping ? size_text (mapping->mirrors ()) + " mirrors" : "not measured");
  for (const BenchProfile &other : second)
    for (auto &[name, text] : other.rows ())
      rows.emplace_back ("second camera: " + name, std::move (text));
  return rows;
}

/* --------------------------------------------------------- what follows -- */

std::optional<double>
BenchProfile::electrons_per_number () const
{
  if (conversion_gain)
    return conversion_gain->value;
  if (full_well)
    return full_well->value / (largest () - black ());
  return std::nullopt;
}

int
BenchProfile::black () const
{
  return black_level ? int (std::lround (black_level->value)) : 0;
}

Result<Schedule>
BenchProfile::with_leak (const Schedule &schedule) const
{
  return leak && schedule.leak () == 0.0 ? schedule.with_leak (leak->value)
                                         : schedule;
}

/* ------------------------------------------------ whose profile it is -- */

Result<void>
BenchProfile::check_frames (Extent size, int frame_bits) const
{
  const std::string remedy =
      "; use the bench profile of this camera, or measure the bench again";
  if (!(size == camera.size))
    return Error{"the frames have " + size_text (size) +
                 " pixels, but the camera of the bench profile has " +
                 size_text (camera.size) + remedy};
  if (frame_bits != 0 && frame_bits != bits)
    return Error{"the frames have " + std::to_string (frame_bits) +
                 " bits, but those of the bench profile have " +
                 std::to_string (bits) + remedy};
  return {};
}

Result<void>
BenchProfile::check_device (
    const std::string &what, const Device &profiled, const Device &found)
{
  if (profiled.serial.empty () || found.serial.empty () ||
      profiled.serial == found.serial)
    return {};
  return Error{"the bench profile is of the " + what + " with the serial " +
               "number " + in_quotes (profiled.serial) + ", but this is " +
               in_quotes (found.serial) + "; use the bench profile of this " +
               what + ", or measure the bench again"};
}

Result<void>
BenchProfile::check_bench (const BenchProfile &other) const
{
  RETURN_IF_ERROR (check_device ("camera", camera, other.camera));
  return dmd && other.dmd ? check_device ("DMD", *dmd, *other.dmd)
                          : Result<void> ();
}

std::optional<std::string>
BenchProfile::why_doubtful (std::chrono::sys_seconds now) const
{
  const auto age = std::chrono::floor<std::chrono::days> (now - measured);
  if (age < -std::chrono::days (1)) // clocks may be set to local time
    return "The bench profile was measured " + std::to_string (-age.count ()) +
           " days after now, by the clock of this machine; set the clock, or "
           "measure the bench again.";
  if (age <= kMaxAge)
    return std::nullopt;
  return "The bench profile was measured " + std::to_string (age.count ()) +
         " days ago. After " + std::to_string (kMaxAge.count ()) +
         " days it may no longer be that of the bench; measure the bench "
         "again.";
}

} // namespace codedexposure
