/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "settings.h"

#include <string_view>

#include "base/text.h"
#include "common/owned_frames.h"

namespace codedexposure::gst::camera
{

namespace
{

std::string
line_of (const Settings &settings)
{
  if (!settings.trigger_line.empty ())
    return settings.trigger_line;
  return settings.trigger == Trigger::dmd ? "Line0" : "Line1";
}

} // namespace

Result<void>
check_settings (const Settings &settings)
{
  if (!settings.pixel_format.empty ())
    if (const auto format = camera_format (settings.pixel_format); !format)
      return format.error ();
  if (settings.trigger_line.find_first_of (" =\t\n\"") != std::string::npos)
    return Error{"trigger-line=\"" + settings.trigger_line +
                 "\" is no line of a camera: it is one word, such as Line0. "
                 "\"codedexposure camera show\" lists those of the camera"};
  if (!settings.trigger_line.empty () && settings.trigger == Trigger::none)
    return Error{"trigger-line=" + settings.trigger_line +
                 " has no effect with trigger=none: set trigger=dmd where the "
                 "DMD triggers the camera, trigger=camera where the camera "
                 "triggers the DMD"};
  for (const std::string_view word : split (settings.features, ' '))
    if (word.starts_with ("PixelFormat="))
      return Error{"features=\"" + std::string (word) +
                   "\" does not say how to unpack the pixels: set "
                   "pixel-format=" +
                   std::string (word.substr (word.find ('=') + 1))};
  return {};
}

std::string
feature_assignments (const Settings &settings)
{
  const bool falling = settings.trigger_edge == Edge::falling;
  std::string text;
  if (settings.trigger == Trigger::dmd)
    text = "TriggerSelector=FrameStart TriggerSource=" + line_of (settings) +
           " TriggerActivation=" + (falling ? "FallingEdge" : "RisingEdge") +
           " TriggerMode=On";
  else if (settings.trigger == Trigger::camera)
    text = "TriggerSelector=FrameStart TriggerMode=Off LineSelector=" +
           line_of (settings) +
           " LineMode=Output LineSource=ExposureActive LineInverter=" +
           (falling ? "true" : "false");
  if (!settings.pixel_format.empty ())
    text += " PixelFormat=" + std::string (mono_format_text (
                                  *parse_mono_format (settings.pixel_format)));
  if (!settings.features.empty ())
    text += " " + settings.features;
  return text;
}

std::string
caps_of_format (const std::string &pixel_format)
{
  const auto format = parse_mono_format (pixel_format);
  return std::string ("video/x-raw,format=") +
         (!format                           ? "{GRAY8,GRAY16_LE}"
             : *format == MonoFormat::mono8 ? "GRAY8"
                                            : "GRAY16_LE");
}

} // namespace codedexposure::gst::camera
