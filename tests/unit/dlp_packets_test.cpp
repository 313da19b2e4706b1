/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The bytes of requests to DLPC350 and DLPC900, and the parsing of replies. */
#include <algorithm>
#include <functional>

#include <gtest/gtest.h>

#include "dmd/dlpc350_protocol.h"
#include "dmd/dlpc900_protocol.h"
#include "emulation/spld_decoder.h"
#include "hex.h"
#include "mirrors.h"

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::emulated;

namespace
{

/** The bytes of a request, without the zeros of its last packet. */
std::string
request (HidKind kind, int sequence, const HidCommand &command, Bytes data)
{
  const Bytes packets =
      encode_request (kind, std::uint8_t (sequence), command.word, data);
  return packet_hex (packets, data.size () + 6);
}

std::string
write (int sequence, const HidCommand &command, Bytes data)
{
  return request (HidKind::write, sequence, command, std::move (data));
}

std::string
read (int sequence, const HidCommand &command)
{
  return request (HidKind::read, sequence, command, {});
}

Bytes
reply_packet (const std::string &head)
{
  Bytes packet = from_hex (head);
  packet.resize (kHidPacketSize);
  return packet;
}

/** One plane lit everywhere, all others dark. */
PlaneImage
uniform_image (int width, int height, PlanePixel pixel)
{
  PlaneImage image (width, height);
  for (int y = 0; y < height; y++)
    std::fill_n (image.view ().row (y), width, pixel);
  return image;
}

} // namespace

TEST (HidRequest, FillsWholePacketsWithZeros)
{
  for (const std::size_t data : {0u, 57u, 58u, 59u, 122u, 123u, 506u}) {
    const Bytes packets =
        encode_request (HidKind::write, 1, 0x1A34, Bytes (data, 0xFF));
    EXPECT_EQ (packets.size (), (6 + data + 63) / 64 * 64);
    EXPECT_EQ (std::count (packets.begin () + 6, packets.end (), 0xFF),
        std::ptrdiff_t (data));
    EXPECT_EQ (read_le (packets, 2, 2), data + 2);
  }
}

TEST (HidReply, IsParsedFieldByField)
{
  const auto head = parse_reply_head (reply_packet ("C0 07 04 00 01 02 03 04"));
  ASSERT_TRUE (head.ok ());
  EXPECT_EQ (head->sequence, 7);
  EXPECT_FALSE (head->refused);
  EXPECT_EQ (head->length, 4u);
  EXPECT_EQ (head->packets (), 1u);
}

TEST (HidReply, Bit5OfTheFirstByteIsARefusal)
{
  EXPECT_TRUE (parse_reply_head (reply_packet ("60 07 00 00"))->refused);
  EXPECT_FALSE (
      parse_reply_head (reply_packet ("40 07 01 00 00 00 20"))->refused);
}

TEST (HidReply, LongOnesComeInMorePackets)
{
  EXPECT_EQ (parse_reply_head (reply_packet ("C0 01 3C 00"))->packets (), 1u);
  EXPECT_EQ (parse_reply_head (reply_packet ("C0 01 3D 00"))->packets (), 2u);
  EXPECT_EQ (parse_reply_head (reply_packet ("C0 01 80 00"))->packets (), 3u);
}

TEST (HidReply, WrongOnesAreErrors)
{
  EXPECT_FALSE (parse_reply_head (Bytes (63, 0)).ok ());
  EXPECT_FALSE (parse_reply_head ({}).ok ());
  EXPECT_TRUE (parse_reply_head (reply_packet ("C0 01 FC 01")).ok ());
  EXPECT_FALSE (parse_reply_head (reply_packet ("C0 01 FD 01")).ok ());
}

TEST (Dlpc350Bytes, AreThoseOfTheDocument)
{
  using namespace dlpc350;
  EXPECT_EQ (read (1, kVersion), "C0 01 02 00 05 02");
  EXPECT_EQ (read (2, kHardwareStatus), "C0 02 02 00 0A 1A");
  EXPECT_EQ (read (2, kMainStatus), "C0 02 02 00 0C 1A");
  EXPECT_EQ (write (0x13, kRun, {kRunStop}), "40 13 03 00 24 1A 00");
  EXPECT_EQ (write (0x13, kRun, {kRunStart}), "40 13 03 00 24 1A 02");
  EXPECT_EQ (write (2, kDisplayMode, {kModePattern}), "40 02 03 00 1B 1A 01");
  EXPECT_EQ (write (3, kSource, {std::uint8_t (Source::flash)}),
      "40 03 03 00 22 1A 03");
  EXPECT_EQ (write (3, kSource, {std::uint8_t (Source::video)}),
      "40 03 03 00 22 1A 00");
  EXPECT_EQ (write (4, kConfigure, encode_configuration (24, 24, 1)),
      "40 04 06 00 31 1A 17 01 17 00");
  EXPECT_EQ (
      write (5, kTriggerMode, {std::uint8_t (TriggerMode::timer_or_input)}),
      "40 05 03 00 23 1A 01");
  EXPECT_EQ (write (6, kTimes, encode_times ({235, 0})),
      "40 06 0A 00 29 1A EB 00 00 00 EB 00 00 00");
  EXPECT_EQ (write (6, kTimes, encode_times ({1000, 230})),
      "40 06 0A 00 29 1A E8 03 00 00 CE 04 00 00");
  EXPECT_EQ (write (7, kMailbox, {kMailboxImages}), "40 07 03 00 33 1A 01");
  EXPECT_EQ (write (8, kMailboxOffset, {0}), "40 08 03 00 32 1A 00");
  EXPECT_EQ (write (9, kMailboxData, {0}), "40 09 03 00 34 1A 00");
  EXPECT_EQ (write (10, kMailbox, {kMailboxClosed}), "40 0A 03 00 33 1A 00");
  EXPECT_EQ (write (11, kMailbox, {kMailboxPatterns}), "40 0B 03 00 33 1A 02");
  EXPECT_EQ (write (0x11, kValidate, {0}), "40 11 03 00 1A 1A 00");
  EXPECT_EQ (read (0x12, kValidate), "C0 12 02 00 1A 1A");
  EXPECT_EQ (write (0x14, kPower, {kPowerNormal}), "40 14 03 00 00 02 00");
  EXPECT_EQ (write (0x16, kTriggerOut2, encode_pulse (false, 0)),
      "40 16 04 00 1E 1A 00 BB");
  EXPECT_EQ (write (0x16, {0x1A1D, ""}, {0, 0xBB, 0xBB}),
      "40 16 05 00 1D 1A 00 BB BB");
  EXPECT_EQ (
      write (0x16, kTriggerIn1, {0, 0, 0, 0}), "40 16 06 00 35 1A 00 00 00 00");
}

TEST (Dlpc350Bytes, OfCommandsThatTheDriverDoesNotUse)
{
  using namespace dlpc350;
  EXPECT_EQ (read (2, {0x1A0B, ""}), "C0 02 02 00 0B 1A");
  EXPECT_EQ (write (0x13, kRun, {1}), "40 13 03 00 24 1A 01");
  EXPECT_EQ (write (2, kDisplayMode, {0}), "40 02 03 00 1B 1A 00");
  EXPECT_EQ (write (5, kTriggerMode, {std::uint8_t (TriggerMode::video)}),
      "40 05 03 00 23 1A 00");
  EXPECT_EQ (write (14, kMailbox, {kMailboxClosed}), "40 0E 03 00 33 1A 00");
  EXPECT_EQ (write (0x14, kPower, {1}), "40 14 03 00 00 02 01");
  EXPECT_EQ (
      request (HidKind::post, 0x15, {0x0802, ""}, {}), "00 15 02 00 02 08");
}

TEST (Dlpc350Bytes, PatternEntries)
{
  using namespace dlpc350;
  EXPECT_EQ (write (0x0D, kMailboxData,
                 encode_entries ({{Trigger::timer, 0, true}, {}})),
      "40 0D 08 00 34 1A 00 71 04 00 71 00");
  EXPECT_EQ (to_hex (encode_entries ({{Trigger::timer, 1}})), "04 71 00");
  EXPECT_EQ (
      to_hex (encode_entries ({{Trigger::rising, 0, true}})), "01 71 04");
  EXPECT_EQ (to_hex (encode_entries ({{Trigger::none, 1}})), "07 71 00");
}

TEST (Dlpc350Bytes, TwentyFourEntriesTakeTwoPackets)
{
  using namespace dlpc350;
  std::vector<Entry> entries;
  for (int plane = 0; plane < 24; plane++)
    entries.push_back ({Trigger::timer, plane, plane == 0});
  EXPECT_EQ (write (0x0D, kMailboxData, encode_entries (entries)),
      "40 0D 4A 00 34 1A 00 71 04 04 71 00 08 71 00 0C 71 00 10 71 00 14 71 "
      "00 18 71 00 1C 71 00 20 71 00 24 71 00 28 71 00 2C 71 00 30 71 00 34 "
      "71 00 38 71 00 3C 71 00 40 71 00 44 71 00 48 71 00 4C 71 00 50 71 00 "
      "54 71 00 58 71 00 5C 71 00");
}

TEST (Dlpc350Verdict, ErrorsAndWarningsAreToldApart)
{
  const auto verdict = [] (std::uint8_t byte, bool triggered = false) {
    return dlpc350::parse_verdict (byte, triggered);
  };
  EXPECT_TRUE (verdict (0).good);
  EXPECT_EQ (verdict (0).text, "");
  EXPECT_TRUE (verdict (0x80).busy);
  EXPECT_TRUE (verdict (0x08).good);
  EXPECT_EQ (verdict (0x08).text, "no black before a triggered pattern");
  EXPECT_FALSE (verdict (0x08, true).good) << "the last mask stays on";
  EXPECT_FALSE (verdict (0x01).good);
  EXPECT_FALSE (verdict (0x02).good);
  EXPECT_EQ (verdict (0x11).text,
      "exposure or period is out of range; less than 230 us of dark time");
}

TEST (Dlpc900Bytes, AreThoseOfTheDocument)
{
  using namespace dlpc900;
  EXPECT_EQ (read (1, kVersion), "C0 01 02 00 05 02");
  EXPECT_EQ (read (0x12, kHardware), "C0 12 02 00 06 02");
  EXPECT_EQ (read (2, kMainStatus), "C0 02 02 00 0C 1A");
  EXPECT_EQ (read (0x12, kErrorCode), "C0 12 02 00 00 01");
  EXPECT_EQ (read (0x12, kErrorText), "C0 12 02 00 01 01");
  EXPECT_EQ (read (0x12, kMinimumExposures), "C0 12 02 00 42 1A");
  EXPECT_EQ (write (0x11, kRun, {kRunStop}), "40 11 03 00 24 1A 00");
  EXPECT_EQ (write (0x11, kRun, {kRunStart}), "40 11 03 00 24 1A 02");
  EXPECT_EQ (write (2, kDisplayMode, {kModeOnTheFly}), "40 02 03 00 1B 1A 03");
  EXPECT_EQ (write (5, kConfigure, encode_configuration (2)),
      "40 05 08 00 31 1A 02 00 00 00 00 00");
  EXPECT_EQ (write (6, kLoadImage, encode_load (0, 4372)),
      "40 06 08 00 2A 1A 00 00 14 11 00 00");
  EXPECT_EQ (write (0x12, kTriggerIn1, encode_trigger_in (105, false)),
      "40 12 05 00 35 1A 69 00 00");
  EXPECT_EQ (write (0x12, {0x1A1D, ""}, encode_trigger_out (false, 0, 0)),
      "40 12 07 00 1D 1A 00 00 00 00 00");
  EXPECT_EQ (write (0x12, {0x1A1D, ""}, encode_trigger_out (false, -20, 0)),
      "40 12 07 00 1D 1A 00 EC FF 00 00");
  EXPECT_EQ (write (0x12, kIdle, {1}), "40 12 03 00 01 02 01");
  EXPECT_EQ (write (0x12, kIdle, {0}), "40 12 03 00 01 02 00");
  EXPECT_EQ (write (0x12, kPark, {1}), "40 12 03 00 09 06 01");
  EXPECT_EQ (write (0x12, kPark, {0}), "40 12 03 00 09 06 00");
}

TEST (Dlpc900Bytes, OfCommandsThatTheDriverDoesNotUse)
{
  EXPECT_EQ (write (0x12, {0x1A40, ""}, {0, 1}), "40 12 04 00 40 1A 00 01");
  const HidCommand curtain{0x1100, ""};
  EXPECT_EQ (read (0x11, curtain), "C0 11 02 00 00 11");
  EXPECT_EQ (
      request (HidKind::post, 0x12, curtain, from_hex ("FF 01 FF 01 FF 01")),
      "00 12 08 00 00 11 FF 01 FF 01 FF 01");
}

TEST (Dlpc900Bytes, PatternEntries)
{
  using namespace dlpc900;
  EXPECT_EQ (write (3, kDefine, encode_entry ({0, {105, 0}})),
      "40 03 0E 00 34 1A 00 00 69 00 00 71 00 00 00 00 00 00");
  EXPECT_EQ (
      write (4, kDefine,
          encode_entry ({.index = 1, .time = {105, 0}, .plane = {0, 1}})),
      "40 04 0E 00 34 1A 01 00 69 00 00 71 00 00 00 00 00 08");
  EXPECT_EQ (write (3, kDefine,
                 encode_entry ({.time = {105, 0}, .wait_for_trigger = true})),
      "40 03 0E 00 34 1A 00 00 69 00 00 F1 00 00 00 00 00 00");
  EXPECT_EQ (
      write (3, kDefine,
          encode_entry ({.index = 24, .time = {105, 0}, .plane = {1, 0}})),
      "40 03 0E 00 34 1A 18 00 69 00 00 71 00 00 00 00 01 00");
  EXPECT_EQ (to_hex (encode_entry ({.index = 0x102,
                 .time = {0x123456, 0x654321},
                 .trigger_out_2 = false,
                 .plane = {17, 23}})),
      "02 01 56 34 12 71 21 43 65 01 11 B8");
}

TEST (Dlpc900Image, IsTheDocumentsPackets)
{
  using namespace dlpc900;
  const Bytes image =
      encode_image (rows_of (uniform_image (1920, 1080, 1)), 0, 1920).joined ();
  ASSERT_EQ (image.size (), 4372u);
  const Bytes first = encode_request (HidKind::post, 7, kImageData.word,
      encode_chunk (ByteView (image).first (kImageChunk)));
  ASSERT_EQ (first.size (), kHidMessageSize);
  EXPECT_EQ (to_hex (ByteView (first).first (64)),
      "00 07 FC 01 2B 1A F8 01 53 70 6C 64 80 07 38 04 E4 10 00 00 FF FF FF FF "
      "FF FF FF FF 00 00 00 00 01 02 01 00 00 01 00 00 00 00 00 00 00 00 00 00 "
      "00 00 00 00 00 00 00 00 80 0F 00 00 01 00 01 80");
  EXPECT_EQ (
      to_hex (ByteView (first).subspan (64, 8)), "0F 00 01 80 0F 00 01 80");
  const Bytes last = encode_request (HidKind::post, 0x10, kImageData.word,
      encode_chunk (ByteView (image).subspan (8 * kImageChunk)));
  EXPECT_EQ (last.size (), 6 * kHidPacketSize);
  EXPECT_EQ (to_hex (ByteView (last).first (12)),
      "00 10 58 01 2B 1A 54 01 0F 00 01 80");
  EXPECT_EQ (image_packets (image.size ()), 1u + 8 * 8 + 6);
}

namespace
{

/** Bytes of the images of a schedule on a DLP6500, of those of its masks that
 * @p wanted names. */
std::size_t
upload_bytes (
    const char *preset, const Placement &placement = {},
    const std::function<bool (int mask)> &wanted = [] (int) { return true; })
{
  const auto schedule = Schedule::parse (preset);
  PlanePlan plan = plan_planes (*schedule);
  for (int mask = 0; mask < schedule->masks (); mask++)
    if (!wanted (mask))
      plan.masks[std::size_t (mask)].image = -1;
  std::size_t bytes = 0;
  for (int image = 0; image < plan.images; image++)
    bytes += dlpc900::encode_image (
        rendered_planes (*schedule, plan, image, {1920, 1080}, placement), 0,
        1920)
                 .size;
  return bytes;
}

Placement
region_of (const char *text)
{
  return {.region = *parse_region (text)};
}

} // namespace

TEST (Dlpc900Image, SizesAreThoseOfTheDocumentation)
{
  EXPECT_EQ (upload_bytes ("sequential:2x2"), 6'220'848u);
  EXPECT_EQ (upload_bytes ("sequential:2x2", region_of ("768x576+576+252")),
      1'335'512u);
  EXPECT_EQ (
      upload_bytes ("sequential:2x2", region_of ("384x288+768+396")), 338'168u);
  EXPECT_EQ (upload_bytes ("sequential:4x1"), 10'132u);
  EXPECT_EQ (upload_bytes ("sequential:1x4"), 5'452u);
  EXPECT_EQ (upload_bytes ("sequential:8x8,order=bit-reversal"), 6'233'244u);
  EXPECT_EQ (upload_bytes ("sequential:16x16,order=bit-reversal"), 6'712'348u);
  EXPECT_EQ (upload_bytes ("sequential:4x6"), 6'220'848u);
  EXPECT_EQ (
      upload_bytes ("sequential:2x2", {}, [] (int mask) { return mask == 0; }),
      3'630'596u);
  EXPECT_EQ (
      upload_bytes ("sequential:2x2", {}, [] (int mask) { return mask < 2; }),
      3'114'772u);
}

TEST (Dlpc900Image, IsPlainWhereThatIsShorter)
{
  using namespace dlpc900;
  // Literals with a header for each row: 3 * 7 + 2 against rows of 32 bytes.
  // Only widths whose rows need no padding are shorter plain.
  PlaneImage image (16, 4);
  for (int y = 0; y < 4; y++)
    for (int x = 0; x < 16; x++)
      image.at (x, y) = PlanePixel (100 * y + x);
  const PiecedBytes pieces = encode_image (rows_of (image), 0, image.width ());
  const Bytes bytes = pieces.joined ();
  EXPECT_EQ (bytes[25], 0);
  EXPECT_EQ (bytes.size (), 48u + 16 * 4 * 3);
  EXPECT_EQ (bytes.size (), pieces.size);
  EXPECT_EQ (decode_spld (bytes), image);
}

TEST (Dlpc900Replies, Version)
{
  using namespace dlpc900;
  Bytes reply = from_hex ("07 00 02 04");
  reply.resize (16);
  EXPECT_EQ (parse_version (reply).text (), "4.2.7");
}

TEST (Dlpc900Replies, FirmwareThatLocksBlocksIsParkedAfterAChangeOfMode)
{
  using dlpc900::needs_park_cycle;
  EXPECT_FALSE (needs_park_cycle ({4, 0, 0})); // has no such command
  EXPECT_TRUE (needs_park_cycle ({4, 1, 3}));
  EXPECT_TRUE (needs_park_cycle ({4, 2, 0}));
  EXPECT_TRUE (needs_park_cycle ({5, 0, 0}));
  EXPECT_FALSE (needs_park_cycle ({5, 1, 0}));
}

TEST (Dlpc900Replies, ErrorsHaveTheirNames)
{
  EXPECT_EQ (dlpc900::error_text (5),
      "command not allowed in the current mode (error 5)");
  EXPECT_EQ (dlpc900::error_text (77), "error 77");
}
