/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The DLP3000 driver: its bytes, and an emulated board as a server on this
 * machine. */
#include "dmd/bitmap.h"
#include "dmd/drivers.h"
#include "dmd/lightcrafter_protocol.h"
#include "dmd/plane_image.h"
#include "dmd_rig.h"
#include "hex.h"
#include "lightcrafter_server.h"
#include "mirrors.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

using lightcrafter::encode_message;
using lightcrafter::PacketType;

std::string
packet (PacketType type, std::uint16_t command, const Bytes &payload)
{
  return to_hex (encode_message (type, command, payload));
}

/** switching is the time that the board needs between two masks. */
const char *const kPreset = "sequential:2x2,switching=250us";

Result<std::unique_ptr<Dmd>>
open (const LightcrafterServer &server, const std::string &options = "")
{
  return open_lightcrafter (
      "lightcrafter:127.0.0.1:" + std::to_string (server.port ()) +
      ",guard=off" + options);
}

} // namespace

TEST (LightcrafterBytes, AreThoseOfTheDocument)
{
  using namespace lightcrafter;
  const auto write = [] (std::uint16_t command, const Bytes &payload) {
    return packet (PacketType::write, command, payload);
  };
  EXPECT_EQ (
      packet (PacketType::read, kVersion, {0}), "04 01 00 00 01 00 00 06");
  EXPECT_EQ (write (kDisplayMode, {kModeSequence}), "02 01 01 00 01 00 04 09");
  EXPECT_EQ (write (kRun, {1}), "02 04 02 00 01 00 01 0A");
  EXPECT_EQ (write (kRun, {0}), "02 04 02 00 01 00 00 09");
  EXPECT_EQ (write (0x0403, {}), "02 04 03 00 00 00 09");
  EXPECT_EQ (write (0x0405, {3, 0}), "02 04 05 00 02 00 03 00 10");
  EXPECT_EQ (write (kCameraTrigger, encode_camera_trigger (true, 100)),
      "02 04 04 00 0B 00 01 00 00 00 00 00 00 64 00 00 00 7A");
  EXPECT_EQ (write (kSequence, encode_sequence ({.patterns = 24,
                                                    .trigger = Trigger::rising,
                                                    .exposure = 250},
                                   19)),
      "02 04 80 00 13 00 01 18 00 00 02 00 00 00 00 00 00 00 00 FA 00 00 00 01 "
      "01 B0");
  const Sequence timed{.patterns = 24, .period = 500, .exposure = 250};
  EXPECT_EQ (write (kSequence, encode_sequence (timed, 19)),
      "02 04 80 00 13 00 01 18 00 00 01 00 00 00 00 F4 01 00 00 FA 00 00 00 01 "
      "01 A4");
  EXPECT_EQ (write (kSequenceOld, encode_sequence (timed, 18)),
      "02 04 00 00 12 00 01 18 00 01 00 00 00 00 F4 01 00 00 FA 00 00 00 01 01 "
      "23");
}

TEST (LightcrafterBytes, AMaskIsOnePacket)
{
  const Image<std::uint8_t> mirrors (608, 684);
  Bytes payload{0};
  append (payload, encode_bitmap (rows_of (mirrors)));
  ASSERT_LE (payload.size (), 0xFFFFu);
  const Bytes packet = encode_message (PacketType::write, 0x0401, payload);
  EXPECT_EQ (
      to_hex (ByteView (packet).first (9)), "02 04 01 00 4F CB 00 42 4D");
  EXPECT_TRUE (lightcrafter::checksum_holds (packet));
}

TEST (PlaneBitmap, HasThePlanesInTheChannelsOfTheController)
{
  // Plane 0 is the lowest green bit, 8 red, 16 blue; rows are 2 + 2 bytes.
  PlaneImage planes (1, 2);
  planes.at (0, 0) = 1 << 0 | 1 << 9;
  planes.at (0, 1) = 1 << 18;
  const Bytes file = encode_plane_bitmap (rows_of (planes));
  ASSERT_EQ (file.size (), 54u + 2 * 4);
  EXPECT_EQ (to_hex (ByteView (file).first (2)), "42 4D");
  EXPECT_EQ (to_hex (ByteView (file).subspan (54)), "04 00 00 00 00 01 02 00");
}

TEST (LightcrafterReply, WrongOnesAreErrors)
{
  using lightcrafter::parse_head;
  const auto head = parse_head (from_hex ("03 04 02 00 05 01"));
  ASSERT_TRUE (head.ok ());
  EXPECT_EQ (head->command, 0x0402);
  EXPECT_EQ (head->payload, 0x105u);
  EXPECT_FALSE (parse_head (from_hex ("02 04 02 00 00 00")).ok ());
  EXPECT_FALSE (parse_head (from_hex ("09 04 02 00 00 00")).ok ());
  EXPECT_FALSE (parse_head (from_hex ("03 04 02 00 00")).ok ());
  EXPECT_FALSE (lightcrafter::checksum_holds ({}));
}

class LightcrafterLayouts : public ::testing::TestWithParam<const char *>
{
};

TEST_P (LightcrafterLayouts, MasksArriveMirrorByMirror)
{
  LightcrafterServer server;
  const Schedule schedule = schedule_of (kPreset);
  auto dmd = open (server, std::string (",layout=") + GetParam ());
  ASSERT_EQ (message_of (dmd), "");
  ASSERT_EQ (message_of ((*dmd)->upload (schedule, {}, ignore_progress)), "");
  ASSERT_EQ (message_of ((*dmd)->start (plan_of (schedule))), "");
  EXPECT_TRUE (server.running ());
  const auto masks = server.masks ();
  ASSERT_EQ (masks.size (), 4u);
  Image<std::uint8_t> expected (608, 684);
  for (const auto &[index, mirrors] : masks) {
    expected_mask (
        schedule, index, expected.view (), {*parse_layout (GetParam ()), {}});
    EXPECT_TRUE (mirrors == expected) << index;
  }
  dmd->reset ();
  EXPECT_FALSE (server.running ());
}

INSTANTIATE_TEST_SUITE_P (
    All, LightcrafterLayouts, ::testing::Values ("address", "lattice", "cell"));

TEST (Lightcrafter, AsMasterPulsesOnceAMask)
{
  LightcrafterServer server;
  auto dmd = open (server);
  ASSERT_EQ (message_of (dmd), "");
  EXPECT_TRUE ((*dmd)->info ().triggers_camera);
  EXPECT_EQ ((*dmd)->info ().minimum_switching, 250'000);
  const Schedule schedule = schedule_of (kPreset);
  ASSERT_EQ (message_of ((*dmd)->upload (schedule, {}, ignore_progress)), "");
  ASSERT_EQ (message_of ((*dmd)->start (plan_of (schedule))), "");
  // 4 masks on a timer of 10000 us, each for 9750 us, for ever.
  EXPECT_EQ (to_hex (server.setting ()),
      "01 04 00 00 01 00 00 00 00 10 27 00 00 16 26 00 00 01 01");
  EXPECT_EQ (to_hex (server.camera ()), "01 00 00 00 00 00 00 64 00 00 00");
}

/* The setting of a sequence comes before its masks, in protocol 4.7. */
TEST (Lightcrafter, OtherTimesTakeTheMasksOnceMore)
{
  LightcrafterServer server;
  auto dmd = open (server);
  ASSERT_EQ (message_of (dmd), "");
  const Schedule schedule = schedule_of (kPreset);
  ASSERT_EQ (message_of ((*dmd)->upload (schedule, {}, ignore_progress)), "");
  for (const FrameRate rate :
      {FrameRate{25, 1}, FrameRate{25, 1}, FrameRate{20, 1}}) {
    ASSERT_EQ (message_of ((*dmd)->start (plan_of (schedule, rate))), "");
    EXPECT_TRUE (server.running ());
    EXPECT_EQ (server.masks ().size (), 4u);
    (*dmd)->stop ();
  }
  EXPECT_EQ (server.masks_received (), 12) << "not again for the same times";
}

TEST (Lightcrafter, WithTheCameraAsMasterAnEdgeStepsTheMask)
{
  LightcrafterServer server;
  auto dmd = open (server, ",master=camera,edge=falling");
  ASSERT_EQ (message_of (dmd), "");
  const Schedule schedule =
      schedule_of ("sequential:2x2,switching=250us,readout=1ms");
  ASSERT_EQ (message_of ((*dmd)->upload (schedule, {}, ignore_progress)), "");
  ASSERT_EQ (message_of ((*dmd)->start (plan_of (schedule))), "");
  EXPECT_EQ (server.setting ().at (4), 3);
  EXPECT_EQ (server.camera ().at (0), 0);
}

TEST (Lightcrafter, OlderFirmwareGetsOlderForms)
{
  for (const bool repeat : {true, false}) {
    LightcrafterServer server ({.knows_0480 = false, .wants_repeat = repeat});
    auto dmd = open (server);
    ASSERT_EQ (message_of (dmd), "");
    EXPECT_EQ (message_of (
                   (*dmd)->upload (schedule_of (kPreset), {}, ignore_progress)),
        "");
    EXPECT_EQ (server.setting ().size (), repeat ? 18u : 17u);
  }
}

TEST (Lightcrafter, ABusyBoardIsAskedAgain)
{
  LightcrafterServer server ({.busy_replies = 1});
  auto dmd = open (server);
  ASSERT_EQ (message_of (dmd), "");
  EXPECT_EQ (
      message_of ((*dmd)->upload (schedule_of (kPreset), {}, ignore_progress)),
      "");
  EXPECT_EQ (server.masks ().size (), 4u);
}

TEST (Lightcrafter, AnUploadThatWaitsIsCancelledAndCanBeRepeated)
{
  LightcrafterServer server ({.silent_after = 2});
  auto dmd = open (server);
  ASSERT_EQ (message_of (dmd), "");
  std::stop_source stop;
  const auto cancelled = (*dmd)->upload (
      schedule_of (kPreset), stop.get_token (), [&] (int sent, int) {
        if (sent == 2)
          stop.request_stop ();
      });
  EXPECT_FALSE (cancelled.ok ());
  EXPECT_FALSE ((*dmd)->start (plan_of (schedule_of (kPreset))).ok ());
}

TEST (Lightcrafter, ABoardThatHangsUpIsOneClearError)
{
  LightcrafterServer server ({.close_after = 1});
  auto dmd = open (server);
  ASSERT_EQ (message_of (dmd), "");
  EXPECT_EQ (
      message_of ((*dmd)->upload (schedule_of (kPreset), {}, ignore_progress)),
      "lightcrafter:127.0.0.1: cannot send a mask: the board closed the "
      "connection");
}

TEST (Lightcrafter, AWrongChecksumIsAnError)
{
  LightcrafterServer server ({.wrong_checksum = true});
  EXPECT_EQ (message_of (open (server)),
      "lightcrafter:127.0.0.1: cannot read its version: the checksum of a "
      "reply is wrong");
}

TEST (Lightcrafter, AfterAByteTooManyTheNextUploadSucceeds)
{
  LightcrafterServer server ({.stray_byte_after = 2});
  auto dmd = open (server);
  ASSERT_EQ (message_of (dmd), "");
  const Schedule schedule = schedule_of (kPreset);
  EXPECT_EQ (message_of ((*dmd)->upload (schedule, {}, ignore_progress)),
      "lightcrafter:127.0.0.1: cannot send a mask: a packet of type 85 is not "
      "one that the board sends");
  ASSERT_EQ (message_of ((*dmd)->upload (schedule, {}, ignore_progress)), "");
  ASSERT_EQ (message_of ((*dmd)->start (plan_of (schedule))), "");
  EXPECT_TRUE (server.running ());
  (*dmd)->stop ();
  EXPECT_FALSE (server.running ());
}

TEST (Lightcrafter, ABoardThatRefusesToStartDoesNotRun)
{
  LightcrafterServer server ({.refuses_start = true});
  auto dmd = open (server);
  ASSERT_EQ (message_of (dmd), "");
  const Schedule schedule = schedule_of (kPreset);
  ASSERT_EQ (message_of ((*dmd)->upload (schedule, {}, ignore_progress)), "");
  EXPECT_NE (message_of ((*dmd)->start (plan_of (schedule))), "");
  EXPECT_FALSE ((*dmd)->running ());
}

TEST (Lightcrafter, ANameIsNotLookedUp)
{
  EXPECT_EQ (message_of (open_lightcrafter ("lightcrafter:board.invalid")),
      "lightcrafter:board.invalid: 'board.invalid' is no IP address; write one "
      "such as 192.168.1.100");
}

TEST (Lightcrafter, NobodyThereIsAnError)
{
  int port = 0;
  {
    LightcrafterServer server;
    port = server.port ();
  }
  const auto dmd =
      open_lightcrafter ("lightcrafter:127.0.0.1:" + std::to_string (port));
  EXPECT_NE (message_of (dmd).find ("Connection refused"), std::string::npos)
      << message_of (dmd);
  for (const char *wrong : {"lightcrafter:a:0", "lightcrafter:a:b",
           "lightcrafter:a:1:2", "lightcrafter:a,master=me"})
    EXPECT_FALSE (open_lightcrafter (wrong).ok ()) << wrong;
}
