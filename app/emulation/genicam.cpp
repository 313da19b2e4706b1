/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/genicam.h"

#include <algorithm>
#include <utility>

#include <glib/gstdio.h>

#include "base/try.h"

namespace codedexposure::genicam
{

namespace
{

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

/* @p index of the address, if there is one. */
std::string
int_reg (
    const std::string &name, guint32 address, const std::string &index = "")
{
  return "<IntReg Name=\"" + name + "\"><Address>" + std::to_string (address) +
         "</Address>" + index +
         "<Length>4</Length><AccessMode>RW</AccessMode>"
         "<pPort>Device</pPort><Sign>Unsigned</Sign>"
         "<Endianess>BigEndian</Endianess></IntReg>\n";
}

/* An enumeration for each line, in registers from @p address on. */
std::string
line_choice (const std::string &name, const std::vector<std::string> &values,
    guint32 address)
{
  return choice (name, values,
      int_reg (name + "Value", address,
          "<pIndex Offset=\"" + std::to_string (kNextLine) + "\">" + kSelector +
              "Value</pIndex>"));
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
  const std::unique_ptr<ArvFakeCamera, FreeWith<g_object_unref>> model (
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

} // namespace

MonoFormat
format_of (guint32 code)
{
  for (const WireFormat &wire : kWireFormats)
    if (wire.code == code)
      return wire.format;
  return MonoFormat::mono8;
}

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

Result<std::string>
write_description (const GigeCameraOptions &options)
{
  ASSIGN_OR_RETURN (const std::string xml, describe (options));
  gchar *name = nullptr;
  const int descriptor =
      g_file_open_tmp ("codedexposure-XXXXXX.xml", &name, nullptr);
  if (descriptor < 0)
    return Error{std::string ("the description of the simulated camera cannot "
                              "be written to ") +
                 g_get_tmp_dir () +
                 "; set TMPDIR to a folder that can be written to"};
  const std::string path = name;
  g_free (name);
  g_close (descriptor, nullptr);
  if (!g_file_set_contents (
          path.c_str (), xml.data (), gssize (xml.size ()), nullptr)) {
    g_unlink (path.c_str ());
    return Error{"cannot write " + path};
  }
  return path;
}

} // namespace codedexposure::genicam
