/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Named and written codes, and their inverses. */
#include "schedule/code.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "schedule/tile.h"

using namespace codedexposure;

namespace
{

using Rows = std::vector<std::string>;

Code
named (const char *name, int n)
{
  auto code = Code::named (name, n);
  EXPECT_TRUE (code.ok ()) << name << " " << n << ": " << code.error ().message;
  EXPECT_EQ (code->name (), name);
  EXPECT_EQ (code->elements (), n);
  EXPECT_EQ (code->slots (), n);
  return *code;
}

/** The largest element of inverse (leak) times the light that passes, less
 * one on the diagonal. */
double
worst_of_identity (const Code &code, double leak)
{
  const int n = code.elements ();
  const auto inverse = code.inverse (leak);
  EXPECT_TRUE (inverse.ok ()) << inverse.error ().message;
  if (!inverse.ok ())
    return INFINITY;
  double worst = 0.0;
  for (int slot = 0; slot < n; slot++) {
    for (int other = 0; other < n; other++) {
      double sum = slot == other ? -1.0 : 0.0;
      for (int e = 0; e < n; e++)
        sum += (*inverse)[std::size_t (slot * n + e)] *
               (code.on (e, other) ? 1.0 : leak);
      worst = std::max (worst, std::abs (sum));
    }
  }
  return worst;
}

/** Slots in which both elements are on, for every pair of rows. */
int
common_slots (const Code &code, int a, int b)
{
  int common = 0;
  for (int s = 0; s < code.slots (); s++)
    common += code.on (a, s) && code.on (b, s);
  return common;
}

} // namespace

TEST (Code, SequentialOpensElementInItsOwnSlot)
{
  EXPECT_EQ (
      named ("sequential", 4).rows (), (Rows{"1000", "0100", "0010", "0001"}));
  for (const int n : {2, 5, 16, 256}) {
    const Code code = named ("sequential", n);
    EXPECT_TRUE (code.one_hot ());
    EXPECT_EQ (code.max_on_slots (), 1);
  }
}

TEST (Code, StaircaseOpensFromTheFirstSlotOn)
{
  EXPECT_EQ (
      named ("staircase", 4).rows (), (Rows{"1000", "1100", "1110", "1111"}));
  for (const int n : {2, 5, 16, 256}) {
    const Code code = named ("staircase", n);
    EXPECT_FALSE (code.one_hot ());
    EXPECT_EQ (code.max_on_slots (), n);
    for (int e = 0; e < n; e++) {
      EXPECT_EQ (code.on_slots (e), e + 1);
      for (int s = 0; s < n; s++)
        EXPECT_EQ (code.on (e, s), s <= e);
    }
  }
}

/* S S' = (n + 1) / 4 (1 + J): every row is open in (n + 1) / 2 slots and shares
 * (n + 1) / 4 of them with every other row. */
TEST (Code, SMatrixOfAHadamardOrderLessOne)
{
  for (const int n : {3, 7, 11, 15, 19, 23, 27, 31, 35, 63, 127, 255}) {
    const Code code = named ("s-matrix", n);
    EXPECT_EQ (code.max_on_slots (), (n + 1) / 2) << n;
    for (int a = 0; a < n; a++) {
      ASSERT_EQ (code.on_slots (a), (n + 1) / 2) << n << " row " << a;
      for (int b = 0; b < a; b++)
        ASSERT_EQ (common_slots (code, a, b), (n + 1) / 4)
            << n << " rows " << a << ", " << b;
    }
  }
}

TEST (Code, InverseOfAnSMatrixIsTheKnownOne)
{
  for (const int n : {3, 7, 15, 255}) {
    const Code code = named ("s-matrix", n);
    const auto inverse = code.inverse (0.0);
    ASSERT_TRUE (inverse.ok ());
    for (int s = 0; s < n; s++)
      for (int e = 0; e < n; e++)
        ASSERT_NEAR ((*inverse)[std::size_t (s * n + e)],
            (code.on (e, s) ? 2.0 : -2.0) / (n + 1), 1e-12)
            << n;
  }
}

/* With H = 2 C - J, H H' = n: row 0 is always open, every other in n / 2 slots,
 * n / 4 of them shared with every other. */
TEST (Code, SMatrixOfAHadamardOrderIsHalfOfHPlusJ)
{
  for (const int n : {4, 8, 12, 16, 20, 28, 256}) {
    const Code code = named ("s-matrix", n);
    EXPECT_EQ (code.on_slots (0), n);
    for (int a = 1; a < n; a++) {
      ASSERT_EQ (code.on_slots (a), n / 2) << n << " row " << a;
      for (int b = 1; b < a; b++)
        ASSERT_EQ (common_slots (code, a, b), n / 4)
            << n << " rows " << a << ", " << b;
    }
  }
  EXPECT_EQ (named ("s-matrix", 2).rows (), (Rows{"11", "10"}));
  EXPECT_EQ (
      named ("s-matrix", 4).rows (), (Rows{"1111", "1001", "1100", "1010"}));
}

TEST (Code, SMatrixThatDoesNotExistNamesItsNeighbours)
{
  const auto words = [] (int n) {
    const auto code = Code::named ("s-matrix", n);
    return code.ok () ? std::string () : code.error ().message;
  };
  EXPECT_NE (words (6).find ("6 elements"), std::string::npos);
  EXPECT_NE (words (6).find ("4 and 7"), std::string::npos) << words (6);
  EXPECT_NE (words (9).find ("8 and 11"), std::string::npos) << words (9);
  EXPECT_NE (words (52).find ("48 and 55"), std::string::npos) << words (52);
  EXPECT_NE (words (254).find ("252 and 255"), std::string::npos)
      << words (254);
}

TEST (Code, SMatrixExistsWhereTheFormatsSaySo)
{
  const std::set<int> gaps{51, 52, 91, 92, 99, 100, 115, 116, 155, 156, 171,
      172, 183, 184, 187, 188, 231, 232, 235, 236, 243, 244};
  for (int n = 2; n <= Tile::kMaxElements; n++) {
    const auto code = Code::named ("s-matrix", n);
    const bool possible = n == 2 || n % 4 == 0 || n % 4 == 3;
    ASSERT_EQ (code.ok (), possible && gaps.count (n) == 0) << n;
    if (code.ok ()) {
      EXPECT_EQ (code->max_on_slots (), n % 2 != 0 ? (n + 1) / 2 : n) << n;
    }
  }
}

/* Recordings contain only the name, so its rows must never change. */
TEST (Code, NamedRowsStayAsTheyAre)
{
  EXPECT_EQ (named ("s-matrix", 3).rows (), (Rows{"110", "011", "101"}));
  EXPECT_EQ (named ("s-matrix", 7).rows (),
      (Rows{"1110100", "0111010", "0011101", "1001110", "0100111", "1010011",
          "1101001"}));

  std::uint64_t hash = 0xcbf29ce484222325; /* FNV-1a */
  for (int n = 2; n <= Tile::kMaxElements; n++)
    if (const auto code = Code::named ("s-matrix", n); code.ok ())
      for (const std::string &row : code->rows ())
        for (const char bit : row)
          hash = (hash ^ std::uint8_t (bit)) * 0x100000001b3;
  EXPECT_EQ (hash, 0x65dd4621e4be529eU);
}

TEST (Code, InverseTimesCodeIsOne)
{
  for (const int n : {2, 3, 4, 7, 8, 9, 15, 16, 36, 64, 255, 256}) {
    for (const char *name : {"sequential", "staircase", "s-matrix"}) {
      if (std::string (name) == "s-matrix" && !Code::named (name, n).ok ())
        continue;
      const Code code = named (name, n);
      for (const double leak : {0.0, 0.001, 0.01, 0.1, 0.5})
        EXPECT_LT (worst_of_identity (code, leak), 1e-9)
            << name << " " << n << " leak " << leak;
    }
  }
}

TEST (Code, InverseOfStaircaseTakesDifferences)
{
  const auto inverse = named ("staircase", 3).inverse (0.0);
  ASSERT_TRUE (inverse.ok ());
  EXPECT_EQ (*inverse, (std::vector<double>{1, 0, 0, -1, 1, 0, 0, -1, 1}));
}

TEST (Code, RowsAreKept)
{
  const Rows rows{"011", "101", "110"};
  const auto code = Code::from_rows (rows);
  ASSERT_TRUE (code.ok ());
  EXPECT_EQ (code->rows (), rows);
  EXPECT_EQ (code->name (), "matrix");
  EXPECT_FALSE (code->is_named ());
  EXPECT_EQ (code->on_slots (0), 2);
  EXPECT_FALSE (code->one_hot ());
  EXPECT_LT (worst_of_identity (*code, 0.02), 1e-9);

  EXPECT_TRUE (Code::from_rows ({"010", "001", "100"})->one_hot ());
  EXPECT_FALSE (Code::from_rows ({"010", "010", "100"})->one_hot ());
}

TEST (Code, DependentRowsHaveNoInverse)
{
  const auto expect_none = [] (const Rows &rows, double leak) {
    const auto inverse = Code::from_rows (rows)->inverse (leak);
    ASSERT_FALSE (inverse.ok ());
    for (const char *word : {"'matrix'", "cannot be inverted", "sequential"})
      EXPECT_NE (inverse.error ().message.find (word), std::string::npos)
          << inverse.error ().message;
  };
  expect_none ({"10", "10"}, 0.0);
  expect_none ({"1100", "0011", "1111", "1010"}, 0.1);
  expect_none ({"1100", "0110", "0011", "1001"}, 0.0);
}

/* C + leak (J - C) is (1 - leak) (C + r J), r = leak / (1 - leak), and has the
 * determinant of C times 1 + r s, s the sum of C's inverse: here s = -1. */
TEST (Code, LeakCanMakeRowsDependent)
{
  const auto code =
      Code::from_rows ({"01011", "00010", "00111", "10011", "00001"});
  ASSERT_TRUE (code.ok ());
  EXPECT_LT (worst_of_identity (*code, 0.0), 1e-9);
  EXPECT_LT (worst_of_identity (*code, 0.4), 1e-9);
  const auto inverse = code->inverse (0.5);
  ASSERT_FALSE (inverse.ok ());
  EXPECT_NE (inverse.error ().message.find ("leak of 0.5"), std::string::npos)
      << inverse.error ().message;
}

/* Determinant 1, and an inverse that grows as the Fibonacci numbers. */
TEST (Code, InverseOfAnIllConditionedCodeIsRefused)
{
  const int n = 200;
  Rows rows (n, std::string (n, '0'));
  for (int i = 0; i < n; i++)
    for (int j = i; j < n; j++)
      if (j == i || (j - i) % 2 == 1)
        rows[std::size_t (i)][std::size_t (j)] = '1';
  const auto code = Code::from_rows (rows);
  ASSERT_TRUE (code.ok ());
  EXPECT_FALSE (code->inverse (0.0).ok ());
}

TEST (Code, WrongRowsAreNamed)
{
  const auto expect_words = [] (const Result<Code> &code,
                                std::vector<std::string> words) {
    ASSERT_FALSE (code.ok ());
    for (const std::string &word : words)
      EXPECT_NE (code.error ().message.find (word), std::string::npos)
          << "'" << word << "' in: " << code.error ().message;
  };
  expect_words (Code::from_rows ({}), {"0 rows", "2 to 256"});
  expect_words (Code::from_rows ({"1"}), {"1 rows", "2 to 256"});
  expect_words (Code::from_rows (Rows (257, "1")), {"257 rows", "2 to 256"});
  expect_words (Code::from_rows ({"10", "011"}), {"row 1", "3 slots", "2"});
  expect_words (Code::from_rows ({"10", "0x"}), {"row 1", "'0x'", "0 (off)"});
  expect_words (Code::from_rows ({"10", "00"}), {"row 1", "never on"});
  expect_words (Code::named ("cumulative", 4), {"'cumulative'", "staircase"});
  expect_words (Code::named ("sequential", 1), {"1 elements", "2 to 256"});
  expect_words (Code::named ("sequential", 257), {"257", "2 to 256"});
}

TEST (Code, GoesOnFromALaterSlot)
{
  const Code code = *Code::from_rows ({"110", "010", "001"});
  EXPECT_EQ (code.from_slot (1).rows (),
      (std::vector<std::string>{"101", "100", "010"}));
  EXPECT_EQ (code.from_slot (0).rows (), code.rows ());
  EXPECT_EQ (code.from_slot (1).from_slot (2).rows (), code.rows ());
}

TEST (Code, ComplementIsOnWhereTheCodeIsOff)
{
  const Code code = *Code::named ("s-matrix", 7);
  const Code other = *code.complement ();
  for (int e = 0; e < 7; e++)
    for (int s = 0; s < 7; s++)
      EXPECT_NE (code.on (e, s), other.on (e, s));
  EXPECT_EQ (other.max_on_slots (), 3);
  EXPECT_EQ (other.complement ()->rows (), code.rows ());
  EXPECT_EQ (Code::named ("staircase", 4)->complement ().error ().message,
      "element 3 of code 'staircase' is on in every slot, so that the beam of "
      "the mirrors that are off never has its light; use sequential");
}
