/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/rules.h"

#include <algorithm>
#include <iterator>

namespace codedexposure
{

namespace
{

constexpr double kAny = std::numeric_limits<double>::infinity ();

constexpr Limits
most (double high)
{
  return {-kAny, high};
}

constexpr Limits
within (double size)
{
  return {-size, size};
}

/** What no number tells. */
constexpr Rule
told (const char *id, const char *remedy)
{
  return {id, "", "", {}, {}, "", remedy};
}

constexpr const char *kNetwork =
    "connect the camera to a network interface of its own, check cable and "
    "switch, and stop other programs";
constexpr const char *kMapping =
    "see that nothing moves, align the camera with "
    "codedexposure calibrate, and run this check again";

constexpr const char *kStraight =
    "set Gamma=1 and switch off every look-up table and high dynamic range "
    "mode of the camera";

constexpr const char *kStuck =
    "let the mirrors run for an hour with changing masks; if they stay stuck, "
    "use another part of the array or another board";

/* In the order of the checks. */
constexpr Rule kRules[] = {
    told ("camera-missing",
        "check its cable and power, and whether another program has it open; "
        "\"codedexposure camera list\" lists the cameras"),
    told ("dmd-missing",
        "check its cable and power; codedexposure dmd list shows the boards"),
    told ("dmd-permission", "install the udev rule "
                            "60-codedexposure-dmd.rules and connect the board "
                            "again"),
    told ("dmd-busy", "close the other program that uses the board"),
    told ("rolling-shutter",
        "set SensorShutterMode=Global, or use a camera with a global shutter"),
    told ("pixel-format", "set --pixel-format Mono12"),
    told ("firmware", "update it with TI's program"),
    told ("slow-disk", "choose an --output folder on a faster disk"),
    told ("packet-size", "set the MTU of the network interface to 9000, and "
                         "packet-size with it"),
    told ("socket-buffer", "run sysctl net.core.rmem_max=33554432"),
    told ("packet-loss", kNetwork),
    told ("lose", kNetwork),

    {"", "frames per cycle", "", {1, 1}, {}, "", ""},
    {"", "lag", "frames", {0, 0}, {}, "", ""},
    told ("no-trigger",
        "connect the trigger output of the DMD to the input that the camera's "
        "TriggerSource names, and check the plugs of the cable"),
    told ("no-frames", "run the checks of the parts and the trigger"),
    told ("free-running",
        "set TriggerMode=On, TriggerSelector=FrameStart and the TriggerSource "
        "of the cable"),
    told ("half-rate",
        "shorten the exposure time of the camera, until exposure and readout "
        "fit the frame period, and set AcquisitionFrameRateEnable=false"),
    told ("double-rate",
        "set TriggerActivation=RisingEdge, and the trigger divider to the "
        "number of pulses in a cycle"),
    told ("frame-late", "switch off frame buffers of the camera, such as its "
                        "burst or sequence mode"),
    told ("frame-late-varies",
        "set StreamBufferHandlingMode=OldestFirst, and connect the camera "
        "without a switch"),
    told ("trigger-edge",
        "choose the other edge with TriggerActivation, or the other level of "
        "the pulse with pulse=low in the options of the DMD"),
    {"exposure-late", "delay", "us", most (400), most (700), "",
        "set TriggerDelay of the camera to 0, and switch off its debouncer"},
    {"", "exposure", "us", {}, {}, "", ""},
    {"", "last row against the first", "us", {}, {}, "", ""},
    told ("test-image", "set TestPattern=Off"),
    told ("auto-gain", "set GainAuto=Off"),
    told ("auto-exposure", "set ExposureAuto=Off"),
    told ("gamma", kStraight),
    told ("lut", kStraight),
    told ("binning",
        "set BinningHorizontal, BinningVertical and the decimation "
        "to 1, or use a lens of that magnification"),
    told ("rate-limit", "set AcquisitionFrameRateEnable=false"),
    {"", "end of the exposure, from that of the frame period", "us",
        {-600, 400}, {-900, 700}, "", ""},
    told ("exposure-short",
        "set a longer ExposureTime, or give the schedule as much readout time"),
    told ("exposure-long", "set ExposureTime to the frame period less the "
                           "readout of the camera"),
    {"jitter", "jitter", "us", most (25), most (60),
        "from frame to frame, the exposure begins earlier or later by {} us "
        "rms",
        "use the opto-isolated or the direct input of the camera that is "
        "specified for triggers, and switch off its debouncer"},
    told ("missing-bits",
        "set the pixel format to the number of bits that the sensor delivers"),

    {"dark", "level", "%", {40, kAny}, {15, kAny},
        "with all mirrors on, the brightest pixels reach {} % of the range",
        "switch on the light or increase it, open the iris, and check that the "
        "camera sees mirrors that are on"},
    {"bright", "saturated pixels", "%", most (1), most (5),
        "with all mirrors on, {} % of the pixels are saturated",
        "reduce the light or the iris until the brightest pixels are at 80 % "
        "of the range"},
    {"vignetting", "light lost in a corner", "%", most (25), most (40),
        "the darkest corner has {} % less light than the centre",
        "centre the light on the DMD, and check that no iris or mount cuts the "
        "beam"},
    {"flicker", "flicker", "%", most (1), most (2), "",
        "drive the light with a constant current, without mains ripple or PWM"},
    {"drift", "drift", "%/min", within (2), within (5),
        "the light changes by {} % a minute",
        "wait until the light is warm, and drive it with a constant current"},

    {"pulsed", "light of a pulse", "us", most (2.5), most (2.5),
        "the light of some milliseconds changes by that of {} us: the lamp is "
        "switched on and off",
        "dim the lamp by its current instead of pulses, or by a grey filter"},
    // Where the camera mixes 3x3 pixels, noise makes 9 of it.
    {"moving", "change of the picture", "times that of noise", most (10),
        most (10),
        "the same mask does not make the same picture again: it changes by {} "
        "times the squares of noise",
        "see that neither target nor bench moves"},
    {"colour", "light that one of 2x2 pixels lacks", "%", most (5), most (5),
        "of four neighbouring pixels, one always has {} % less light than "
        "another: each sees one colour only",
        "use the monochrome model of this camera"},
    {"", "noise that neighbours share", "%", within (2), within (2), "", ""},
    {"", "noise shared with the frame before", "%", within (5), within (5), "",
        ""},
    {"texture", "texture", "%", most (1), most (1),
        "the target is not even: neighbouring places differ by {} %",
        "place a plain target, somewhat out of focus"},
    told ("noise-reduction", "switch off noise reduction, interpolation and "
                             "every other filter of the camera"),
    told ("sharpening",
        "switch off sharpening and every other filter of the camera"),
    told ("low-bits", "set the pixel format to the number of bits that the "
                      "sensor delivers, such as Mono12"),

    {"noise", "read noise", "e-", most (20), most (kAny),
        "the read noise is {} e-, where cameras of this kind have 2 to 15 e-",
        "switch off noise reduction and other processing in the camera, and "
        "use a mode with a slower readout or a higher analog gain"},
    {"nonlinear", "linearity error", "% of the range", most (1), most (2),
        "pixel values differ by up to {} % of the range from a straight line",
        kStraight},
    {"prnu", "PRNU", "%", most (2), most (10),
        "the sensitivity of neighbouring pixels differs by {} % (standard "
        "deviation)",
        "switch on the flat-field correction of the camera, or replace it"},
    {"black-clipped", "", "%", most (1), most (3),
        "{} % of the dark pixel values are 0, where noise is cut off",
        "raise BlackLevel until no dark pixel is 0"},
    told (
        "dead-pixels", "clean the window of the sensor, or replace the camera"),
    told ("hot-pixels",
        "cool the camera or shorten the exposure; defect correction of the "
        "camera may hide them, but mixes neighbours"),

    {"leak", "off-state leakage", "%", most (1.5), most (2),
        "mirrors that are off pass {} % of the light",
        "block the light of the off direction with a trap, stop down the lens, "
        "and look for stray light and reflections between lens and window"},
    {"black-clamp", "fall of the black level", "% of the light", most (0.2),
        most (0.2),
        "with light on half of the mirrors, pixels of the other half fall "
        "below "
        "their value in the dark, by {} % of the light: the camera moves its "
        "black level",
        "set BlackLevelAuto=Off, and switch off every clamp of the black "
        "level"},
    {"slow-mirrors", "switching time", "us", most (100), most (200),
        "the light takes {} us to go off, where mirrors need less than 20 us",
        "check that nothing else shutters the light, such as a pulsed lamp or "
        "a liquid crystal; give the schedule that much switching time"},
    told ("stuck-off", kStuck),
    told ("stuck-on", kStuck),
    told ("no-picture", "let light of the mirrors reach the camera"),

    {"rotation", "", "degrees", within (0.8), within (1.5),
        "the camera is rotated against the mirrors by {} degrees",
        "rotate it back; gst-launch-1.0 with moirecalib or codedexposure "
        "calibrate show it live"},
    {"scale", "", "%", within (2), within (4), "",
        "change the distance of lens and camera until a mirror covers as much, "
        "and focus again"},
    {"", "perspective in x", "%", within (0.6), {}, "", ""},
    {"", "perspective in y", "%", within (0.6), {}, "", ""},
    {"perspective", "", "%", most (0.6), most (1.2), "",
        "tilt the camera about the vertical and the horizontal axis until "
        "opposite borders look the same"},
    {"distortion", "distortion", "%", within (0.5), within (1),
        "the lens shifts the corners by {} % of their distance from the centre",
        "use a lens with less distortion, or decode with the mapping, which "
        "has it"},
    {"mapping", "Gray codes against gratings", "mirrors", most (0.1),
        most (kAny), "the Gray codes and the gratings differ by {} mirrors",
        kMapping},
    {"blur", "blur", "pixels", most (0.95), most (1.4),
        "mirrors are blurred by {} pixels (standard deviation)",
        "focus the lens on the mirrors; open and close its aperture to see "
        "whether it is the lens"},
    {"focus-tilt", "growth of the blur over the frame", "pixels", most (0.6),
        most (1.2), "",
        "tilt the camera (or the relay lens) so that this side comes closer; "
        "if the blur grows, tilt it the other way: one picture does not tell "
        "which side of the focus it is"},
    {"shift", "pixels that see a mirror", "%", {97, kAny}, {90, kAny}, "",
        "move the camera until its centre looks at that of the array"},
    told ("field", "set the region of the camera to where mirrors are seen"),
    {"dust", "", "%", most (0), most (1), "",
        "blow dust off the window of the DMD, the lens and the sensor"},

    told ("second-trigger",
        "connect the trigger output of the DMD to both cameras, and set "
        "TriggerMode=On and the same TriggerSource and TriggerActivation"),
    told ("second-frame-late",
        "set both cameras alike: StreamBufferHandlingMode, burst and sequence "
        "modes"),
    {"second-arrival", "arrival of the second camera's frames",
        "% of a period later", within (15), within (20),
        "frames of the second camera arrive {} % of a period later than those "
        "of the first, and pairs are missed from 25 % on",
        "connect both cameras alike, with the same pixel format and packet "
        "size"},
    {"second-late", "start of the second camera's exposure", "us", within (400),
        within (1000),
        "the exposure of the second camera begins {} us after that of the "
        "first one",
        "set TriggerDelay and TriggerActivation of both cameras alike"},
    {"second-short", "exposure of the second camera is shorter by", "us",
        within (600), within (1500),
        "the exposure of the second camera is {} us shorter than that of the "
        "first one",
        "set ExposureTime of both cameras alike"},
    {"second-bright", "saturated pixels of the second camera", "%", most (1),
        most (5),
        "with all mirrors off, {} % of the second camera's pixels "
        "are saturated",
        "lower the gain of the second camera, or stop its lens down"},
    {"second-dark", "level of the second camera", "%", {40, kAny}, {15, kAny},
        "with all mirrors off, the second camera reaches {} % of its range",
        "raise the gain of the second camera or open its lens, and check that "
        "it looks into the beam of the mirrors that are off"},
    {"second-shift", "mirrors of the first camera that the second sees", "%",
        {93, kAny}, {80, kAny},
        "of the mirrors that the first camera sees, the second one sees {} %",
        "move the second camera until it looks at the same mirrors; "
        "codedexposure calibrate --second shows where they are"},

    told ("slip", "check the trigger cable for a loose contact, and its level"),
    told (
        "frame-jitter", "stop other programs that use the network or the disk"),
    {"slots-differ", "largest difference of a slot", "", within (0.02),
        within (0.1), "",
        "check that nothing moves or flickers; where a slot has only a few "
        "DN, use fewer slots, more light or more bits"},
    {"slot-cut", "light that a slot loses", "%", most (10), most (kAny), "",
        "use a schedule with fewer slots, give it a readout time, or set "
        "TriggerDelay of the camera to 0"},
};

constexpr Rule kNone = told ("", "");

} // namespace

const Rule &
rule_of (std::string_view name)
{
  const auto is_named = [name] (const Rule &rule) {
    return name == rule.reading || name == rule.id;
  };
  const auto found = std::ranges::find_if (kRules, is_named);
  return found == std::end (kRules) ? kNone : *found;
}

} // namespace codedexposure
