/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Printing of untrusted text, parsing of numbers, and files of text. */
#include "base/text.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "base/file.h"

using namespace codedexposure;

TEST (Text, PrintableKeepsWhatCanBeShown)
{
  EXPECT_EQ (printable (""), "");
  EXPECT_EQ (printable ("a b~"), "a b~");
  EXPECT_EQ (printable ("h\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80"),
      "h\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80");
  EXPECT_EQ (in_quotes ("2x2"), "'2x2'");
}

TEST (Text, PrintableEscapesTheRest)
{
  EXPECT_EQ (
      printable (std::string_view ("a\0b\n\x7f", 5)), "a\\x00b\\x0a\\x7f");
  EXPECT_EQ (printable ("\xff"), "\\xff");
  EXPECT_EQ (printable ("\xc3"), "\\xc3") << "cut short";
  EXPECT_EQ (printable ("\xc3("), "\\xc3(") << "no continuation";
  EXPECT_EQ (printable ("\x80"), "\\x80") << "continuation alone";
  EXPECT_EQ (printable ("\xc0\x80"), "\\xc0\\x80") << "overlong";
  EXPECT_EQ (printable ("\xe0\x80\x80"), "\\xe0\\x80\\x80") << "overlong";
  EXPECT_EQ (printable ("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "surrogate";
  EXPECT_EQ (printable ("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80")
      << "beyond Unicode";
  EXPECT_EQ (printable ("\xc2\x85"), "\\xc2\\x85") << "control";
}

TEST (Text, PrintableIsCutBetweenCharacters)
{
  EXPECT_EQ (printable ("abcd", 4), "abcd");
  EXPECT_EQ (printable ("abcde", 4), "abcd...");
  EXPECT_EQ (printable ("abc\xc3\xa9", 4), "abc...");
  EXPECT_EQ (printable (std::string (100, 'x')), std::string (64, 'x') + "...");
}

TEST (Text, ParseIntTakesTheWholeText)
{
  EXPECT_EQ (parse_int ("0"), 0);
  EXPECT_EQ (parse_int ("-12"), -12);
  EXPECT_EQ (parse_int ("2147483647"), 2147483647);
  for (const char *text : {"", "+1", " 1", "1 ", "1.0", "0x1", "1a",
           "2147483648", "99999999999999999999"})
    EXPECT_EQ (parse_int (text), std::nullopt) << text;
}

TEST (Text, ParseRealTakesFiniteNumbers)
{
  EXPECT_EQ (parse_real ("0.25"), 0.25);
  EXPECT_EQ (parse_real ("1e-2"), 0.01);
  for (const char *text :
      {"", "nan", "inf", "1e999", "0.1x", " 0.1", "0x1p3", "1,5"})
    EXPECT_EQ (parse_real (text), std::nullopt) << text;
}

TEST (Text, RealTextParsesBack)
{
  EXPECT_EQ (real_text (0.01), "0.01");
  for (double value : {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, -2.5})
    EXPECT_EQ (parse_real (real_text (value)), value);
  EXPECT_EQ (real_text (NAN), "nan");
}

TEST (Text, SplitKeepsEmptyPieces)
{
  using Pieces = std::vector<std::string_view>;
  EXPECT_EQ (split ("", ','), (Pieces{""}));
  EXPECT_EQ (split ("a", ','), (Pieces{"a"}));
  EXPECT_EQ (split ("a,,b,", ','), (Pieces{"a", "", "b", ""}));
}

TEST (File, KeepsItsLinksAndItsMode)
{
  namespace fs = std::filesystem;
  const fs::path folder = fs::path (testing::TempDir ()) / "text_test_files";
  fs::remove_all (folder);
  fs::create_directory (folder);
  const std::string file = folder / "file", link = folder / "link",
                    loose = folder / "loose";
  constexpr auto kMode = fs::perms::owner_read | fs::perms::owner_write;
  ASSERT_TRUE (write_file (file, "first").ok ());
  fs::permissions (file, kMode);
  fs::create_symlink ("file", link);
  fs::create_symlink ("later", loose);
  ASSERT_TRUE (write_file (link, "second").ok ());
  ASSERT_TRUE (write_file (loose, "third").ok ());
  for (const auto &[path, content] : {std::pair (link, "second"),
           std::pair (file, "second"), std::pair (loose, "third"),
           std::pair ((folder / "later").string (), "third")})
    EXPECT_EQ (read_file (path, 10).value (), content) << path;
  EXPECT_TRUE (fs::is_symlink (link));
  EXPECT_TRUE (fs::is_symlink (loose));
  EXPECT_EQ (fs::status (file).permissions (), kMode);
  EXPECT_EQ (std::distance (fs::directory_iterator (folder), {}), 4);
  fs::remove_all (folder);
}
