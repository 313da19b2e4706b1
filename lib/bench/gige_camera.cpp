/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/gige_camera.h"

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
#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

/* Register in which a client enables the trigger. */
constexpr guint32 kTriggerMode = 0x400;
/* Registers of the lines, one after the other. */
constexpr guint32 kLineMode = 0x440, kLineSource = 0x444, kLineInverter = 0x448;
constexpr guint32 kNextLine = 0x20;
/* GigE Vision's own register of the packet size. */
constexpr guint32 kPacketSize = 0x0d04;

struct Unref {
  void operator() (gpointer object) const { g_object_unref (object); }
};

struct WireFormat {
  MonoFormat format;
  ArvPixelFormat code;
};

/* Aravis has no names for the streams of bits. */
constexpr WireFormat kWireFormats[] = {
    {MonoFormat::mono8, ARV_PIXEL_FORMAT_MONO_8},
    {MonoFormat::mono10, ARV_PIXEL_FORMAT_MONO_10},
    {MonoFormat::mono12, ARV_PIXEL_FORMAT_MONO_12},
    {MonoFormat::mono16, ARV_PIXEL_FORMAT_MONO_16},
    {MonoFormat::mono10_packed, ARV_PIXEL_FORMAT_MONO_10_PACKED},
    {MonoFormat::mono12_packed, ARV_PIXEL_FORMAT_MONO_12_PACKED},
    {MonoFormat::mono10p, 0x010a0046u},
    {MonoFormat::mono12p, 0x010c0047u},
};

MonoFormat
format_of (guint32 code)
{
  for (const WireFormat &wire : kWireFormats)
    if (wire.code == code)
      return wire.format;
  return MonoFormat::mono8;
}

/* Replaces the entries of an enumeration; false if there is none of that name.
 */
bool
set_entries (std::string &xml, const std::string &enumeration,
    const std::vector<std::pair<std::string, guint32>> &entries)
{
  const auto node = xml.find ("<Enumeration Name=\"" + enumeration + "\"");
  const auto first = xml.find ("<EnumEntry", node);
  const auto end = xml.find ("<pValue>", node);
  if (node == xml.npos || first == xml.npos || end == xml.npos || first > end)
    return false;
  std::string text;
  for (const auto &[name, value] : entries)
    text += "<EnumEntry Name=\"" + name + "\" NameSpace=\"Standard\"><Value>" +
            std::to_string (value) + "</Value></EnumEntry>\n";
  xml.replace (first, end - first, text);
  return true;
}

constexpr const char *kSelector = "LineSelector";

/* An enumeration of @p values; @p node holds the index. */
std::string
choice (const std::string &name, const std::vector<std::string> &values,
    const std::string &node)
{
  std::string text = "<Enumeration Name=\"" + name + "\">\n";
  for (std::size_t k = 0; k < values.size (); k++)
    text += "<EnumEntry Name=\"" + values[k] + "\"><Value>" +
            std::to_string (k) + "</Value></EnumEntry>\n";
  return text + "<pValue>" + name + "Value</pValue></Enumeration>\n" + node;
}

/* The selected line; the camera does not need it. */
std::string
line_selector ()
{
  const std::string name = kSelector;
  return choice (name, {"Line0", "Line1"},
      "<Integer Name=\"" + name + "Value\"><Value>0</Value></Integer>\n");
}

/* An enumeration for each line, in registers from @p address on. */
std::string
line_choice (const std::string &name, const std::vector<std::string> &values,
    guint32 address)
{
  return choice (name, values,
      "<IntReg Name=\"" + name + "Value\"><Address>" +
          std::to_string (address) + "</Address><pIndex Offset=\"" +
          std::to_string (kNextLine) + "\">" + kSelector +
          "Value</pIndex><Length>4</Length><AccessMode>RW</AccessMode>"
          "<pPort>Device</pPort><Sign>Unsigned</Sign>"
          "<Endianess>BigEndian</Endianess></IntReg>\n");
}

/* Registers of features that Aravis' camera does not have. */
struct ExtraFeature {
  const char *name;
  guint32 address;
  std::vector<std::string> values; // of an enumeration; none: a number
};

const std::vector<ExtraFeature> &
extra_features ()
{
  static const std::vector<ExtraFeature> features = {
      {"SensorShutterMode", 0x500, {"Global", "Rolling"}},
      {"PixelColorFilter", 0x504, {"None", "BayerRG"}},
      {"TestPattern", 0x508, {"Off", "GreyHorizontalRamp"}},
      {"GammaEnable", 0x50c, {"false", "true"}},
      {"ExposureAuto", 0x510, {"Off", "Once", "Continuous"}},
      {"BlackLevelAuto", 0x514, {"Off", "Once", "Continuous"}},
      {"LUTEnable", 0x518, {"false", "true"}},
  };
  return features;
}
constexpr guint32 kGammaEnable = 0x50c, kGamma = 0x51c, kTriggerDelay = 0x520;

std::string
int_reg (const std::string &name, guint32 address)
{
  return "<IntReg Name=\"" + name + "\"><Address>" + std::to_string (address) +
         "</Address><Length>4</Length><AccessMode>RW</AccessMode>"
         "<pPort>Device</pPort><Sign>Unsigned</Sign>"
         "<Endianess>BigEndian</Endianess></IntReg>\n";
}

/* A number with a fraction, in the register @address. */
std::string
float_reg (const std::string &name, guint32 address, const std::string &range)
{
  return "<Float Name=\"" + name + "\"><pValue>" + name + "Register</pValue>" +
         range + "</Float>\n<FloatReg Name=\"" + name + "Register\"><Address>" +
         std::to_string (address) +
         "</Address><Length>4</Length><AccessMode>RW</AccessMode>"
         "<pPort>Device</pPort><Endianess>BigEndian</Endianess></FloatReg>\n";
}

/* Nodes of features by which a user can spoil the measurement of light. */
std::string
extra_nodes ()
{
  std::string text;
  for (const ExtraFeature &feature : extra_features ()) {
    const std::string name = feature.name;
    const std::string node = int_reg (name + "Value", feature.address);
    text += feature.values.front () == "false"
                ? "<Boolean Name=\"" + name + "\"><pValue>" + name +
                      "Value</pValue><OnValue>1</OnValue>"
                      "<OffValue>0</OffValue></Boolean>\n" +
                      node
                : choice (name, feature.values, node);
  }
  text += float_reg ("Gamma", kGamma, "<Min>0.1</Min><Max>4</Max>") +
          float_reg ("TriggerDelay", kTriggerDelay,
              "<Min>0</Min><Max>1000000</Max><Unit>us</Unit>");
  for (const std::string side : {"Width", "Height"})
    text += "<Integer Name=\"" + side + "Max\"><pValue>Sensor" + side +
            "Register</pValue></Integer>\n";
  return text + "<StringReg Name=\"DeviceSerialNumber\"><Address>0xd8</Address>"
                "<Length>16</Length><AccessMode>RO</AccessMode>"
                "<pPort>Device</pPort></StringReg>\n";
}

/* Whether the camera offers @format. */
bool
offers (const GigeCameraOptions &options, MonoFormat format)
{
  return options.features.empty () || options.deep ||
         significant_bits (format) <= std::max (8, options.bits);
}

/* The GenICam description: that of Aravis, with formats, lines and features of
 * this camera. */
Result<std::string>
describe (const GigeCameraOptions &options)
{
  const std::unique_ptr<ArvFakeCamera, Unref> model (
      arv_fake_camera_new ("model"));
  size_t size = 0;
  const char *text = arv_fake_camera_get_genicam_xml (model.get (), &size);
  std::string xml (text ? text : "", text ? size : 0);

  std::vector<std::pair<std::string, guint32>> formats;
  for (const WireFormat &wire : kWireFormats)
    if (offers (options, wire.format))
      formats.emplace_back (mono_format_text (wire.format), wire.code);
  if (!set_entries (xml, "PixelFormat", formats) ||
      !set_entries (xml, "TriggerSource", {{"Line0", 0}, {"Line1", 1}}) ||
      !set_entries (
          xml, "TriggerActivation", {{"RisingEdge", 0}, {"FallingEdge", 1}}))
    return Error{
        "the description of Aravis' fake camera is not that of version "
        "0.8.26, which the simulated camera needs"};
  /* Aravis' camera waits for software triggers only, so its own register stays
   * off. */
  const std::string theirs = "<Address>0x300</Address>";
  const auto mode = xml.find (theirs);
  const auto end = xml.rfind ("<Port Name");
  if (mode == xml.npos || end == xml.npos || mode > end)
    return Error{"the description of Aravis' fake camera lacks its trigger"};
  if (!options.features.empty ())
    xml.insert (end, extra_nodes ());
  if (options.outputs)
    xml.insert (end,
        line_selector () +
            line_choice ("LineMode", {"Input", "Output"}, kLineMode) +
            line_choice ("LineSource", {"Off", "ExposureActive"}, kLineSource) +
            line_choice ("LineInverter", {"false", "true"}, kLineInverter));
  xml.replace (mode, theirs.size (), "<Address>0x400</Address>");
  return xml;
}

Nanoseconds
monotonic_now ()
{
  return g_get_monotonic_time () * 1000;
}

} // namespace

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

struct SimulatedCamera final : public GigeCamera {
  ~SimulatedCamera () override;
  Result<void> start (GigeCameraOptions with, Expose light);
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
  std::optional<CameraSettings> told; // of the frames before
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
  std::unique_ptr<ArvGvFakeCamera, Unref> server;

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

  CameraSettings settings ();
  struct Taken {
    std::uint64_t frame = 0;
    Nanoseconds device_time = 0;
    Fault fault = {};
  };

  void set_features ();
  void tell_settings ();
  void tell_start (ArvBuffer *buffer);
  std::optional<Taken> take ();
  void send (ArvBuffer *buffer);
  void bend ();
  void set_loss (double part)
  {
    g_object_set (server.get (), "gvsp-lost-ratio", part, nullptr);
  }
  void take_light (MonoFormat format);
  void pack (MonoFormat format, int width, int height);
  void obey (const Fault &fault, ArvBuffer *buffer, std::size_t size);
  void hold_up (const Fault &fault);
};

CameraSettings
SimulatedCamera::settings ()
{
  CameraSettings set;
  set.format = format_of (get_register (ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT));
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

void
SimulatedCamera::tell_settings ()
{
  const CameraSettings now = settings ();
  if (options.set_up && told != now)
    options.set_up (now);
  told = now;
}

/* Scales the light by exposure time / period, in the bits of the format. */
void
SimulatedCamera::take_light (MonoFormat format)
{
  const double exposure =
      1e3 * get_register (ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US);
  const double light =
      options.shoot ? 1.0 : std::min (1.0, exposure / period ());
  const int shift = significant_bits (format) - options.bits;
  if (light == 1.0 && shift == 0)
    return;
  for (int y = 0; y < picture.height (); y++)
    for (int x = 0; x < picture.width (); x++) {
      std::uint16_t &pixel = picture.at (x, y);
      const auto value = std::uint32_t (std::lround (light * pixel));
      pixel = std::uint16_t (shift >= 0 ? value << shift : value >> -shift);
    }
}

/* Packs the picture in the size that the client has set: cropped, or with black
 * at the right and the bottom. */
void
SimulatedCamera::pack (MonoFormat format, int width, int height)
{
  const std::size_t row = row_bytes (format, width);
  packed.assign (row * std::size_t (height), 0);
  const int columns = std::min (width, picture.width ());
  const int rows = std::min (height, picture.height ());
  const ImageView<std::uint8_t> out{
      packed.data (), int (row), rows, std::ptrdiff_t (row)};
  const auto whole = picture.view ();
  /* Fits by construction. */
  (void)pack_mono (format, {whole.data, columns, rows, whole.stride}, out);
}

void
SimulatedCamera::hold_up (const Fault &fault)
{
  Nanoseconds time = fault.delay;
  if (options.jitter > 0)
    time +=
        std::uniform_int_distribution<Nanoseconds> (0, options.jitter) (random);
  if (time > 0)
    std::this_thread::sleep_for (std::chrono::nanoseconds (time));
}

/* Applies @fault: sends this frame, an earlier one, or nothing. */
void
SimulatedCamera::obey (const Fault &fault, ArvBuffer *buffer, std::size_t size)
{
  using Kind = Fault::Kind;
  stopped |= fault.kind == Kind::stop;
  kept.frames_ago++;
  const bool again = (kept.fault == Kind::duplicate && kept.frames_ago == 1) ||
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

/* The next frame, its picture and what happens to it; none: there is none. */
std::optional<SimulatedCamera::Taken>
SimulatedCamera::take ()
{
  Taken taken;
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

/* The server makes a new buffer when a client starts the camera. */
void
SimulatedCamera::tell_start (ArvBuffer *buffer)
{
  constexpr const char *kKnown = "codedexposure-known";
  if (g_object_get_data (G_OBJECT (buffer), kKnown) != nullptr)
    return;
  g_object_set_data (G_OBJECT (buffer), kKnown, this);
  if (options.started)
    options.started ();
}

void
SimulatedCamera::send (ArvBuffer *buffer)
{
  tell_settings ();
  tell_start (buffer);
  SentFrame sent;
  sent.host_time = monotonic_now ();
  const auto taken = take ();
  if (!taken) {
    set_loss (1);
    return;
  }
  sent.frame = taken->frame;
  sent.fault = taken->fault;
  sent.device_time = taken->device_time;

  const MonoFormat format =
      format_of (get_register (ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT));
  /* The buffer does not know its size before it is received. */
  const std::size_t size = arv_fake_camera_get_payload (camera);
  arv_buffer_set_timestamp (buffer, guint64 (sent.device_time));
  /* Without a gap where the camera asked in vain. */
  if (options.shoot)
    arv_buffer_set_frame_id (buffer, sent.frame % 65535 + 1);
  if (options.shoot || expose (sent.frame, picture.view ())) {
    bend ();
    take_light (format);
    pack (format, int (get_register (ARV_FAKE_CAMERA_REGISTER_WIDTH)),
        int (get_register (ARV_FAKE_CAMERA_REGISTER_HEIGHT)));
    obey (sent.fault, buffer, size);
  } else
    set_loss (1);
  if (options.sent)
    options.sent (sent);
}

/* Applies the camera's gamma. */
void
SimulatedCamera::bend ()
{
  if (options.features.empty () || get_register (kGammaEnable) == 0)
    return;
  const double gamma = std::bit_cast<float> (get_register (kGamma));
  const int largest = (1 << options.bits) - 1;
  std::vector<std::uint16_t> table;
  for (int value = 0; value <= largest; value++)
    table.push_back (std::uint16_t (
        std::lround (largest * std::pow (double (value) / largest, gamma))));
  for (int y = 0; y < picture.height (); y++)
    for (int x = 0; x < picture.width (); x++) {
      std::uint16_t &pixel = picture.at (x, y);
      pixel = table[std::min<std::size_t> (pixel, std::size_t (largest))];
    }
}

/* The server runs until it is destroyed, but no longer calls this object or
 * sends anything. */
SimulatedCamera::~SimulatedCamera ()
{
  if (!camera)
    return;
  set_loss (1);
  arv_fake_camera_set_fill_pattern (camera, nullptr, nullptr);
}

struct TemporaryFile {
  std::string path;
  ~TemporaryFile ()
  {
    if (!path.empty ())
      g_unlink (path.c_str ());
  }
};

Result<void>
write_description (TemporaryFile &file, const GigeCameraOptions &options)
{
  ASSIGN_OR_RETURN (const std::string xml, describe (options));
  gchar *path = nullptr;
  const int descriptor =
      g_file_open_tmp ("codedexposure-XXXXXX.xml", &path, nullptr);
  if (descriptor < 0)
    return Error{"no temporary file can be written for the description of the "
                 "simulated camera"};
  file.path = path;
  g_free (path);
  g_close (descriptor, nullptr);
  if (!g_file_set_contents (
          file.path.c_str (), xml.data (), gssize (xml.size ()), nullptr))
    return Error{"cannot write " + file.path};
  return {};
}

/* Those of the options that the camera has; others are for other cameras. */
void
SimulatedCamera::set_features ()
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

Result<void>
SimulatedCamera::start (GigeCameraOptions with, Expose light)
{
  TemporaryFile description;
  RETURN_IF_ERROR (write_description (description, with));
  options = std::move (with);
  expose = std::move (light);
  faults = options.faults;
  random.seed (options.seed);
  picture = Image<std::uint16_t> (options.width, options.height);
  server.reset (arv_gv_fake_camera_new_full (options.address.c_str (),
      options.serial.c_str (), description.path.c_str ()));
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

} // namespace

Result<std::unique_ptr<GigeCamera>>
GigeCamera::open (GigeCameraOptions options, Expose expose)
{
  auto camera = std::make_unique<SimulatedCamera> ();
  RETURN_IF_ERROR (camera->start (std::move (options), std::move (expose)));
  return std::unique_ptr<GigeCamera> (std::move (camera));
}

} // namespace codedexposure
