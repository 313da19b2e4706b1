/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as replies of a board: drivers must end with a result or a
 * printable message, and must not block forever. */
#include <algorithm>

#include "dmd/drivers.h"
#include "dmd/lightcrafter_protocol.h"
#include "fuzz_check.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

/** Answers each request with the next bytes, with the correct sequence number
 * if the first of them is even; silent at their end. */
class FuzzPipe : public PacketPipe
{
public:
  explicit FuzzPipe (ByteView bytes) : bytes_ (bytes) {}

  Result<void> write (ByteView packets, Milliseconds) override
  {
    sequence_ = packets[1];
    return {};
  }
  Result<Bytes> read (Milliseconds) override
  {
    require (++reads_ < 20'000, "the driver reads for ever", "");
    if (bytes_.empty ())
      return Bytes{};
    const std::size_t length =
        std::min<std::size_t> (bytes_[0] % 80, bytes_.size () - 1);
    Bytes packet (
        bytes_.begin () + 1, bytes_.begin () + 1 + std::ptrdiff_t (length));
    if (bytes_[0] < 0xE0) { // a whole packet
      packet.resize (64);
      if (bytes_[0] % 2 == 0)
        packet[1] = sequence_;
    }
    bytes_ = bytes_.subspan (1 + length);
    return packet;
  }
  bool gone () const override { return false; }
  void pause (Milliseconds) override {}

private:
  ByteView bytes_;
  std::uint8_t sequence_ = 0;
  int reads_ = 0;
};

template <typename Open>
void
drive (Open open, const DmdOptions &options, ByteView bytes)
{
  auto dmd = open (
      std::make_unique<HidLink> (std::make_unique<FuzzPipe> (bytes), "board"),
      options);
  if (!dmd)
    return check (dmd.error ());
  check ((*dmd)->status ());
}

void
read_lightcrafter (ByteView bytes)
{
  check (lightcrafter::parse_head (
      bytes.first (std::min (bytes.size (), lightcrafter::kHeadSize))));
  if (!bytes.empty ())
    check (Error{lightcrafter::error_text (bytes[0])});
  (void)lightcrafter::checksum_holds (bytes);
}

} // namespace

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  const ByteView bytes (data, size);
  drive (open_dlpc900, {}, bytes);
  DmdOptions in_flash;
  in_flash.images = {0};
  drive (open_dlpc350, in_flash, bytes);
  read_lightcrafter (bytes);
  return 0;
}
