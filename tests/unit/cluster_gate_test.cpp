/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What passes of damaged Matroska streams. */
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "record/cluster_gate.h"

namespace
{

using namespace codedexposure;

std::string
length (std::size_t size)
{
  std::string bytes (8, '\0');
  bytes[0] = '\x01';
  for (int i = 7; i > 0; i--, size >>= 8)
    bytes[std::size_t (i)] = char (size & 0xff);
  return bytes;
}

std::string
element (const std::string &name, const std::string &content)
{
  return name + length (content.size ()) + content;
}

const std::string kUnknown = std::string ("\x01") + std::string (7, '\xff');

std::string
block (int number)
{
  std::string pixels;
  for (int i = 0; i < 500; i++)
    pixels += char ((i * 37 + number * 101) % 251);
  return element ("\xa3", pixels);
}

/* A stream, and where its clusters begin. */
struct Stream {
  std::string bytes;
  std::vector<std::size_t> begins;

  std::string cluster (std::size_t i) const
  {
    const std::size_t end = i + 1 < begins.size () ? begins[i + 1] : tail;
    return bytes.substr (begins[i], end - begins[i]);
  }
  std::size_t tail = 0; ///< cues
};

Stream
stream (int clusters, bool open)
{
  const std::string name = "\x1f\x43\xb6\x75";
  Stream made;
  made.bytes = element ("\x1a\x45\xdf\xa3", "head") + "\x18\x53\x80\x67" +
               kUnknown + element ("\x15\x49\xa9\x66", "info");
  for (int i = 0; i < clusters; i++) {
    made.begins.push_back (made.bytes.size ());
    const std::string content = element ("\xe7", std::string (1, char (i))) +
                                block (i) + block (i + 50);
    made.bytes += open ? name + kUnknown + content : element (name, content);
  }
  made.tail = made.bytes.size ();
  made.bytes += element ("\x1c\x53\xbb\x6b", "cues");
  return made;
}

std::string
through (ClusterGate &gate, const std::string &bytes, std::size_t piece)
{
  std::string passed;
  for (std::size_t at = 0; at < bytes.size (); at += piece)
    passed += gate.take (std::string_view (bytes).substr (at, piece));
  return passed;
}

class ClusterGateOf : public ::testing::TestWithParam<bool>
{
};

TEST_P (ClusterGateOf, WhatIsWholePassesBitForBit)
{
  const Stream made = stream (8, GetParam ());
  for (const std::size_t piece : {1u, 7u, 100u, 4096u, 1000000u}) {
    ClusterGate gate;
    EXPECT_EQ (through (gate, made.bytes, piece), made.bytes) << piece;
    EXPECT_EQ (gate.dropped (), 0u);
  }
}

TEST_P (ClusterGateOf, BehindGarbageTheNextClusterPasses)
{
  const Stream made = stream (8, GetParam ());
  std::mt19937 random (1);
  for (const std::size_t piece : {1u, 100u, 1000000u}) {
    std::string bytes = made.bytes;
    for (std::size_t at = made.begins[3]; at < made.begins[3] + 60; at++)
      bytes[at] = char (random ());
    ClusterGate gate;
    const std::string passed = through (gate, bytes, piece);
    const std::string before = made.bytes.substr (0, made.begins[3]);
    EXPECT_EQ (passed, before + made.bytes.substr (made.begins[4])) << piece;
    EXPECT_EQ (gate.dropped (), made.begins[4] - made.begins[3]);
  }
}

INSTANTIATE_TEST_SUITE_P (
    KnownAndUnknownSize, ClusterGateOf, ::testing::Values (false, true));

TEST (ClusterGate, ALengthThatClaimsTheRestIsFoundOut)
{
  const Stream made = stream (8, false);
  std::string bytes = made.bytes;
  bytes.replace (made.begins[3] + 4, 8, length (100'000'000));
  ClusterGate gate;
  const std::string passed = through (gate, bytes, 100);
  EXPECT_EQ (passed, made.bytes.substr (0, made.begins[3]) +
                         made.bytes.substr (made.begins[4]));
}

TEST (ClusterGate, PixelsThatAreDamagedPass)
{
  const Stream made = stream (4, false);
  std::string bytes = made.bytes;
  bytes[made.begins[2] + 200] ^= 0x10;
  ClusterGate gate;
  EXPECT_EQ (through (gate, bytes, 333), bytes);
}

TEST (ClusterGate, WhateverIsDamagedClustersBeyondItPass)
{
  const Stream made = stream (12, false);
  std::mt19937 random (2);
  for (int run = 0; run < 500; run++) {
    const std::size_t from =
        made.begins[1] + random () % (made.begins[9] - made.begins[1]);
    std::string bytes = made.bytes;
    for (std::size_t at = from; at < from + 1 + run % 700; at++)
      bytes[at] = char (random ());
    ClusterGate gate;
    const std::string passed = through (gate, bytes, 1 + random () % 2000);
    EXPECT_TRUE (passed.ends_with (made.bytes.substr (made.begins[11])))
        << "run " << run;
    for (std::size_t i = 0; i + 1 < made.begins.size (); i++)
      if (made.begins[i + 1] <= from)
        EXPECT_NE (passed.find (made.cluster (i)), passed.npos)
            << "run " << run << ", cluster " << i;
  }
}

} // namespace
