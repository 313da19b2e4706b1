/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties of codedexposure-sim: settings and counters. */
#include "sim.h"

#define GST_CAT_DEFAULT codedexposure_sim_debug

namespace codedexposure::gst::sim
{

namespace
{

PropertyTable<SimState>
properties ()
{
  using Optics = BenchOptions;
  constexpr auto kAlignment = &Optics::alignment;
  static const auto optics = [] (auto... path) {
    return within (&SimState::settings, &Settings::optics, path...);
  };
  return {
      {"schedule", "Schedule",
          "Schedule of the coded exposure: a preset such as "
          "\"sequential:2x2\" or \"staircase:2x2,active=9.8ms\", or the path "
          "of a JSON file, or its text; empty: sequential:2x2",
          kReadWrite, within (&SimState::settings, &Settings::schedule)},
      {"dmd", "DMD",
          "Simulated DMD, \"sim:NAME\", whose masks are looked through as a "
          "dmdsync with the same device shows them; its schedule wins over "
          "the property; empty: masks step with the frames",
          kReadWriteReady, within (&SimState::settings, &Settings::dmd)},
      {"bench", "Bench profile",
          "Profile of a bench to simulate, a JSON file or its text "
          "(docs/formats.md): noise, black level, bits, gain, leakage, blur, "
          "mapping and trigger delay, for which other properties and the "
          "schedule win, with beam=off those of its second camera; the tag has "
          "it",
          kReadWriteReady, within (&SimState::settings, &Settings::bench)},
      {"beam", "Beam",
          "The mirrors whose light the camera gets: those that are on, or, as "
          "a second camera beside it, those that are off, which is the "
          "complement of every mask and the light between masks; needs an "
          "empty dmd",
          kReadWriteReady, within (&SimState::settings, &Settings::beam),
          gst_coded_exposure_beam_get_type ()},
      {"psf-sigma", "PSF sigma",
          "Standard deviation of the lens's Gaussian blur in pixels; 0: none; "
          "-1: that of the bench profile, or none",
          kReadWrite, optics (&Optics::psf_sigma), Optics::kUnset,
          Optics::kMaxPsfSigma},
      {"full-well", "Full well",
          "Electrons that white makes in a pixel open in every slot, and the "
          "most it holds; gives shot noise; 0: no noise; -1: by the bench "
          "profile, or no noise",
          kReadWrite, optics (&Optics::full_well), Optics::kUnset,
          Optics::kMaxFullWell},
      {"read-noise", "Read noise",
          "Noise of each reading in electrons rms; needs full-well; -1: that "
          "of the bench profile, or none",
          kReadWrite, optics (&Optics::read_noise), Optics::kUnset,
          Optics::kMaxReadNoise},
      {"bits", "Bits",
          "Significant bits of a pixel, counted from the lowest, for example "
          "12 for a 12-bit camera in GRAY16_LE; 0: those of the bench profile, "
          "or all bits of the format",
          kReadWrite, optics (&Optics::bits), 0, 16},
      {"gain", "Gain",
          "Factor on the light; at 1, white makes white in a pixel open in "
          "every slot; 0: by the bench profile, or such that white makes white "
          "in the pixels that are open longest",
          kReadWrite, optics (&Optics::gain), 0.0, Optics::kMaxGain},
      {"seed", "Seed", "Start of the noise: the same seed gives the same bytes",
          kReadWrite, optics (&Optics::seed), guint64 (0),
          guint64 (G_MAXINT64)},
      {"shift-x", "Horizontal shift",
          "Mirrors by which the camera looks to the right of where it should",
          kReadWrite, optics (kAlignment, &Alignment::shift_x),
          -Optics::kMaxShift, Optics::kMaxShift},
      {"shift-y", "Vertical shift",
          "Mirrors by which the camera looks below where it should", kReadWrite,
          optics (kAlignment, &Alignment::shift_y), -Optics::kMaxShift,
          Optics::kMaxShift},
      {"rotation", "Rotation",
          "Degrees by which the camera is turned clockwise against the "
          "mirrors, about the centre of the picture",
          kReadWrite, optics (kAlignment, &Alignment::rotation), -180.0, 180.0},
      {"scale", "Scale", "Pixels that a mirror is wide in the camera's picture",
          kReadWrite, optics (kAlignment, &Alignment::scale), Optics::kMinScale,
          Optics::kMaxScale},
      {"frames-out", "Frames out", "Coded frames made since the stream started",
          kReadOnly, within (&SimState::counters, &Counters::frames_out),
          guint64 (0), guint64 (G_MAXINT64)},
      {"frames-dropped", "Frames dropped",
          "Coded frames that were begun and not completed, because of a gap, "
          "a flush, new caps or the end of the stream; notifies",
          kReadOnly, within (&SimState::counters, &Counters::frames_dropped),
          guint64 (0), guint64 (G_MAXINT64)},
  };
}

} // namespace

void
install_own_state (gpointer klass)
{
  install_state<GstCodedExposureSim, properties,
      want_schedule<GstCodedExposureSim>> (klass);
}

} // namespace codedexposure::gst::sim
