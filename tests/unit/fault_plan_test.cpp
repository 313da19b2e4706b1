/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Faults of a camera, by frame number. */
#include <gtest/gtest.h>

#include "emulation/fault_plan.h"

using namespace codedexposure;
using Kind = Fault::Kind;

TEST (FaultPlan, EveryWordBefallsItsFrames)
{
  FaultPlan plan;
  ASSERT_TRUE (plan.add ("lose@10:3 incomplete@20  delay@21:5ms duplicate@30 "
                         "late@40 stop@50")
                   .ok ());
  EXPECT_EQ (plan.at (9).kind, Kind::none);
  for (const int frame : {10, 11, 12})
    EXPECT_EQ (plan.at (std::uint64_t (frame)).kind, Kind::lose);
  EXPECT_EQ (plan.at (13).kind, Kind::none);
  EXPECT_EQ (plan.at (20).kind, Kind::incomplete);
  EXPECT_EQ (plan.at (21).kind, Kind::delay);
  EXPECT_EQ (plan.at (21).delay, 5'000'000);
  EXPECT_EQ (plan.at (30).kind, Kind::duplicate);
  EXPECT_EQ (plan.at (40).kind, Kind::late);
  EXPECT_EQ (plan.at (50).kind, Kind::stop);
}

TEST (FaultPlan, NowIsTheNextFrame)
{
  FaultPlan plan;
  ASSERT_TRUE (plan.add ("lose@now:2", 77).ok ());
  EXPECT_EQ (plan.at (76).kind, Kind::none);
  EXPECT_EQ (plan.at (77).kind, Kind::lose);
  EXPECT_EQ (plan.at (78).kind, Kind::lose);
  EXPECT_EQ (plan.at (79).kind, Kind::none);
}

TEST (FaultPlan, TheLastOneOfAFrameCounts)
{
  FaultPlan plan;
  ASSERT_TRUE (plan.add ("lose@5:2").ok ());
  ASSERT_TRUE (plan.add ("duplicate@5").ok ());
  EXPECT_EQ (plan.at (5).kind, Kind::duplicate);
  EXPECT_EQ (plan.at (6).kind, Kind::lose);
}

TEST (FaultPlan, AnErrorNamesTheWordAndAddsNothing)
{
  for (const char *bad : {"lose", "lose@", "lose@x", "lose@-1", "lose@1:0",
           "lose@1:x", "delay@1", "delay@1:5", "duplicate@1:2", "stop@1:2",
           "explode@1", "@1", "lose@1:2:3", "lose@99999999999999999999",
           "duplicate@5", "lose@4:2"}) {
    SCOPED_TRACE (bad);
    FaultPlan plan;
    const auto added = plan.add ("lose@5 " + std::string (bad));
    ASSERT_FALSE (added.ok ());
    EXPECT_NE (added.error ().message.find (bad), std::string::npos);
    EXPECT_EQ (plan.at (5).kind, Kind::none);
  }
}
