/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-moirecalib
 * @title: moirecalib
 * @short_description: Aligns the camera with the mirrors and measures the
 * mapping between them
 *
 * moirecalib requests gratings from a dmdsync upstream and measures the pose of
 * the camera against the mirrors from their moiré fringes (paper, Section 2.3).
 *
 * First it shows one grating and draws the fringes in x and y, the numbers, and
 * the correction of the camera's stage over frames that show a pattern.
 * #moirecalib:state goes from `searching` over `coarse` and `fine` to
 * `aligned`, where every pixel is within #moirecalib:tolerance mirrors of its
 * place. Then, or at once with `mode=map`, it shows Gray codes and gratings one
 * after the other, releases the mirrors, and solves for the mapping from each
 * pixel to its mirror. The mapping is the #moirecalib:mapping property, an
 * element message, the file #moirecalib:location, and a part of the stream tag
 * with the schedule; codedexposure-demux and codedexposure-fuse downstream use
 * it from then on.
 *
 * Frames pass without delay: a separate thread solves and draws. While it is
 * busy, frames pass with the last panel.
 *
 * If the DMD takes no masks at run time, show a grating by other means and name
 * it (#moirecalib:pattern): alignment works then, mapping does not.
 *
 * `mode=phase` needs no pattern and works on recordings, too: it finds the
 * phase of the tile in coded frames, if pixels and mirrors are one to one and
 * the code gives its elements different light, as a staircase does. The
 * `moirecalib/phase` message tells the probability; downstream gets the
 * schedule with that phase.
 *
 * ## A second camera
 *
 * A camera in the beam of the mirrors that are off sees the complement of every
 * pattern. With #moirecalib:beam off, or if the stream's tag says so, it is
 * aligned and mapped to the same mirrors as the first one.
 *
 * Both are mapped in one run where codedexposure-pair gives the frames of the
 * second camera to those of the first: #moirecalib:second-location,
 * #moirecalib:second-report and #moirecalib:second-mapping have the result.
 *
 * ## Messages
 *
 * `moirecalib/state`, `moirecalib/reading`, `moirecalib/mapping`,
 * `moirecalib/second-mapping`, `moirecalib/phase` and PROGRESS messages with
 * the code `mapping`; see docs/streams.md.
 *
 * ## Example pipeline
 *
 * |[
 * gst-launch-1.0 -m videotestsrc num-buffers=1200 pattern=white \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim dmd=sim:bench rotation=0.5 scale=1.01 \
 *     ! dmdsync device=sim:bench,size=768x576 \
 *     ! moirecalib mode=map location=mapping.json report=mapping.png \
 *     ! videoconvert ! autovideosink
 * ]| A simulated bench is mapped; the mapping is in mapping.json.
 *
 * Since: 0.1
 */
#include "moirecalib.h"

#include "common/elements.h"
#include "common/properties.h"

GST_DEBUG_CATEGORY (moirecalib_debug);
#define GST_CAT_DEFAULT moirecalib_debug

using namespace codedexposure;
using namespace codedexposure::gst;
using moire::CalibState;
using moire::GstMoireCalib;
using moire::Mode;
using moire::Settings;

namespace
{

G_DEFINE_ENUM_TYPE (GstMoireCalibMode, gst_moire_calib_mode,
    {int (Mode::automatic), "Alignment, and the mapping once it is aligned",
        "auto"},
    {int (Mode::align), "Alignment only", "align"},
    {int (Mode::map), "The mapping at once", "map"},
    {int (Mode::phase),
        "Phase of the tile, from a coded frame of a staircase; no patterns",
        "phase"});

PropertyTable<CalibState>
properties ()
{
  static const auto set = [] (auto... path) {
    return within (&CalibState::settings, path...);
  };
  static const auto stage = [] (auto member) {
    return set (&Settings::stage, member);
  };
  return {
      {"mode", "Mode",
          "What to do; setting it starts over at the next frame, even if the "
          "value does not change",
          kReadWrite, set (&Settings::mode), gst_moire_calib_mode_get_type ()},
      {"location", "Location",
          "File to write the mapping to, JSON (docs/formats.md); empty: none",
          kReadWrite, set (&Settings::location)},
      {"report", "Report",
          "File for a picture of fringes, residuals and pixel quality, PNG; "
          "empty: none",
          kReadWrite, set (&Settings::report)},
      {"second-location", "Location of the second mapping",
          "File to write the mapping of a second camera to, in the beam of the "
          "mirrors that are off, whose frames codedexposure-pair gives to "
          "those "
          "of the first; empty: none",
          kReadWrite, set (&Settings::second_location)},
      {"second-report", "Second report",
          "File for a picture of its residuals and pixel quality, PNG; empty: "
          "none",
          kReadWrite, set (&Settings::second_report)},
      {"pattern", "Pattern",
          "Grating that the mirrors show all the time, such as "
          "grating-both:4/0, for a DMD that takes no masks at run time; no "
          "mapping is measured then; empty: request patterns from dmdsync",
          kReadWrite, set (&Settings::pattern)},
      {"schedule", "Schedule",
          "Schedule whose phase mode=phase finds, a preset or a JSON file; "
          "empty: the stream's. Read when the mode is set",
          kReadWrite, set (&Settings::schedule)},
      {"beam", "Beam",
          "The beam of the mirrors in which the camera is; one in that of "
          "those "
          "that are off sees the complement of every pattern; off if the "
          "stream's tag says so",
          kReadWrite, set (&Settings::beam),
          gst_coded_exposure_beam_get_type ()},
      {"overlay", "Overlay",
          "Draw fringes, numbers and arrows over frames that show a pattern; "
          "frames of the schedule, and all frames if false, pass unchanged",
          kReadWrite, set (&Settings::overlay)},
      {"period", "Period",
          "Period of the gratings of a mapping, mirrors, even; longer ones "
          "take more patterns and tolerate more blur",
          kReadWrite, set (&Settings::period), 4, 64},
      {"frames", "Frames",
          "Frames of each pattern of a mapping, which are averaged", kReadWrite,
          set (&Settings::frames), 1, 1000},
      {"bits", "Bits",
          "Significant bits of GRAY16_LE frames, which decide what is "
          "saturated; 0: as the frame metadata say, or all 16",
          kReadWrite, set (&Settings::bits), 0, 16},
      {"tolerance", "Tolerance",
          "The bench is aligned when every pixel is within this distance of "
          "its place, mirrors",
          kReadWrite, stage (&StageOptions::tolerance), 0.001, 10.0},
      {"mirror-pitch", "Mirror pitch",
          "Stage travel for one mirror, micrometres: the pitch of the mirrors "
          "times the magnification of the optics",
          kReadWrite, stage (&StageOptions::mirror_pitch), 0.01, 1000.0},
      {"pixels-per-mirror", "Pixels per mirror",
          "Target magnification, at which the search for fringes starts",
          kReadWrite, stage (&StageOptions::pixels_per_mirror), 0.25, 16.0},
      {"flip-x", "Flip x", "The stage's x runs against the picture's",
          kReadWrite, stage (&StageOptions::flip_x)},
      {"flip-y", "Flip y", "The stage's y runs against the picture's",
          kReadWrite, stage (&StageOptions::flip_y)},
      {"flip-theta", "Flip theta",
          "The stage's angle runs anticlockwise in the picture", kReadWrite,
          stage (&StageOptions::flip_theta)},
      {"state", "State",
          "searching, coarse, fine, aligned, mapping, solving, mapped, failed "
          "or found, as in the message moirecalib/state; notifies",
          kReadOnly,
          [] (const CalibState &st) {
            return std::string (stage_text (st.stage));
          }},
      {"mapping", "Mapping",
          "The last mapping, JSON (docs/formats.md); empty: none yet; notifies",
          kReadOnly, &CalibState::mapping},
      {"second-mapping", "Second mapping",
          "The last mapping of a second camera, JSON; empty: none yet; "
          "notifies",
          kReadOnly, &CalibState::second_mapping},
  };
}

void
changed (GObject *object, const GParamSpec *pspec)
{
  Settings &settings = moire::state (object).settings;
  settings.period = settings.period / 2 * 2;
  if (g_str_equal (pspec->name, "mode"))
    settings.turn++;
}

void
before_transform (GstBaseTransform *trans, GstBuffer *) noexcept
{
  gst_base_transform_set_passthrough (
      trans, !settings_of (as<GstMoireCalib> (trans)).lays_over ());
}

bool
begin (GstElement *element)
{
  auto *self = as<GstMoireCalib> (element);
  moire::set_stage (self, moire::Stage::searching);
  return moire::start_worker (self);
}

/* The streaming thread may wait for the worker at the end. */
void
halt (GstElement *element)
{
  moire::release_mirrors (as<GstMoireCalib> (element));
  moire::stop_worker (as<GstMoireCalib> (element));
}

void
end (GstElement *element)
{
  moire::state (element).stream = moire::Stream ();
}

constexpr StateHooks kRun{.begin = begin, .halt = halt, .end = end};

void
set_up (gpointer klass)
{
  auto *transform_class = GST_BASE_TRANSFORM_CLASS (klass);

  GST_DEBUG_CATEGORY_INIT (
      moirecalib_debug, "moirecalib", 0, "camera against mirrors");
  install_state<GstMoireCalib, properties, changed> (klass);
  describe_element (klass, "Moiré calibration", "Filter/Analyzer/Video",
      "Aligns a coded exposure camera with its mirrors and measures the "
      "mapping between them");
  install_run<kRun> (klass);
  /* An application may drop its last reference without a change to NULL. */
  G_OBJECT_CLASS (klass)->dispose = [] (GObject *object) noexcept {
    moire::stop_worker (as<GstMoireCalib> (object));
    parent_class<GObjectClass> (object)->dispose (object);
  };
  transform_class->set_caps = GST_DEBUG_FUNCPTR (moire::set_caps);
  transform_class->sink_event = GST_DEBUG_FUNCPTR (moire::sink_event);
  transform_class->before_transform = GST_DEBUG_FUNCPTR (before_transform);
  transform_class->transform_ip = GST_DEBUG_FUNCPTR (moire::transform_ip);
}

void
set_up_instance (GstMoireCalib *self)
{
  gst_base_transform_set_in_place (GST_BASE_TRANSFORM (self), TRUE);
  gst_base_transform_set_qos_enabled (GST_BASE_TRANSFORM (self), FALSE);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (moirecalib, "moirecalib", GST_RANK_NONE,
    (type_of<GstMoireCalib, set_up, set_up_instance> (
        "GstMoireCalib", GST_TYPE_BASE_TRANSFORM)))
