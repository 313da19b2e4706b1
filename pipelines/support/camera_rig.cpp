/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "camera_rig.h"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <limits>

#include <unistd.h>

#include <arv.h>
#include <gst/app/gstappsink.h>
#include <gst/gst.h>

#include "base/file.h"
#include "base/packed_mono.h"
#include "base/try.h"
#include "camera_stream.h"
#include "common/meta.h"
#include "common/raii.h"
#include "doctor/checks.h"

using namespace codedexposure;
using namespace codedexposure::gst;

namespace
{

constexpr Nanoseconds kSecond = 1'000'000'000;
/* aravissrc gives up after two seconds of silence. */
constexpr Nanoseconds kSilence = 2 * kSecond;
constexpr int kSilentPeriods = 10;
constexpr int kBuffers = 50; // of aravissrc
/* Part of a frame period that the camera exposes if nothing else is asked for:
 * a camera that reads out while it exposes needs a pause before the next
 * trigger. */
constexpr double kExposedPart = 0.99;
/* Waits are this long at most, so that a request to stop is obeyed. */
constexpr GstClockTime kMoment = 50 * GST_MSECOND;

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
    "DeviceLinkThroughputLimit", "GevSCPSPacketSize"};

struct SampleUnref {
  void operator() (GstSample *sample) const { gst_sample_unref (sample); }
};
using Sample = std::unique_ptr<GstSample, SampleUnref>;

Error
stopped ()
{
  return {"stopped", ErrorCode::cancelled};
}

/** The error of GError @p error, which is freed. */
Error
camera_error (GError *error)
{
  Error why{error->message, ErrorCode::device};
  g_error_free (error);
  return why;
}

/** A pipeline that ends in an appsink "frames". */
class FramePipeline
{
public:
  static Result<std::unique_ptr<FramePipeline>> make (const std::string &line)
  {
    GError *error = nullptr;
    GstElement *pipeline = gst_parse_launch (
        (line + " appsink name=frames sync=false").c_str (), &error);
    if (pipeline)
      gst_object_ref_sink (pipeline);
    ObjectPtr<GstElement> owner (pipeline);
    if (error)
      return camera_error (error);
    auto made = std::make_unique<FramePipeline> ();
    made->pipeline_ = std::move (owner);
    made->sink_.reset (GST_APP_SINK (made->find ("frames").release ()));
    /* In the line, it would keep the camera open for ever: gst_parse_launch
     * does not release a child whose property is set. */
    g_object_set (
        made->find ("source").get (), "num-arv-buffers", kBuffers, nullptr);
    return made;
  }
  FramePipeline () = default;
  ~FramePipeline () { (void)set_state (GST_STATE_NULL); }
  FramePipeline (const FramePipeline &) = delete;
  FramePipeline &operator= (const FramePipeline &) = delete;

  ObjectPtr<GstElement> find (const char *name) const
  {
    return ObjectPtr<GstElement> (
        gst_bin_get_by_name (GST_BIN (pipeline_.get ()), name));
  }

  /** Error with what the pipeline says where it cannot. */
  Result<void> set_state (GstState state)
  {
    if (!pipeline_ || gst_element_set_state (pipeline_.get (), state) !=
                          GST_STATE_CHANGE_FAILURE)
      return {};
    const auto why = take_error ();
    gst_element_set_state (pipeline_.get (), GST_STATE_NULL);
    return why.value_or (
        Error{"the camera cannot be started", ErrorCode::device});
  }

  /** The error that was posted, if there is one. */
  std::optional<Error> take_error ()
  {
    const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline_.get ()));
    const std::unique_ptr<GstMessage, MiniObjectUnref> message (
        gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR));
    if (!message)
      return std::nullopt;
    GError *error = nullptr;
    gst_message_parse_error (message.get (), &error, nullptr);
    return camera_error (error);
  }

  /** Null if none comes within @p time, or at the end. */
  Sample pull (GstClockTime time)
  {
    return Sample (gst_app_sink_try_pull_sample (sink_.get (), time));
  }
  /** Whether it is still on its way to PLAYING. */
  bool begins () const
  {
    return gst_element_get_state (pipeline_.get (), nullptr, nullptr, 0) ==
           GST_STATE_CHANGE_ASYNC;
  }
  bool ended () const { return gst_app_sink_is_eos (sink_.get ()) != FALSE; }
  Nanoseconds now () const
  {
    return Nanoseconds (
        gst_element_get_current_running_time (pipeline_.get ()));
  }

private:
  ObjectPtr<GstElement> pipeline_;
  ObjectPtr<GstAppSink> sink_;
};

/** The camera of aravissrc; null before it is open. */
ObjectPtr<GObject>
camera_of (const FramePipeline &pipeline)
{
  GObject *camera = nullptr;
  g_object_get (pipeline.find ("source").get (), "camera", &camera, nullptr);
  return ObjectPtr<GObject> (camera);
}

/** A file with a schedule, for the life of this object. */
class ScheduleFile
{
public:
  explicit ScheduleFile (const Schedule &schedule)
  {
    gchar *path = nullptr;
    const int file = g_file_open_tmp ("schedule-XXXXXX.json", &path, nullptr);
    if (file >= 0)
      close (file);
    path_ = path ? path : "";
    g_free (path);
    (void)write_file (path_, schedule.to_json ());
  }
  ~ScheduleFile () { std::remove (path_.c_str ()); }
  ScheduleFile (const ScheduleFile &) = delete;
  ScheduleFile &operator= (const ScheduleFile &) = delete;

  const std::string &path () const { return path_; }

private:
  std::string path_;
};

/** The pixels of @p sample, in 16 bits; none if it holds less. */
std::optional<Image<std::uint16_t>>
picture_of (GstSample *sample)
{
  GstVideoInfo info;
  if (!gst_video_info_from_caps (&info, gst_sample_get_caps (sample)))
    return std::nullopt;
  Image<std::uint16_t> picture (info.width, info.height);
  MappedFrame mapped (info, gst_sample_get_buffer (sample), GST_MAP_READ);
  if (!mapped)
    return std::nullopt;
  read_pixels (mapped, [&picture] (auto pixels) {
    for (int y = 0; y < pixels.height; y++)
      std::copy_n (pixels.row (y), pixels.width, picture.view ().row (y));
  });
  return picture;
}

bool
is_damaged (GstSample *sample)
{
  return GST_BUFFER_FLAG_IS_SET (
      gst_sample_get_buffer (sample), GST_BUFFER_FLAG_CORRUPTED);
}

SeenFrame
seen_frame (GstSample *sample, Nanoseconds now)
{
  SeenFrame frame;
  frame.time = Nanoseconds (GST_BUFFER_PTS (gst_sample_get_buffer (sample)));
  frame.arrival = now;
  auto picture = picture_of (sample);
  frame.damaged = is_damaged (sample) || !picture;
  if (picture)
    frame.picture = *std::move (picture);
  return frame;
}

Nanoseconds
monotonic_now ()
{
  return g_get_monotonic_time () * 1000;
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

  Result<void> open ();

  const RigParts &parts () const override { return parts_; }
  Nanoseconds now () const override { return monotonic_now (); }
  Result<void> show (const StillMask &mask, int slots) override;
  void park () override;
  Result<void> expose (std::optional<Nanoseconds> time) override;
  Result<std::vector<SeenFrame>> watch (int frames) override
  {
    return watch_until (std::numeric_limits<Nanoseconds>::max (), frames);
  }
  Result<std::vector<SeenFrame>> watch_for (
      Nanoseconds time, int frames) override
  {
    return watch_until (monotonic_now () + time, frames);
  }
  Result<std::vector<SeenFrame>> deliver (int frames) override;
  Result<void> record (const Schedule &schedule, double seconds,
      const std::function<void (const RecordedFrame &)> &take) override;

private:
  std::string source () const;
  std::string close_pipeline ();
  Result<void> start ();
  Result<void> reopen_dmd ();
  void read_features (ArvCamera *camera);
  void read_dmd ();
  void forget_frames ();
  Result<std::vector<SeenFrame>> watch_until (Nanoseconds until, int frames);
  bool is_outdated (const SeenFrame &frame);
  Nanoseconds exposure_of (std::optional<Nanoseconds> time) const;
  Nanoseconds patience () const
  {
    return std::max (kSilence, kSilentPeriods * options_.rate.period ());
  }

  const CameraRigOptions options_;
  std::unique_ptr<Dmd> dmd_; // null while a recording has it
  const std::stop_token stop_;
  RigParts parts_;
  std::unique_ptr<FramePipeline> pipeline_;
  bool playing_ = false;
  Nanoseconds exposure_ = 0;
  Nanoseconds stopped_ = 0;        // the masks before, by monotonic_now ()
  std::deque<Nanoseconds> delays_; // of the last frames, with any offset
};

std::string
CameraRig::source () const
{
  return "codedexposure-camerasrc name=camera camera-name=\"" +
         options_.camera + "\" trigger=dmd exposure-time=" +
         std::to_string (double (exposure_) / 1e3) + " " + options_.properties +
         " ! " + "video/x-raw,framerate=" + std::to_string (options_.rate.num) +
         "/" + std::to_string (options_.rate.den) + " ! ";
}

Nanoseconds
CameraRig::exposure_of (std::optional<Nanoseconds> time) const
{
  return time.value_or (options_.exposure.value_or (
      Nanoseconds (kExposedPart * double (options_.rate.period ()))));
}

/* ------------------------------------------------------------ the parts -- */

/** The text of a feature; none if the camera lacks it. */
std::optional<std::string>
feature_text (ArvDevice *device, const char *name)
{
  ArvGcNode *node = arv_device_get_feature (device, name);
  if (!ARV_IS_GC_FEATURE_NODE (node) ||
      !arv_gc_feature_node_is_available (ARV_GC_FEATURE_NODE (node), nullptr))
    return std::nullopt;
  const char *text = arv_gc_feature_node_get_value_as_string (
      ARV_GC_FEATURE_NODE (node), nullptr);
  return text ? std::optional<std::string> (text) : std::nullopt;
}

void
CameraRig::read_features (ArvCamera *camera)
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
  parts_.pixel_format =
      known (arv_camera_get_pixel_format_as_string (camera, nullptr));
  if (const auto format = parse_mono_format (parts_.pixel_format))
    parts_.bits = significant_bits (*format);
}

void
CameraRig::read_dmd ()
{
  parts_.dmd = dmd_->info ();
  parts_.dmd_device = {.model = parts_.dmd.name,
      .serial = parts_.dmd.serial,
      .size = parts_.dmd.size};
  if (const auto status = dmd_->status ())
    parts_.dmd_status = *status;
}

Result<void>
CameraRig::open ()
{
  parts_.rate = options_.rate;
  exposure_ = exposure_of (std::nullopt);
  read_dmd ();
  ASSIGN_OR_RETURN (pipeline_, FramePipeline::make (source ()));
  RETURN_IF_ERROR (pipeline_->set_state (GST_STATE_PAUSED));
  const auto camera = camera_of (*pipeline_);
  if (!camera)
    return Error{"aravissrc has no camera", ErrorCode::not_found};
  read_features (ARV_CAMERA (camera.get ()));
  return {};
}

/* ------------------------------------------------------ mirrors and frames --
 */

Result<void>
CameraRig::show (const StillMask &mask, int slots)
{
  RETURN_IF_ERROR (reopen_dmd ());
  ASSIGN_OR_RETURN (
      const SlotPlan plan, SlotPlan::fit ({}, slots, options_.rate));
  /* Not later: the first frames of this mask may be here when show () returns,
   * and how late they turn to it is measured. */
  dmd_->stop ();
  forget_frames ();
  stopped_ = monotonic_now ();
  RETURN_IF_ERROR (dmd_->show (mask, plan, stop_));
  return {};
}

void
CameraRig::park ()
{
  if (dmd_)
    dmd_->stop ();
  forget_frames ();
  stopped_ = monotonic_now ();
}

/** Whether a frame was exposed before the masks were stopped, if others are as
 * fast as a frame can be: a busy machine or network held it up. After a stop,
 * there is no trigger for a period at least. */
bool
CameraRig::is_outdated (const SeenFrame &frame)
{
  constexpr std::size_t kRecent = 100; // clocks drift
  delays_.push_back (frame.arrival - frame.time);
  if (delays_.size () > kRecent)
    delays_.pop_front ();
  const Nanoseconds earliest =
      frame.time + *std::ranges::min_element (delays_); // arrival
  return earliest < stopped_ + exposure_ + options_.rate.period ();
}

void
CameraRig::forget_frames ()
{
  while (playing_ && pipeline_->pull (0))
    ;
}

Result<void>
CameraRig::expose (std::optional<Nanoseconds> time)
{
  exposure_ = exposure_of (time);
  if (!playing_) {
    pipeline_.reset ();
    return {};
  }
  GError *error = nullptr;
  const auto camera = camera_of (*pipeline_);
  arv_camera_set_exposure_time (
      ARV_CAMERA (camera.get ()), double (exposure_) / 1e3, &error);
  if (error)
    return camera_error (error);
  forget_frames ();
  return {};
}

/** Plays the pipeline, anew if it has failed. */
Result<void>
CameraRig::start ()
{
  if (playing_ && !pipeline_->take_error () && !pipeline_->ended ())
    return {};
  if (playing_ || !pipeline_) {
    pipeline_.reset ();
    playing_ = false;
    delays_.clear ();
    ASSIGN_OR_RETURN (pipeline_, FramePipeline::make (source ()));
  }
  RETURN_IF_ERROR (pipeline_->set_state (GST_STATE_PLAYING));
  playing_ = true;
  return {};
}

/** A camera that was silent for too long has ended its stream, perhaps while
 * the masks were changed: it gets one more chance. */
Result<std::vector<SeenFrame>>
CameraRig::watch_until (Nanoseconds until, int frames)
{
  RETURN_IF_ERROR (start ());
  bool restarted = false;
  std::vector<SeenFrame> seen;
  Nanoseconds last = monotonic_now ();
  while (int (seen.size ()) < frames && monotonic_now () < until) {
    if (stop_.stop_requested ())
      return stopped ();
    const Sample sample = pipeline_->pull (kMoment);
    const Nanoseconds now = monotonic_now ();
    if (sample) {
      last = now;
      SeenFrame frame = seen_frame (sample.get (), now);
      if (!is_outdated (frame))
        seen.push_back (std::move (frame));
    } else if (pipeline_->ended () && seen.empty () && !restarted) {
      restarted = true;
      RETURN_IF_ERROR (start ());
      last = monotonic_now ();
    } else if (pipeline_->ended () || now - last > patience ()) {
      break;
    }
  }
  return seen;
}

/** The features that it gave the camera. */
std::string
CameraRig::close_pipeline ()
{
  gchar *features = nullptr;
  if (pipeline_)
    g_object_get (
        pipeline_->find ("source").get (), "features", &features, nullptr);
  const std::unique_ptr<gchar, FreeWith<g_free>> owner (features);
  pipeline_.reset ();
  playing_ = false;
  return features ? features : "";
}

/** Without aravissrc, which passes on whole frames only, and cannot be stopped
 * as long as none of the frames that come is. */
Result<std::vector<SeenFrame>>
CameraRig::deliver (int frames)
{
  const std::string features = close_pipeline ();
  return receive_frames ({.camera = options_.camera,
      .features = features,
      .exposure = exposure_,
      .begin = [this] { return show (lit (0, 1), 1); },
      .frames = frames,
      .patience = patience (),
      .stop = stop_});
}

/* ------------------------------------------------------------- recording -- */

RecordedFrame
recorded (GstSample *sample, Nanoseconds now)
{
  RecordedFrame frame;
  GstBuffer *buffer = gst_sample_get_buffer (sample);
  const FrameMeta meta = get_frame_meta (buffer).value_or (FrameMeta ());
  frame.time = Nanoseconds (GST_BUFFER_PTS (buffer));
  frame.arrival = now;
  frame.lost_before = meta.lost_before;
  frame.synchronised = meta.locked;
  if (GST_CLOCK_TIME_IS_VALID (meta.time_uncertainty))
    frame.uncertainty = Nanoseconds (meta.time_uncertainty);
  frame.damaged = is_damaged (sample);
  return frame;
}

Result<void>
CameraRig::record (const Schedule &schedule, double seconds,
    const std::function<void (const RecordedFrame &)> &take)
{
  close_pipeline ();
  dmd_.reset (); // dmdsync opens it
  const ScheduleFile file (schedule);
  ASSIGN_OR_RETURN (const auto pipeline,
      FramePipeline::make (source () + "dmdsync device=\"" + options_.device +
                           "\" timestamp-at=device-clock schedule=\"" +
                           file.path () + "\" ! "));
  RETURN_IF_ERROR (pipeline->set_state (GST_STATE_PLAYING));
  const double periods = seconds * options_.rate.num / options_.rate.den;
  Nanoseconds last = monotonic_now ();
  for (double frames = 0; frames < periods;) {
    if (stop_.stop_requested ())
      return stopped ();
    const Sample sample = pipeline->pull (kMoment);
    if (const auto why = pipeline->take_error (); why && frames == 0)
      return *why;
    const Nanoseconds now = monotonic_now ();
    if (pipeline->begins ()) // masks are uploaded
      last = now;
    if (!sample && (now - last > patience () || pipeline->ended ()))
      break;
    if (!sample)
      continue;
    last = now;
    RecordedFrame frame = recorded (sample.get (), pipeline->now ());
    const auto picture = picture_of (sample.get ());
    frame.damaged |= !picture;
    if (picture)
      frame.picture = picture->view ();
    take (frame);
    frames += 1.0 + double (frame.lost_before);
  }
  return {};
}

Result<void>
CameraRig::reopen_dmd ()
{
  if (dmd_)
    return {};
  ASSIGN_OR_RETURN (dmd_, open_dmd (options_.device));
  return {};
}

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
