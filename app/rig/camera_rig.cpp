/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "camera_rig.h"

#include <algorithm>
#include <deque>

#include <arv.h>

#include "base/packed_mono.h"
#include "base/try.h"
#include "common/meta.h"
#include "doctor/checks.h"
#include "pipeline/messages.h"
#include "pipeline/recording.h"
#include "pipeline/source.h"
#include "rig/frame_tap.h"
#include "rig/network_frames.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

constexpr Nanoseconds kSecond = 1'000'000'000;
/* aravissrc gives up after two seconds of silence. */
constexpr Nanoseconds kSilence = 2 * kSecond;
constexpr int kSilentPeriods = 10;
/* Part of a frame period that the camera exposes if nothing else is asked for:
 * a camera that reads out while it exposes needs a pause before the next
 * trigger. */
constexpr double kExposedPart = 0.99;
/* Bytes of frames that wait while a check computes. */
constexpr gsize kMostWaiting = 200'000'000;
/* Waits are this long at most, so that a request to stop is obeyed. */
constexpr std::chrono::milliseconds kMoment{50};

/* The features that the checks ask for, where a camera has them. */
constexpr const char *kFeatures[] = {"DeviceVendorName", "DeviceModelName",
    "DeviceSerialNumber", "DeviceFirmwareVersion", "SensorShutterMode",
    "PixelFormat", "PixelColorFilter", "TestPattern", "Gamma", "GammaEnable",
    "ExposureAuto", "ExposureMode", "GainAuto", "Gain", "BalanceWhiteAuto",
    "LUTEnable", "BlackLevel", "BlackLevelAuto", "BlackLevelClampingEnable",
    "BinningHorizontal", "BinningVertical", "DecimationHorizontal",
    "DecimationVertical", "Width", "Height", "WidthMax", "HeightMax", "OffsetX",
    "OffsetY", "TriggerMode", "TriggerSource", "TriggerActivation",
    "TriggerDelay", "DeviceLinkThroughputLimitMode",
    "DeviceLinkThroughputLimit", "GevSCPSPacketSize", "SharpeningEnable",
    "NoiseReductionEnable", "BslSharpnessEnhancement", "BslNoiseReduction",
    "AcquisitionFrameRateEnable", "AcquisitionFrameRate"};

Error
stopped ()
{
  return {"stopped", ErrorCode::cancelled};
}

/** A pipeline whose frames the caller takes. */
class FramePipeline
{
public:
  /** Adds the elements, and returns the pad whose frames are taken. May throw
   * Failure. */
  using Build = std::function<ObjectPtr<GstPad> (Job &)>;

  static Result<std::unique_ptr<FramePipeline>> make (const Build &build)
  try {
    std::unique_ptr<FramePipeline> made (new FramePipeline);
    made->frames_.emplace (build (made->job_));
    const auto refused = made->job_.outputs.claim (true);
    if (!refused.empty ())
      return Error{refused.front (), ErrorCode::io};
    return made;
  } catch (const Failure &failure) {
    return failure.error;
  }

  /** Removes what was written. */
  ~FramePipeline ()
  {
    gst_element_set_state (pipeline (), GST_STATE_NULL);
    job_.outputs.finish (Outputs::Finish::discard);
  }
  FramePipeline (const FramePipeline &) = delete;
  FramePipeline &operator= (const FramePipeline &) = delete;

  /** Error with what the pipeline says where it cannot. */
  Result<void> set_state (GstState state)
  {
    if (gst_element_set_state (pipeline (), state) != GST_STATE_CHANGE_FAILURE)
      return {};
    const auto why = take_error ();
    gst_element_set_state (pipeline (), GST_STATE_NULL);
    return why.value_or (
        Error{"the camera cannot be started", ErrorCode::device});
  }

  /** The error that an element posted, if there is one. That a camera was
   * silent is none. */
  std::optional<Error> take_error ()
  {
    while (const MessagePtr message =
               next_message (pipeline (), GST_MESSAGE_ERROR)) {
      const Told said (message.get ());
      const std::string kind = factory_of (GST_MESSAGE_SRC (message.get ()));
      if (is_silence (kind, said))
        continue;
      const std::string remedy = remedy_for (kind, said);
      return Error{said.error->message + (remedy.empty () ? "" : "; " + remedy),
          ErrorCode::device};
    }
    return std::nullopt;
  }

  FrameTap &frames () { return *frames_; }

  /** Whether it is still on its way to PLAYING. */
  bool begins () const
  {
    return gst_element_get_state (pipeline (), nullptr, nullptr, 0) ==
           GST_STATE_CHANGE_ASYNC;
  }

  /** By the monotonic clock. */
  Nanoseconds base_time () const
  {
    return Nanoseconds (gst_element_get_base_time (pipeline ()));
  }

  /** A codedexposure-camerasrc. */
  GstChildProxy *camera () const { return GST_CHILD_PROXY (job_.camera); }

private:
  FramePipeline () = default;
  GstElement *pipeline () const { return job_.graph.pipeline (); }

  Job job_{"doctor", RunOptions{}};
  std::optional<FrameTap> frames_;
};

/** The camera of aravissrc; null before it is open. */
ObjectPtr<ArvCamera>
camera_of (const FramePipeline &pipeline)
{
  ArvCamera *camera = nullptr;
  gst_child_proxy_get (pipeline.camera (), "source::camera", &camera, nullptr);
  return ObjectPtr<ArvCamera> (camera);
}

/** The pixels of @p frame, in 16 bits; none if it holds less. */
std::optional<Image<std::uint16_t>>
picture_of (const TappedFrame &frame)
{
  MappedFrame mapped (frame.info, frame.buffer.get (), GST_MAP_READ);
  if (!mapped)
    return std::nullopt;
  Image<std::uint16_t> picture (frame.info.width, frame.info.height);
  read_pixels (mapped, [&picture] (auto pixels) {
    for (int y = 0; y < pixels.height; y++)
      std::copy_n (pixels.row (y), pixels.width, picture.view ().row (y));
  });
  return picture;
}

SeenFrame
seen_frame (const TappedFrame &tapped)
{
  SeenFrame frame;
  frame.time = Nanoseconds (GST_BUFFER_PTS (tapped.buffer.get ()));
  frame.arrival = tapped.arrival;
  auto picture = picture_of (tapped);
  frame.damaged = !picture || GST_BUFFER_FLAG_IS_SET (tapped.buffer.get (),
                                  GST_BUFFER_FLAG_CORRUPTED);
  if (picture)
    frame.picture = *std::move (picture);
  return frame;
}

/** The options of a pipeline that exposes for @p time. */
SourceOptions
exposing (SourceOptions options, Nanoseconds time)
{
  options.exposure = double (time) / 1e3;
  return options;
}

/** What a recorder gets. Frames are missing where its numbers jump, also those
 * that waited for it too long. */
RecordedFrame
recorded (const TappedFrame &tapped, std::optional<std::uint64_t> &last)
{
  RecordedFrame frame;
  GstBuffer *buffer = tapped.buffer.get ();
  const FrameMeta meta = get_frame_meta (buffer).value_or (FrameMeta ());
  frame.time = Nanoseconds (GST_BUFFER_PTS (buffer));
  frame.arrival = tapped.arrival;
  frame.lost_before = last && meta.frame > *last ? meta.frame - *last - 1
                      : last                     ? 0
                                                 : meta.lost_before;
  last = std::max (last.value_or (0), std::uint64_t (meta.frame));
  frame.synchronised = meta.locked;
  if (GST_CLOCK_TIME_IS_VALID (meta.time_uncertainty))
    frame.uncertainty = Nanoseconds (meta.time_uncertainty);
  frame.damaged = GST_BUFFER_FLAG_IS_SET (buffer, GST_BUFFER_FLAG_CORRUPTED);
  return frame;
}

class CameraRig : public Rig
{
public:
  CameraRig (
      CameraRigOptions options, std::unique_ptr<Dmd> dmd, std::stop_token stop)
      : options_ (std::move (options)), dmd_ (std::move (dmd)),
        stop_ (std::move (stop))
  {
  }
  /** Of a second camera, at the mirrors of @p first. */
  CameraRig (CameraRigOptions options, CameraRig &first)
      : options_ (std::move (options)), stop_ (first.stop_), first_ (&first)
  {
  }

  Result<void> open ()
  {
    parts_.rate = options_.plan.frame_rate;
    options_.plan.size = {0, 0}; // as the camera has it
    exposure_ = exposure_of (std::nullopt);
    read_dmd ();
    RETURN_IF_ERROR (make_pipeline ());
    RETURN_IF_ERROR (pipeline_->set_state (GST_STATE_PAUSED));
    const auto camera = camera_of (*pipeline_);
    if (!camera)
      return Error{"aravissrc has no camera", ErrorCode::not_found};
    read_features (camera.get ());
    options_.plan.size = parts_.camera.size;
    if (!options_.second)
      return {};
    CameraRigOptions options{*options_.second, options_.plan};
    second_ = std::make_unique<CameraRig> (std::move (options), *this);
    return with_prefix (second_->open (), "the second camera: ");
  }

  const RigParts &parts () const override { return parts_; }
  Nanoseconds now () const override { return monotonic_now (); }

  Result<void> show (const StillMask &mask, int slots) override
  {
    if (first_) {
      ASSIGN_OR_RETURN (const StillMask other, mask_for_second (mask, slots));
      return first_->show (other, slots);
    }
    if (!dmd_) {
      ASSIGN_OR_RETURN (dmd_, open_dmd (*options_.source.device));
    }
    ASSIGN_OR_RETURN (
        const SlotPlan plan, SlotPlan::fit ({}, slots, parts_.rate));
    /* Not later: the first frames of this mask may be here when show ()
     * returns, and how late they turn to it is measured. */
    park ();
    RETURN_IF_ERROR (dmd_->show (mask, plan, stop_));
    return {};
  }

  void park () override
  {
    if (first_)
      return first_->park ();
    if (dmd_)
      dmd_->stop ();
    for (CameraRig *rig : {this, second_.get ()})
      if (rig) {
        rig->forget_frames ();
        rig->stopped_ = monotonic_now ();
      }
  }

  Result<void> expose (std::optional<Nanoseconds> time) override
  {
    exposure_ = exposure_of (time);
    if (!playing_) {
      pipeline_.reset ();
      return {};
    }
    GError *error = nullptr;
    const auto camera = camera_of (*pipeline_);
    arv_camera_set_exposure_time (
        camera.get (), double (exposure_) / 1e3, &error);
    if (error)
      return camera_error (error);
    forget_frames ();
    return {};
  }

  /** A camera that was silent for too long has ended its stream, perhaps while
   * the masks were changed: it gets one more chance. */
  Result<std::vector<SeenFrame>> watch_until (
      Nanoseconds until, int frames) override
  {
    RETURN_IF_ERROR (start ());
    bool restarted = false;
    std::vector<SeenFrame> seen;
    Nanoseconds last = monotonic_now ();
    while (int (seen.size ()) < frames && monotonic_now () < until) {
      if (stop_.stop_requested ())
        return stopped ();
      const auto tapped = pipeline_->frames ().take (kMoment);
      const bool ended = pipeline_->frames ().ended ();
      if (tapped) {
        last = monotonic_now ();
        SeenFrame frame = seen_frame (*tapped);
        if (!is_outdated (frame))
          seen.push_back (std::move (frame));
      } else if (const auto why = pipeline_->take_error ()) {
        return *why;
      } else if (ended && seen.empty () && !restarted) {
        restarted = true;
        RETURN_IF_ERROR (start ());
        last = monotonic_now ();
      } else if (ended || monotonic_now () - last > patience ()) {
        break;
      }
    }
    return seen;
  }

  /** Without aravissrc, which passes on whole frames only, and cannot be
   * stopped as long as none of the frames that come is. */
  Result<std::vector<SeenFrame>> deliver (int frames) override
  {
    const std::string features = close_pipeline ();
    return receive_frames ({.camera = *options_.source.camera,
        .features = features,
        .exposure = exposure_,
        .begin = [this] { return show (lit (0, 1), 1); },
        .frames = frames,
        .patience = patience (),
        .stop = stop_});
  }

  /** The options have the text of the schedule. */
  Result<void> record (const Schedule &, double seconds,
      const std::function<void (const RecordedFrame &)> &take) override
  {
    close_pipeline ();
    if (second_)
      second_->close_pipeline ();
    dmd_.reset (); // dmdsync opens it
    ASSIGN_OR_RETURN (const auto pipeline, recording_pipeline ());
    RETURN_IF_ERROR (pipeline->set_state (GST_STATE_PLAYING));
    const double periods = seconds * parts_.rate.num / parts_.rate.den;
    Nanoseconds heard = monotonic_now ();
    std::optional<std::uint64_t> last;
    for (double frames = 0; frames < periods;) {
      if (stop_.stop_requested ())
        return stopped ();
      const auto tapped = pipeline->frames ().take (kMoment);
      if (const auto why = pipeline->take_error ())
        return *why;
      const Nanoseconds now = monotonic_now ();
      if (tapped || pipeline->begins ()) // masks are uploaded
        heard = now;
      if (!tapped &&
          (now - heard > patience () || pipeline->frames ().ended ()))
        break;
      if (!tapped)
        continue;
      RecordedFrame frame = recorded (*tapped, last);
      frame.arrival -= pipeline->base_time ();
      const auto picture = picture_of (*tapped);
      frame.damaged |= !picture;
      if (picture)
        frame.picture = picture->view ();
      take (frame);
      frames += 1.0 + double (frame.lost_before);
    }
    return {};
  }

  Rig *second () override { return second_.get (); }

private:
  Result<void> make_pipeline ()
  {
    ASSIGN_OR_RETURN (pipeline_, FramePipeline::make ([this] (Job &job) {
      Chain chain = camera_source (
          job, exposing (options_.source, exposure_), options_.plan);
      return pad_of (chain.to ("fakesink").last (), "sink");
    }));
    pipeline_->frames ().limit (kMostWaiting);
    return {};
  }

  /** The features that it gave the camera. */
  std::string close_pipeline ()
  {
    gchar *features = nullptr;
    if (pipeline_)
      gst_child_proxy_get (
          pipeline_->camera (), "source::features", &features, nullptr);
    const CharPtr owner (features);
    pipeline_.reset ();
    playing_ = false;
    return features ? features : "";
  }

  /** Plays the pipeline, anew if it has ended. */
  Result<void> start ()
  {
    if (playing_ && !pipeline_->frames ().ended ())
      return {};
    if (playing_ || !pipeline_) {
      pipeline_.reset ();
      playing_ = false;
      delays_.clear ();
      RETURN_IF_ERROR (make_pipeline ());
    }
    RETURN_IF_ERROR (pipeline_->set_state (GST_STATE_PLAYING));
    playing_ = true;
    return {};
  }

  void read_features (ArvCamera *camera)
  {
    ArvDevice *device = arv_camera_get_device (camera);
    for (const char *name : kFeatures)
      if (auto text = feature_text (device, name))
        parts_.features[name] = *std::move (text);
    guint count = 0;
    const std::unique_ptr<const char *, FreeWith<g_free>> formats (
        arv_camera_dup_available_pixel_formats_as_strings (
            camera, &count, nullptr));
    for (guint k = 0; formats && k < count; k++)
      parts_.features["PixelFormat.available"] +=
          std::string (k > 0 ? " " : "") + formats.get ()[k];

    const auto known = [] (const char *text) { return text ? text : ""; };
    BenchProfile::Device &of = parts_.camera;
    of.vendor = known (arv_camera_get_vendor_name (camera, nullptr));
    of.model = known (arv_camera_get_model_name (camera, nullptr));
    of.serial = known (arv_camera_get_device_serial_number (camera, nullptr));
    gint x = 0, y = 0;
    arv_camera_get_region (
        camera, &x, &y, &of.size.width, &of.size.height, nullptr);
    parts_.pixel_format = options_.plan.pixel_format;
    if (const auto format = parse_mono_format (parts_.pixel_format))
      parts_.bits = significant_bits (*format);
  }

  void read_dmd ()
  {
    if (first_) {
      parts_.dmd = first_->parts_.dmd;
      parts_.dmd_device = first_->parts_.dmd_device;
      parts_.dmd_status = first_->parts_.dmd_status;
      return;
    }
    parts_.dmd = dmd_->info ();
    parts_.dmd_device = {.model = parts_.dmd.name,
        .serial = parts_.dmd.serial,
        .size = parts_.dmd.size};
    if (const auto status = dmd_->status ())
      parts_.dmd_status = *status;
  }

  void forget_frames ()
  {
    if (playing_)
      pipeline_->frames ().forget ();
  }

  /** That of the command record. */
  Result<std::unique_ptr<FramePipeline>> recording_pipeline () const
  {
    return FramePipeline::make ([this] (Job &job) {
      Chain chain = coded_source (job, exposing (options_.source, exposure_),
          options_.plan, Pace::live);
      RecordingStyle style;
      style.live = true;
      style.rate = parts_.rate;
      write_recording (job, chain, options_.recording, style);
      return pad_of (job.counted, "sink");
    });
  }

  /** Whether a frame was exposed before the masks were stopped, if others are
   * as fast as a frame can be: a busy machine or network held it up. After a
   * stop, there is no trigger for a period at least. */
  bool is_outdated (const SeenFrame &frame)
  {
    constexpr std::size_t kRecent = 100; // clocks drift
    delays_.push_back (frame.arrival - frame.time);
    if (delays_.size () > kRecent)
      delays_.pop_front ();
    const Nanoseconds earliest =
        frame.time + *std::ranges::min_element (delays_); // arrival
    return earliest < stopped_ + exposure_ + parts_.rate.period ();
  }

  Nanoseconds exposure_of (std::optional<Nanoseconds> time) const
  {
    const double longest = options_.source.exposure
                               ? 1e3 * *options_.source.exposure
                               : kExposedPart * double (parts_.rate.period ());
    return time.value_or (Nanoseconds (longest));
  }

  Nanoseconds patience () const
  {
    return std::max (
        kSilence, kSilentPeriods * options_.plan.frame_rate.period ());
  }

  CameraRigOptions options_; // completed by open ()
  std::unique_ptr<Dmd> dmd_; // null while a recording has it
  const std::stop_token stop_;
  RigParts parts_;
  std::unique_ptr<FramePipeline> pipeline_;
  bool playing_ = false;
  Nanoseconds exposure_ = 0;
  Nanoseconds stopped_ = 0;        // the masks before, by monotonic_now ()
  std::deque<Nanoseconds> delays_; // of the last frames, with any offset
  std::unique_ptr<CameraRig> second_;
  CameraRig *const first_ = nullptr; // of the second
};

} // namespace

Result<std::unique_ptr<Rig>>
open_camera_rig (const CameraRigOptions &options, std::unique_ptr<Dmd> dmd,
    std::stop_token stop)
{
  auto rig =
      std::make_unique<CameraRig> (options, std::move (dmd), std::move (stop));
  RETURN_IF_ERROR (rig->open ());
  return std::unique_ptr<Rig> (std::move (rig));
}

} // namespace codedexposure::app
