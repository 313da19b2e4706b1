/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Bench profiles as files. */
#pragma once

#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "setup/bench_profile.h"

namespace codedexposure::test
{

/** The file of a profile, as long as this lives. */
class BenchFile
{
public:
  explicit BenchFile (const BenchProfile &profile)
      : path_ (
            testing::TempDir () + "bench-" +
            testing::UnitTest::GetInstance ()->current_test_info ()->name () +
            ".json")
  {
    const auto saved = profile.save (path_);
    EXPECT_TRUE (saved.ok ()) << saved.error ().message;
  }
  ~BenchFile () { std::remove (path_.c_str ()); }
  BenchFile (const BenchFile &) = delete;
  BenchFile &operator= (const BenchFile &) = delete;

  const std::string &path () const { return path_; }

private:
  std::string path_;
};

/** Just measured, of a camera with such frames. */
inline BenchProfile
profile_of (Extent size, int bits = 8)
{
  BenchProfile profile;
  profile.measured = now_utc ();
  profile.camera.size = size;
  profile.bits = bits;
  return profile;
}

} // namespace codedexposure::test
