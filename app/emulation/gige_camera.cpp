/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/gige_camera.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <iterator>
#include <mutex>
#include <optional>
#include <random>
#include <sstream>
#include <thread>
#include <tuple>
#include <vector>

#include <arv.h>
#include <glib/gstdio.h>

#include "base/packed_mono.h"
#include "base/pixels.h"
#include "base/text.h"
#include "base/try.h"
#include "bench/processing.h"
#include "emulation/genicam.h"

namespace codedexposure
{

using namespace genicam;

std::string
camera_settings_text (const CameraSettings &settings)
{
  std::ostringstream text;
  text << settings.width << "x" << settings.height << " "
       << mono_format_text (settings.format) << ", " << settings.frame_rate
       << " a second, exposure ";
  if (settings.exposure_us * settings.frame_rate < 1e6)
    text << settings.exposure_us << " us, ";
  else
    text << "all of the frame, ";
  if (settings.triggered)
    text << "trigger Line" << settings.trigger_line
         << (settings.trigger_falling ? " falling" : " rising");
  else
    text << "no trigger";
  for (std::size_t k = 0; k < std::size (settings.lines); k++) {
    const CameraSettings::Line &line = settings.lines[k];
    if (line.output)
      text << ", Line" << k << " puts out "
           << (line.exposure_active ? "ExposureActive" : "nothing")
           << (line.inverted ? ", inverted" : "");
  }
  return text.str ();
}

namespace
{

Nanoseconds
monotonic_now ()
{
  return g_get_monotonic_time () * 1000;
}

struct SimulatedCamera final : public GigeCamera {
  /* The server runs until it is destroyed, but no longer calls this object or
   * sends anything. */
  ~SimulatedCamera () override
  {
    if (!camera)
      return;
    set_loss (1);
    arv_fake_camera_set_fill_pattern (camera, nullptr, nullptr);
  }

  Result<void> start (GigeCameraOptions with, Expose light)
  {
    ASSIGN_OR_RETURN (const std::string description, write_description (with));
    options = std::move (with);
    expose = std::move (light);
    faults = options.faults;
    random.seed (options.seed);
    picture = Image<std::uint16_t> (options.width, options.height);
    server.reset (arv_gv_fake_camera_new_full (options.address.c_str (),
        options.serial.c_str (), description.c_str ()));
    g_unlink (description.c_str ());
    if (!server || !arv_gv_fake_camera_is_running (server.get ()))
      return Error{"no camera can be at " + in_quotes (options.address) +
                   ", which is no address of this machine"};

    camera = arv_gv_fake_camera_get_fake_camera (server.get ());
    const std::pair<guint32, guint32> settings[] = {
        {ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, guint32 (options.width)},
        {ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, guint32 (options.height)},
        {ARV_FAKE_CAMERA_REGISTER_WIDTH, guint32 (options.width)},
        {ARV_FAKE_CAMERA_REGISTER_HEIGHT, guint32 (options.height)},
        {ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, options.bits > 8
                                                    ? ARV_PIXEL_FORMAT_MONO_16
                                                    : ARV_PIXEL_FORMAT_MONO_8},
        {ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US, 10'000'000}};
    for (const auto &[address, value] : settings)
      arv_fake_camera_write_register (camera, address, value);
    set_features ();
    arv_fake_camera_set_fill_pattern (
        camera,
        [] (ArvBuffer *buffer, void *self, guint32, guint32, ArvPixelFormat) {
          static_cast<SimulatedCamera *> (self)->send (buffer);
        },
        this);
    return {};
  }

  Result<void> add_faults (std::string_view text) override
  {
    const std::lock_guard guard (lock);
    return faults.add (text, next);
  }

  GigeCameraOptions options;
  Expose expose;

  std::mutex lock; // covers the next two
  FaultPlan faults;
  std::uint64_t next = 0;

  /* The camera's thread. */
  std::mt19937_64 random;
  double device_time = 1e9; // of the next frame, ns by the camera's clock
  std::optional<CameraSettings> told; // of the last frame
  bool stopped = false;
  Image<std::uint16_t> picture;
  std::vector<std::uint8_t> packed;
  struct Kept {
    std::vector<std::uint8_t> bytes;
    guint64 stamp = 0;
    Fault::Kind fault = Fault::Kind::none;
    int frames_ago = 0;
  };
  Kept kept; // of a frame that comes again, or late

  ArvFakeCamera *camera = nullptr; // of the server
  /* Last: its thread uses all of the above. */
  std::unique_ptr<ArvGvFakeCamera, FreeWith<g_object_unref>> server;

  guint32 get_register (guint32 address) const
  {
    guint32 value = 0;
    arv_fake_camera_read_register (camera, address, &value);
    return value;
  }

  /* A trigger overrides the client's frame rate. */
  double period ()
  {
    constexpr guint32 kPeriod =
        ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US;
    if (get_register (kTriggerMode) != 1)
      return 1e3 * get_register (kPeriod);
    const double triggered = 1e9 / options.trigger_rate;
    /* It asks for exposures more often than they come, so that it can make up
     * for a delay. */
    const double asked = options.shoot ? triggered / 4 : triggered;
    arv_fake_camera_write_register (
        camera, kPeriod, guint32 (std::lround (asked / 1e3)));
    return triggered;
  }

  CameraSettings settings ()
  {
    CameraSettings set;
    set.format =
        format_of (get_register (ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT));
    set.width = int (get_register (ARV_FAKE_CAMERA_REGISTER_WIDTH));
    set.height = int (get_register (ARV_FAKE_CAMERA_REGISTER_HEIGHT));
    set.frame_rate = 1e9 / period ();
    set.exposure_us = get_register (ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US);
    set.triggered = get_register (kTriggerMode) == 1;
    set.trigger_line =
        int (get_register (ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOURCE));
    set.trigger_falling =
        get_register (ARV_FAKE_CAMERA_REGISTER_TRIGGER_ACTIVATION) == 1;
    for (guint32 k = 0; k < std::size (set.lines); k++) {
      set.lines[k].output = get_register (kLineMode + k * kNextLine) == 1;
      set.lines[k].exposure_active =
          get_register (kLineSource + k * kNextLine) == 1;
      set.lines[k].inverted = get_register (kLineInverter + k * kNextLine) == 1;
    }
    return set;
  }

  /* Those of the options that the camera has; others are for other cameras. */
  void set_features ()
  {
    const auto number = [this] (const char *name, double usual) {
      const auto found = options.features.find (name);
      return found == options.features.end ()
                 ? usual
                 : parse_real (found->second).value_or (usual);
    };
    const auto set = [this] (guint32 address, guint32 value) {
      arv_fake_camera_write_register (camera, address, value);
    };
    for (const ExtraFeature &feature : extra_features ())
      if (const auto found = options.features.find (feature.name);
          found != options.features.end ()) {
        const auto value = std::ranges::find (feature.values, found->second);
        if (value != feature.values.end ())
          set (feature.address, guint32 (value - feature.values.begin ()));
      }
    for (const auto &[name, address, usual] : {std::tuple{"Gamma", kGamma, 1.0},
             std::tuple{"TriggerDelay", kTriggerDelay, 0.0}})
      set (address, std::bit_cast<guint32> (float (number (name, usual))));
    const auto automatic = options.features.find ("GainAuto");
    const bool on =
        automatic != options.features.end () && automatic->second != "Off";
    set (ARV_FAKE_CAMERA_REGISTER_GAIN_MODE, on ? 2 : 1);
    const std::tuple<const char *, guint32, int> numbers[] = {
        {"BinningHorizontal", ARV_FAKE_CAMERA_REGISTER_BINNING_HORIZONTAL, 1},
        {"BinningVertical", ARV_FAKE_CAMERA_REGISTER_BINNING_VERTICAL, 1},
        {"OffsetX", ARV_FAKE_CAMERA_REGISTER_X_OFFSET, 0},
        {"OffsetY", ARV_FAKE_CAMERA_REGISTER_Y_OFFSET, 0},
        {"GevSCPSPacketSize", kPacketSize, 1400},
        {"WidthMax", ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, options.width},
        {"HeightMax", ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, options.height}};
    if (!options.features.empty ())
      for (const auto &[name, address, usual] : numbers)
        set (address, guint32 (number (name, usual)));
  }

  void tell_settings ()
  {
    const CameraSettings now = settings ();
    if (options.set_up && told != now)
      options.set_up (now);
    told = now;
  }

  /* The server makes a new buffer when a client starts the camera. */
  void tell_start (ArvBuffer *buffer)
  {
    constexpr const char *kKnown = "codedexposure-known";
    if (g_object_get_data (G_OBJECT (buffer), kKnown) != nullptr)
      return;
    g_object_set_data (G_OBJECT (buffer), kKnown, this);
    if (options.started)
      options.started ();
  }

  /* The next frame, its picture and what happens to it; none: there is none. */
  std::optional<SentFrame> take ()
  {
    SentFrame taken{.host_time = monotonic_now ()};
    bool lost = false;
    if (options.shoot) {
      const auto shot = options.shoot (picture.view ());
      if (!shot)
        return std::nullopt;
      taken.frame = shot->number;
      device_time = 1e9 + double (shot->begin) * (1 + options.drift * 1e-6);
      lost = shot->lost;
    }
    const std::lock_guard guard (lock);
    if (!options.shoot)
      taken.frame = next;
    next = taken.frame + 1;
    taken.fault = lost ? Fault{Fault::Kind::lose} : faults.at (taken.frame);
    taken.device_time = std::llround (device_time);
    device_time += period () * (1 + options.drift * 1e-6);
    return taken;
  }

  void send (ArvBuffer *buffer)
  {
    tell_settings ();
    tell_start (buffer);
    const auto sent = take ();
    if (!sent) {
      set_loss (1);
      return;
    }

    /* The buffer does not know its size before it is received. */
    const std::size_t size = arv_fake_camera_get_payload (camera);
    arv_buffer_set_timestamp (buffer, guint64 (sent->device_time));
    /* Without a gap where the camera asked in vain. */
    if (options.shoot)
      arv_buffer_set_frame_id (buffer, sent->frame % 65535 + 1);
    if (options.shoot || expose (sent->frame, picture.view ())) {
      bend ();
      take_light ();
      pack ();
      obey (sent->fault, buffer, size);
    } else
      set_loss (1);
    if (options.sent)
      options.sent (*sent);
  }

  /* Applies the camera's gamma. */
  void bend ()
  {
    if (options.features.empty () || get_register (kGammaEnable) == 0)
      return;
    const double gamma = std::bit_cast<float> (get_register (kGamma));
    const int largest = largest_pixel (options.bits);
    const auto table = response_table (largest, gamma);
    for (int y = 0; y < picture.height (); y++)
      for (int x = 0; x < picture.width (); x++) {
        std::uint16_t &pixel = picture.at (x, y);
        pixel = table[std::min<std::size_t> (pixel, std::size_t (largest))];
      }
  }

  void set_loss (double part)
  {
    g_object_set (server.get (), "gvsp-lost-ratio", part, nullptr);
  }

  /* Scales the light by exposure time / period, in the bits of the format. */
  void take_light ()
  {
    const double light =
        options.shoot ? 1.0
                      : std::min (1.0, 1e3 * told->exposure_us / period ());
    const int shift = significant_bits (told->format) - options.bits;
    if (light == 1.0 && shift == 0)
      return;
    for (int y = 0; y < picture.height (); y++)
      for (int x = 0; x < picture.width (); x++) {
        std::uint16_t &pixel = picture.at (x, y);
        const auto value = std::uint32_t (std::lround (light * pixel));
        pixel = std::uint16_t (shift >= 0 ? value << shift : value >> -shift);
      }
  }

  /* Packs the picture in the size that the client has set: cropped, or with
   * black at the right and the bottom. */
  void pack ()
  {
    const std::size_t row = row_bytes (told->format, told->width);
    packed.assign (row * std::size_t (told->height), 0);
    const int columns = std::min (told->width, picture.width ());
    const int rows = std::min (told->height, picture.height ());
    const ImageView<std::uint8_t> out{
        packed.data (), int (row), rows, std::ptrdiff_t (row)};
    const auto whole = picture.view ();
    /* Fits by construction. */
    (void)pack_mono (
        told->format, {whole.data, columns, rows, whole.stride}, out);
  }

  /* Applies @fault: sends this frame, an earlier one, or nothing. */
  void obey (const Fault &fault, ArvBuffer *buffer, std::size_t size)
  {
    using Kind = Fault::Kind;
    stopped |= fault.kind == Kind::stop;
    kept.frames_ago++;
    const bool again =
        (kept.fault == Kind::duplicate && kept.frames_ago == 1) ||
        (kept.fault == Kind::late && kept.frames_ago == 2);
    const guint64 stamp = arv_buffer_get_timestamp (buffer);
    auto *data = static_cast<std::uint8_t *> (
        const_cast<void *> (arv_buffer_get_data (buffer, nullptr)));

    if (fault.kind == Kind::duplicate || fault.kind == Kind::late)
      kept = {packed, stamp, fault.kind, 0};
    else if (again) {
      packed.swap (kept.bytes);
      arv_buffer_set_timestamp (buffer, kept.stamp);
      kept = {};
    }
    std::copy_n (packed.begin (), std::min (size, packed.size ()), data);

    double loss = options.packet_loss;
    if (stopped || fault.kind == Kind::lose || fault.kind == Kind::late)
      loss = 1;
    else if (fault.kind == Kind::incomplete)
      loss = 0.5;
    set_loss (loss);
    hold_up (fault);
  }

  void hold_up (const Fault &fault)
  {
    Nanoseconds time = fault.delay;
    if (options.jitter > 0)
      time += std::uniform_int_distribution<Nanoseconds> (0, options.jitter) (
          random);
    if (time > 0)
      std::this_thread::sleep_for (std::chrono::nanoseconds (time));
  }
};

} // namespace

Result<std::unique_ptr<GigeCamera>>
GigeCamera::open (GigeCameraOptions options, Expose expose)
{
  auto camera = std::make_unique<SimulatedCamera> ();
  RETURN_IF_ERROR (camera->start (std::move (options), std::move (expose)));
  return std::unique_ptr<GigeCamera> (std::move (camera));
}

} // namespace codedexposure
