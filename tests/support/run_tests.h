/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One program holds the tests of many files; "PROGRAM extract code" runs those
 * of extract_test.cpp and code_test.cpp. */
#pragma once

#include <fnmatch.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace codedexposure::test
{

/** Whether @p name fits one of @p patterns, separated by colons. */
inline bool
fits (const std::string &name, std::string_view patterns)
{
  while (!patterns.empty ()) {
    const auto end = std::min (patterns.find (':'), patterns.size ());
    const std::string pattern (patterns.substr (0, end));
    if (fnmatch (pattern.c_str (), name.c_str (), 0) == 0)
      return true;
    patterns.remove_prefix (std::min (end + 1, patterns.size ()));
  }
  return false;
}

/** The tests of @p files that --gtest_filter chooses. */
inline std::string
tests_in (const std::vector<std::string> &files)
{
  const std::string filter = GTEST_FLAG_GET (filter);
  const auto minus = std::min (filter.find ('-'), filter.size ());
  const std::string wanted = minus == 0 ? "*" : filter.substr (0, minus);
  const std::string unwanted =
      filter.substr (std::min (minus + 1, filter.size ()));

  const auto &all = *::testing::UnitTest::GetInstance ();
  std::string found;
  for (int s = 0; s < all.total_test_suite_count (); s++) {
    const auto &suite = *all.GetTestSuite (s);
    for (int t = 0; t < suite.total_test_count (); t++) {
      const auto &test = *suite.GetTestInfo (t);
      const std::string path = test.file ();
      const std::string name = std::string (suite.name ()) + "." + test.name ();
      if (std::ranges::any_of (files,
              [&] (const std::string &file) {
                return path.ends_with ("/" + file + "_test.cpp");
              }) &&
          fits (name, wanted) && !fits (name, unwanted))
        found += name + ":";
    }
  }
  return found;
}

inline int
run_tests (int argc, char **argv)
{
  ::testing::InitGoogleTest (&argc, argv);
  if (const std::vector<std::string> files (argv + 1, argv + argc);
      !files.empty ()) {
    const std::string found = tests_in (files);
    if (found.empty ()) {
      std::fprintf (stderr, "%s: no such test\n", files[0].c_str ());
      return 2;
    }
    GTEST_FLAG_SET (filter, found);
  }
  return RUN_ALL_TESTS ();
}

} // namespace codedexposure::test
