/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties; the plan and the caps of the pads, which follow from them and the
 * format. */
#include "fuse.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/pixels.h"
#include "base/try.h"
#include "base/workers.h"
#include "common/element.h"

GST_DEBUG_CATEGORY_EXTERN (codedexposure_fuse_debug);
#define GST_CAT_DEFAULT codedexposure_fuse_debug

namespace codedexposure::gst::fuse
{

G_DEFINE_ENUM_TYPE (GstCodedExposureQuality, gst_coded_exposure_quality,
    {int (FuseQuality::kFast), "one linear filter a pixel, in real time",
        "fast"},
    {int (FuseQuality::kBalanced),
        "the filter of the motion that fits around each pixel", "balanced"},
    {int (FuseQuality::kBest),
        "more motions, and collaborative filtering of similar blocks; for "
        "recordings",
        "best"},
    {int (FuseQuality::kLearned),
        "best, then refined by a network that learned from pictures",
        "learned"});

constexpr Reach kMaxReach{
    Fuser<std::uint8_t>::kMaxHistory, Fuser<std::uint8_t>::kMaxLookahead};

PropertyTable<Settings>
Fuse::properties ()
{
  return {
      {"quality", "Quality",
          "Quality against speed; all but fast are for up to 16 slots",
          kReadWrite, &FuseOptions::quality,
          gst_coded_exposure_quality_get_type ()},
      {"refine", "Refine",
          "Refine the result by a network that learned from pictures, as "
          "quality=learned does with best; for one-hot codes of 2 to 16 slots "
          "and an off-state leakage of up to 5 %, others stay as they are, "
          "with a warning",
          kReadWrite, &FuseOptions::refine},
      {"lookahead", "Lookahead",
          "Coded frames to wait for before one is fused; static pixels are "
          "then known from the first frame on; each adds a frame period to the "
          "latency",
          kReadWrite, &FuseOptions::lookahead, 0u,
          guint (Fuser<std::uint8_t>::kMaxLookahead)},
      {"overlap", "Overlap",
          "Exposures that are fused for each coded frame: beyond 1, also those "
          "that begin in it and end in the next one, which makes the first and "
          "last slots of a frame as true as the others, in as many times the "
          "time; no more than there are slots count; needs lookahead=1; for "
          "one-hot codes and frames with hardly a "
          "gap, others stay as they are, with a warning",
          kReadWrite, &FuseOptions::overlap, 1u,
          guint (Fuser<std::uint8_t>::kMaxOverlap)},
      {"threads", "Threads",
          "Threads, which do not change pixels; 0: one for each processor, and "
          "for quality fast without refine, the streaming thread only, but to "
          "rectify frames and to correct those of a second camera",
          kReadWrite, &FuseOptions::threads, 0u, guint (Workers::kMost)},
      {"range", "Range",
          "White of fused frames in whites of a coded frame; beyond 1, with "
          "frames of a second camera behind a filter, light that saturates the "
          "first is that of the second, and the result is not refined; use 10 "
          "bits or more",
          kReadWrite, &FuseOptions::range, 1u,
          guint (Fuser<std::uint8_t>::kMaxRange)},
      {"full-well", "Full well",
          "Electrons at white in a pixel that is on for the whole exposure, as "
          "in codedexposure-sim; determines the shot noise; 0: the frames are "
          "noise-free; -1: by the bench profile, or noise-free",
          kReadWrite, within (&FuseOptions::noise, &SensorNoise::full_well),
          Settings::kUnset, SensorNoise::kMaxFullWell},
      {"read-noise", "Read noise",
          "Noise of the camera's electronics in electrons rms; counts only "
          "with a full-well; -1: that of the bench profile, or none",
          kReadWrite, within (&FuseOptions::noise, &SensorNoise::read_noise),
          Settings::kUnset, SensorNoise::kMaxReadNoise},
      {"second-full-well", "Second full well",
          "Electrons that the same light makes in a pixel of a second camera, "
          "as of full-well; -1: by its bench profile, or as many as in the "
          "first",
          kReadWrite, within (&Settings::of_second, &SensorNoise::full_well),
          Settings::kUnset, SensorNoise::kMaxFullWell},
      {"second-read-noise", "Second read noise",
          "Noise of a second camera's electronics in electrons rms; -1: by its "
          "bench profile, or as that of the first",
          kReadWrite, within (&Settings::of_second, &SensorNoise::read_noise),
          Settings::kUnset, SensorNoise::kMaxReadNoise},
  };
}

Settings &
Fuse::settings_of (GObject *object)
{
  return static_cast<Fuse &> (filter_of (object)).settings_;
}

std::string
Fuse::method_name () const
{
  auto *qualities =
      G_ENUM_CLASS (g_type_class_peek (gst_coded_exposure_quality_get_type ()));
  const bool learned = in_force_.quality == FuseQuality::kLearned;
  const auto quality = learned ? FuseQuality::kBest : in_force_.quality;
  std::string name = std::string ("fuse ") +
                     g_enum_get_value (qualities, int (quality))->value_nick;
  if (plan_ && plan_->partners)
    name += ", both beams";
  if (in_force_.overlap > 1 && unoverlapped ().empty ())
    name += ", overlap " + std::to_string (std::min (
                               in_force_.overlap, format ().schedule.slots ()));
  if (in_force_.range > 1)
    name += ", range " + std::to_string (in_force_.range);
  if ((learned || in_force_.refine) && unrefined ().empty ())
    name += ", learned " + refinement_hash () +
            (format ().schedule.leak () > 0.0 ? ", leakage undone" : "");
  return name;
}

/* Why the result is not refined although it should be. */
std::string
Fuse::unrefined () const
{
  return plan_ ? std::visit (
                     [] (const auto &fuser) { return fuser.unrefined (); },
                     plan_->fuser)
               : std::string ();
}

/* Why exposures between coded frames are not fused although they should be. */
std::string
Fuse::unoverlapped () const
{
  if (!plan_ || !plan_->gap.empty ())
    return plan_ ? plan_->gap : std::string ();
  return std::visit (
      [] (const auto &fuser) { return fuser.unoverlapped (); }, plan_->fuser);
}

/* A pixel at the largest value has seen the light of white_slots () slots. */
SensorNoise
Fuse::noise (const Schedule &schedule) const
{
  SensorNoise noise = in_force_.noise;
  const BenchProfile *known = bench ();
  if (noise.full_well == Settings::kUnset) {
    const auto electrons =
        known ? known->electrons_per_number () : std::nullopt;
    noise.full_well = electrons.value_or (0.0) *
                      (known ? known->largest () : 0) * schedule.slots () /
                      schedule.white_slots ();
  }
  if (noise.read_noise == Settings::kUnset)
    noise.read_noise = known ? value_or (known->read_noise, 0.0) : 0.0;
  return noise;
}

namespace
{

/* Relative noise of a plain exposure at typical light, if the camera is
 * described. */
RectifyOptions
rectify_options_of (const SensorNoise &noise)
{
  constexpr double kTypicalLight = 0.4;
  RectifyOptions options;
  if (noise.full_well > 0.0)
    options.noise = std::clamp (
        std::sqrt (noise.variance (kTypicalLight * noise.full_well, 0.0)) /
            noise.full_well,
        RectifyOptions::kMinNoise, RectifyOptions::kMaxNoise);
  return options;
}

} // namespace

/* What properties say of the first camera only, the second has, too. Where the
 * ratio of light is not known, both have white at the largest value. */
SensorNoise
Fuse::partner_noise (const CodedFormat &format) const
{
  SensorNoise noise = in_force_.of_second;
  const Schedule &schedule = format.schedule;
  const SensorNoise first = this->noise (schedule);
  const PartnerSetup &known = *tagged ().partner;
  const auto complement = schedule.complement ();
  const double largest =
      format.wide () ? largest_pixel_of<std::uint16_t> (significant_bits ())
                     : largest_pixel_of<std::uint8_t> (significant_bits ());
  const double electrons =
      known.electrons * largest * schedule.slots () *
      (known.light_ratio > 0.0 ? known.light_ratio / schedule.white_slots ()
          : complement         ? 1.0 / complement->white_slots ()
                               : 0.0);
  const auto decide = [] (double &value, double told, double profiled,
                          double of_first) {
    if (value == Settings::kUnset)
      value = told == Settings::kUnset && profiled > 0.0 ? profiled : of_first;
  };
  decide (noise.full_well, in_force_.noise.full_well,
      std::min (electrons, SensorNoise::kMaxFullWell), first.full_well);
  decide (noise.read_noise, in_force_.noise.read_noise,
      std::min (known.read_noise, SensorNoise::kMaxReadNoise),
      first.read_noise);
  return noise;
}

RectifyOptions
Fuse::rectify_options (const Schedule &schedule) const
{
  return rectify_options_of (noise (schedule));
}

namespace
{

template <typename Pixel>
Result<AnyFuser>
make_fuser (
    const CodedFormat &format, const FuseOptions &options, std::stop_token stop)
{
  auto made = Fuser<Pixel>::make (format.schedule, format.size.width,
      format.size.height, options, std::move (stop));
  if (!made)
    return made.error ();
  return AnyFuser (std::move (*made));
}

/* What is too long without light between two coded frames; empty: nothing. A
 * quarter of a slot, as what moves jumps by as much. */
std::string
gap_of (const CodedFormat &format)
{
  const Schedule &schedule = format.schedule;
  const auto slots =
      SlotPlan::fit (schedule.timing (), schedule.slots (), format.rate);
  if (!slots)
    return slots.error ().message;
  const Nanoseconds gap = slots->frame_period () - slots->exposure ();
  if (4 * gap <= slots->active ())
    return {};
  return "there is no light for " + codedexposure::time_text (gap) +
         " from one exposure to the next; it must be a quarter of a slot at "
         "most, " +
         codedexposure::time_text (slots->active () / 4);
}

CapsPtr
of_sixteen_bits (GstCaps *caps)
{
  CapsPtr wide (gst_caps_copy (caps));
  gst_caps_set_simple (
      wide.get (), "format", G_TYPE_STRING, "GRAY16_LE", nullptr);
  return wide;
}

} // namespace

/* The second camera has its own place, and sees the complement of the masks. */
std::optional<PartnerReader>
Fuse::plan_partners (const CodedFormat &format) const
{
  const std::optional<PartnerSetup> &partner = tagged ().partner;
  if (!partner)
    return std::nullopt;
  RectifyOptions options = rectify_options_of (partner_noise (format));
  options.keep_unknown = options.correct = true;
  auto made = PartnerReader::make (*partner, format, options);
  if (made)
    return *std::move (made);
  POST_WARNING (element (), STREAM, FORMAT,
      "The frames of the second camera are not used: " + made.error ().message +
          ".");
  return std::nullopt;
}

/* False when it was stopped, or on an error, which is posted. */
bool
Fuse::plan_correction (
    Plan &plan, const CodedFormat &format, const FuseOptions &options) const
{
  const Rectifier *partner =
      plan.partners ? plan.partners->rectifier () : nullptr;
  if (!partner || !partner->corrects ())
    return true;
  const auto make = [&]<typename Pixel> (const Fuser<Pixel> &) -> Result<void> {
    ASSIGN_OR_RETURN (
        plan.correction, PartnerCorrection<Pixel>::make (format.schedule,
                             *partner, options, stop_token ()));
    return {};
  };
  const Result<void> made = std::visit (make, plan.fuser);
  if (!made && made.error ().code != ErrorCode::cancelled)
    post_error (made.error ().message);
  return made.ok ();
}

bool
Fuse::plan (const CodedFormat &format, PadCaps &caps)
{
  FuseOptions options = in_force_;
  auto partners = plan_partners (format);
  options.partner = partners.has_value ();
  if (partners) {
    options.partner_black = tagged ().partner->black;
    options.partner_noise = partner_noise (format);
  }
  options.bits = significant_bits ();
  options.noise = noise (format.schedule);
  std::string gap = options.overlap > 1 ? gap_of (format) : std::string ();
  if (!gap.empty ())
    options.overlap = 1;
  const std::stop_token stop = stop_token ();
  auto fuser = format.wide ()
                   ? make_fuser<std::uint16_t> (format, options, stop)
                   : make_fuser<std::uint8_t> (format, options, stop);
  if (!fuser) {
    if (fuser.error ().code != ErrorCode::cancelled)
      post_error (fuser.error ().message);
    return false;
  }
  const CapsPtr rectified = format.rectifier
                                ? format.resized (format.size)
                                : CapsPtr (gst_caps_ref (format.caps.get ()));
  CapsPtr &fused = caps.of (PadKind::all);
  CapsPtr &uncertainty = caps.of (PadKind::uncertainty);
  fused.reset (
      scale_caps (rectified.get (), scale_for (format.schedule, nullptr)));
  uncertainty = of_sixteen_bits (fused.get ());
  const int history =
      std::visit ([] (const auto &made) { return made.history (); }, *fuser);
  Plan made{std::move (*fuser), std::move (partners), {}, {}, {},
      {history, options.lookahead}, std::move (gap)};
  if (!plan_correction (made, format, options))
    return false;
  gst_video_info_from_caps (&made.fused, fused.get ());
  gst_video_info_from_caps (&made.uncertainty, uncertainty.get ());
  plan_ = std::move (made);
  if (options.range > 1 && !options.partner)
    POST_WARNING (element (), STREAM, FORMAT,
        "Range " + std::to_string (options.range) +
            " makes the pictures darker and shows no more light: the frames "
            "have no partners of a second camera. Leave it at 1, or put "
            "codedexposure-pair before this element.");
  if (const std::string reason = unrefined (); !reason.empty ())
    POST_WARNING (element (), STREAM, FORMAT,
        "The result is not refined: " + reason + ".");
  if (const std::string reason = unoverlapped (); !reason.empty ())
    POST_WARNING (element (), STREAM, FORMAT,
        "The exposures between coded frames are not used: " + reason +
            ". Leave overlap at 1.");
  return true;
}

void
Fuse::planned (bool)
{
  const GstClockTime latency = GstClockTime (plan_->reach.lookahead) *
                               boundary (format ().schedule.slots ());
  set_latency (element (), shared_.latency, [latency] { return latency; });
}

Reach
Fuse::reach () const
{
  return plan_ ? plan_->reach : kMaxReach;
}

GstClockTime
Fuse::boundary (int k) const
{
  const CodedFormat &now = format ();
  return GstClockTime (now.rate.time_of (0, k, now.schedule.slots ()));
}

void
Fuse::forget ()
{
  waiting_.clear ();
  plan_.reset ();
}

/* The uncertainty has 16 bits, whatever the coded frames have. */
CapsPtr
Fuse::convert_caps (const CapsContext &context, const GstCodedPad *pad,
    GstCaps *caps, bool to_coded) const
{
  CapsPtr converted = CodedFilter::convert_caps (context, pad, caps, to_coded);
  if (pad->state.kind != PadKind::uncertainty ||
      gst_caps_is_any (converted.get ()))
    return converted;
  return to_coded ? without_fields (converted.get (), {"format"})
                  : of_sixteen_bits (converted.get ());
}

CapsScale
Fuse::scale_for (const Schedule &schedule, const GstCodedPad *) const
{
  return {.rate = {schedule.slots ()}, .crop_rows = schedule.pilot_rows ()};
}

} // namespace codedexposure::gst::fuse
