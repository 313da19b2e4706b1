/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Commands, tables and images of the DLPC900 controller, as bytes. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "dmd/hid_link.h"
#include "dmd/pattern_timing.h"
#include "dmd/plane_image.h"

namespace codedexposure::dlpc900
{

using namespace dlp;

constexpr HidCommand kErrorCode{0x0100, "read the error code"};
constexpr HidCommand kErrorText{0x0101, "read the error text"};
constexpr HidCommand kIdle{0x0201, "set the idle mode"};
constexpr HidCommand kHardware{0x0206, "read the hardware type"};
constexpr HidCommand kPark{0x0609, "park the mirrors"};
constexpr HidCommand kLoadImage{0x1A2A, "announce an image"};
constexpr HidCommand kImageData{0x1A2B, "send image data"};
constexpr HidCommand kLoadSecond{0x1A2C, "announce an image's right half"};
constexpr HidCommand kSecondData{0x1A2D, "send data of the right half"};
constexpr HidCommand kConfigure{
    0x1A31, "take the pattern table", std::chrono::seconds (10)};
constexpr HidCommand kReorder{0x1A32, "set the order of patterns"};
constexpr HidCommand kDefine{0x1A34, "define a pattern"};
constexpr HidCommand kMinimumExposures{0x1A42, "read the min exposures"};

constexpr std::uint8_t kModeOnTheFly = 3;
/** Image bytes in one message, after flags, command and their count. */
constexpr std::size_t kChunkHead = 8;
constexpr std::size_t kImageChunk = kHidMessageSize - kChunkHead;
/** Bytes of these replies. */
constexpr std::size_t kMinimumExposuresSize = 16; // 8 depths, the binary first

/** One line of the pattern table. Exposure and dark time are below 2^24 us. */
struct Entry {
  std::uint16_t index = 0;
  PatternTime time = {};
  bool wait_for_trigger = false;
  bool trigger_out_2 = true;
  PlaneSlot plane = {};
};
Bytes encode_entry (const Entry &entry);

/** Repeated until it is stopped. */
Bytes encode_configuration (int entries);
/** The same, with entry order[k] in place k. */
Bytes encode_order (const std::vector<int> &order);

/** Delays of a trigger output from the exposure, -20..20000 us. */
Bytes encode_trigger_out (bool invert, int rising_us, int falling_us);
/** @p delay_us  the min exposure of a binary mask or more. */
Bytes encode_trigger_in (int delay_us, bool falling);

/** What the device gets for columns [x, x + width) of an image: a header and
 * the encoded pixels, or plain pixels if these are fewer. */
PiecedBytes encode_image (
    const MirrorRows<PlanePixel> &image, int x, int width);
/** Data of kLoadImage for an image of @p size encoded bytes. */
Bytes encode_load (int index, std::size_t size);
/** Data of one kImageData with at most kImageChunk bytes. */
Bytes encode_chunk (ByteView bytes);
/** Packets of an image of @p size encoded bytes and its announcement. A
 * full-speed interrupt endpoint takes one in 1 ms. */
std::size_t image_packets (std::size_t size);

/** The meaning of the error code that follows a refusal. */
std::string error_text (std::uint8_t code);

struct Version {
  int major = 0;
  int minor = 0;
  int patch = 0;
  bool operator== (const Version &) const = default;
  std::string text () const;
};
/** The version of the application, the first of the four in a version reply of
 * kVersionSize bytes. */
Version parse_version (ByteView data);

/** Whether a change of mode can leave a block of mirrors locked until they are
 * parked and released (data sheet errata, DLPT028). */
bool needs_park_cycle (const Version &version);

} // namespace codedexposure::dlpc900
