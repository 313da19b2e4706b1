/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties of codedexposure-sim: settings and counters. */
#include "common/properties.h"
#include "sim.h"

#define GST_CAT_DEFAULT codedexposure_sim_debug

namespace codedexposure::gst::sim
{

namespace
{

Property<SimState>
text (const char *name, const char *nick, const char *blurb,
    std::string Settings::*place, const char *standard, GParamFlags flags)
{
  return setting (g_param_spec_string (name, nick, blurb, standard, flags),
      &SimState::settings, place);
}

template <typename... Path>
Property<SimState>
number (const char *name, const char *nick, const char *blurb, double min,
    double max, Path... path)
{
  const BenchOptions standard;
  return setting (g_param_spec_double (name, nick, blurb, min, max,
                      follow (standard, path...), kReadWrite),
      &SimState::settings, &Settings::optics, path...);
}

Property<SimState>
counter (const char *name, const char *nick, const char *blurb,
    guint64 Counters::*place)
{
  return reading<SimState> (
      g_param_spec_uint64 (name, nick, blurb, 0, G_MAXUINT64, 0, kReadOnly),
      [place] (const SimState &st) { return st.counters.*place; });
}

const PropertyTable<SimState> &
properties ()
{
  using Optics = BenchOptions;
  constexpr auto kAlignment = &Optics::alignment;
  static const PropertyTable<SimState> table = {
      text ("schedule", "Schedule",
          "Schedule of the coded exposure: a preset such as "
          "\"sequential:2x2\" or \"staircase:2x2,active=9.8ms\", or the path "
          "of a JSON file",
          &Settings::schedule, kDefaultSchedule, kReadWrite),
      text ("dmd", "DMD",
          "Simulated DMD, \"sim:NAME\", whose masks are looked through as a "
          "dmdsync with the same device shows them; its schedule wins over "
          "the property; empty: masks step with the frames",
          &Settings::dmd, "", kReadWriteReady),
      number ("psf-sigma", "PSF sigma",
          "Standard deviation of the lens's Gaussian blur in pixels; 0: none",
          0.0, Optics::kMaxPsfSigma, &Optics::psf_sigma),
      number ("full-well", "Full well",
          "Electrons that white makes in a pixel open in every slot, and the "
          "most it holds; gives shot noise; 0: no noise",
          0.0, Optics::kMaxFullWell, &Optics::full_well),
      number ("read-noise", "Read noise",
          "Noise of each reading in electrons rms; needs full-well", 0.0,
          Optics::kMaxReadNoise, &Optics::read_noise),
      setting (g_param_spec_int ("bits", "Bits",
                   "Significant bits of a pixel, counted from the lowest, for "
                   "example 12 for a 12-bit camera in GRAY16_LE; 0: all bits "
                   "of the format",
                   0, 16, Optics ().bits, kReadWrite),
          &SimState::settings, &Settings::optics, &Optics::bits),
      number ("gain", "Gain",
          "Factor on the light; at 1, white makes white in a pixel open in "
          "every slot; 0: white makes white in the pixels that are open "
          "longest",
          0.0, Optics::kMaxGain, &Optics::gain),
      setting (g_param_spec_uint64 ("seed", "Seed",
                   "Start of the noise: the same seed gives the same bytes", 0,
                   G_MAXUINT64, Optics ().seed, kReadWrite),
          &SimState::settings, &Settings::optics, &Optics::seed),
      number ("shift-x", "Horizontal shift",
          "Mirrors by which the camera looks to the right of where it should",
          -Optics::kMaxShift, Optics::kMaxShift, kAlignment,
          &Alignment::shift_x),
      number ("shift-y", "Vertical shift",
          "Mirrors by which the camera looks below where it should",
          -Optics::kMaxShift, Optics::kMaxShift, kAlignment,
          &Alignment::shift_y),
      number ("rotation", "Rotation",
          "Degrees by which the camera is turned clockwise against the "
          "mirrors, about the centre of the picture",
          -180.0, 180.0, kAlignment, &Alignment::rotation),
      number ("scale", "Scale",
          "Pixels that a mirror is wide in the camera's picture",
          Optics::kMinScale, Optics::kMaxScale, kAlignment, &Alignment::scale),
      counter ("frames-out", "Frames out",
          "Coded frames made since the stream started", &Counters::frames_out),
      counter ("frames-dropped", "Frames dropped",
          "Coded frames that were begun and not completed, because of a gap, "
          "a flush, new caps or the end of the stream; notifies",
          &Counters::frames_dropped),
  };
  return table;
}

void
set_property (GObject *object, guint id, const GValue *value, GParamSpec *pspec)
{
  auto *self = GST_CODED_EXPOSURE_SIM (object);
  if (g_str_equal (pspec->name, "schedule")) {
    const gchar *text = g_value_get_string (value);
    return set_schedule (self, text && *text ? text : kDefaultSchedule);
  }
  const ObjectLock lock (self);
  /* The DMD is looked up once, when the stream starts. */
  if (g_str_equal (pspec->name, "dmd") && GST_STATE (self) > GST_STATE_READY)
    GST_WARNING_OBJECT (self, "dmd is in force from the next start on");
  properties ().set (state (self), id, value);
}

} // namespace

void
set_schedule (GstCodedExposureSim *self, std::string text)
{
  auto parsed =
      std::make_shared<const Result<Schedule>> (Schedule::parse (text));
  if (!*parsed)
    GST_WARNING_OBJECT (self, "%s", parsed->error ().message.c_str ());
  const ObjectLock lock (self);
  state (self).settings.schedule = std::move (text);
  state (self).settings.parsed = std::move (parsed);
}

void
install_own_properties (GObjectClass *klass)
{
  install_properties<&properties, &state> (klass);
  klass->set_property = set_property;
}

} // namespace codedexposure::gst::sim
