/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The cost model of the paper for sorting a group, Eqs. 9-21, evaluated
 * exactly, and the comparisons that sorts really need. Prints the tables of
 * docs/sorting.md; with that page as argument, checks that it contains them. */
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "extract/group_sort.h"
#include "extract/network.h"

namespace
{

constexpr int kSizes[] = {4, 9, 16, 81, 256};

std::string
number (double value, int decimals = 1)
{
  char text[32];
  std::snprintf (text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string
row (const std::vector<std::string> &cells)
{
  std::string line = "|";
  for (const auto &cell : cells)
    line += " " + cell + " |";
  return line + "\n";
}

/** sum of 1 / i, i = 2..n */
double
harmonic_from_2 (int n)
{
  double sum = 0.0;
  for (int i = 2; i <= n; i++)
    sum += 1.0 / i;
  return sum;
}

/** Eq. 9: T(n) = n + 2 / n sum of T(i), i < n; T(0) = T(1) = 0. */
double
eq9 (int n)
{
  std::vector<double> cost = {0.0, 0.0};
  double sum = 0.0;
  for (int m = 2; m <= n; m++) {
    cost.push_back (m + 2.0 / m * sum);
    sum += cost.back ();
  }
  return cost[std::size_t (n)];
}

/** Eq. 14, the closed form that the paper derives from Eqs. 9-13. */
double
eq14 (int n)
{
  return 2.0 * (n + 1) * harmonic_from_2 (n) + 3.0 - 1.5 * (n + 1);
}

/** Left side of Eq. 17 for each element: insertion sort in groups of k. */
double
eq17_cost (int k)
{
  return (k + 4.0) * (k - 1.0) / (4.0 * k);
}

/** Right side of Eq. 17 for each element: the bound of the paper. */
double
eq17_bound (int k)
{
  return k / 4.0 + 3.0 / 16.0;
}

/** Comparisons that insertion sort below k saves; @p sum is the sum of 1 / i, i
 * = 2..k, in Eq. 19 and ln k in Eq. 20. */
double
saving (int n, int k, double sum)
{
  return 2.0 * (n + 1) * sum + 3.0 * (n + 1) * (1.0 / (k + 1) - 0.5) -
         (k / 4.0 + 1.0) * n;
}
double
eq19 (int n, int k)
{
  return saving (n, k, harmonic_from_2 (k));
}
double
eq20 (int n, int k)
{
  return saving (n, k, std::log (k));
}

/** Eq. 21: where the derivative of Eq. 20 by k vanishes. */
double
eq21_root (int n)
{
  double low = 2.0, high = 60.0;
  for (int i = 0; i < 60; i++) {
    const double k = (low + high) / 2;
    const double slope =
        2.0 / k - 3.0 / ((k + 1) * (k + 1)) - n / (4.0 * (n + 1));
    (slope > 0.0 ? low : high) = k;
  }
  return low;
}

template <typename F>
std::pair<int, double>
best_k (F f, int n)
{
  std::pair<int, double> best = {2, f (n, 2)};
  for (int k = 3; k < 40; k++)
    if (f (n, k) > best.second)
      best = {k, f (n, k)};
  return best;
}

/** Counts comparisons. */
struct Counter {
  std::uint64_t asked = 0;
  bool operator() (int a, int b)
  {
    asked++;
    return a < b;
  }
};

/** The quicksort of Eq. 9: the first value is the pivot. */
void
first_pivot_sort (std::span<int> values, Counter &less)
{
  if (values.size () < 2)
    return;
  const int pivot = values[0];
  std::size_t low = 0, high = values.size ();
  for (;;) {
    do
      low++;
    while (low < values.size () && less (values[low], pivot));
    do
      high--;
    while (less (pivot, values[high]));
    if (low >= high)
      break;
    std::swap (values[low], values[high]);
  }
  std::swap (values[0], values[high]);
  first_pivot_sort (values.first (high), less);
  first_pivot_sort (values.subspan (high + 1), less);
}

/** Mean comparisons over groups of random or of ascending bytes. */
template <typename Sort>
double
measured (int n, bool rising, Sort sort)
{
  constexpr int kGroups = 2000;
  std::mt19937 random (1);
  Counter less;
  std::vector<int> group (static_cast<std::size_t> (n));
  for (int g = 0; g < kGroups; g++) {
    for (std::size_t i = 0; i < group.size (); i++)
      group[i] = rising ? int (i) : int (random () % 256);
    sort (std::span (group), less);
  }
  return double (less.asked) / kGroups;
}

template <int N>
int
network_size ()
{
  return codedexposure::Network<N>::sort ().size ();
}

/* A network of 256 wires takes long to compile: two halves and their merge. */
constexpr int kMergeOf128And128 = 897;

int
network_size (int n)
{
  switch (n) {
  case 4:
    return network_size<4> ();
  case 9:
    return network_size<9> ();
  case 16:
    return network_size<16> ();
  case 81:
    return network_size<81> ();
  default:
    return 2 * network_size<128> () + kMergeOf128And128;
  }
}

std::string
recurrence_table ()
{
  std::string text =
      row ({"n", "Eq. 9, T(n)", "Eq. 14", "difference", "(n + 1) / 6"}) +
      row ({"---", "---", "---", "---", "---"});
  for (const int n : kSizes)
    text += row ({std::to_string (n), number (eq9 (n)), number (eq14 (n)),
        number (eq9 (n) - eq14 (n), 2), number ((n + 1) / 6.0, 2)});
  return text;
}

std::string
insertion_table ()
{
  std::string text = row ({"k", "Eq. 17, left", "Eq. 17, right"}) +
                     row ({"---", "---", "---"});
  for (const int k : {2, 4, 7, 8, 16})
    text += row ({std::to_string (k), number (eq17_cost (k), 3),
        number (eq17_bound (k), 3)});
  return text;
}

std::string
saving_table ()
{
  std::string text = row ({"n", "Eq. 19, k = 7", "Eq. 19, best", "at k",
                         "Eq. 20, best", "at k", "Eq. 21, root k"}) +
                     row ({"---", "---", "---", "---", "---", "---", "---"});
  for (const int n : kSizes) {
    const auto exact = best_k (eq19, n);
    const auto paper = best_k (eq20, n);
    text +=
        row ({std::to_string (n), number (eq19 (n, 7)), number (exact.second),
            std::to_string (exact.first), number (paper.second),
            std::to_string (paper.first), number (eq21_root (n), 2)});
  }
  return text;
}

std::string
measured_table (bool rising)
{
  std::string text =
      row ({"n", "Eq. 9", "first pivot", "median of three, k = 7", "insertion",
          "std::sort", "network"}) +
      row ({"---", "---", "---", "---", "---", "---", "---"});
  for (const int n : kSizes)
    text += row ({std::to_string (n), number (eq9 (n)),
        number (measured (n, rising, first_pivot_sort)),
        number (measured (n, rising,
            [] (std::span<int> group, Counter &less) {
              codedexposure::group_sort (group, less);
            })),
        number (measured (n, rising,
            [] (std::span<int> group, Counter &less) {
              codedexposure::insertion_sort (group, less);
            })),
        number (measured (n, rising,
            [] (std::span<int> group, Counter &less) {
              std::sort (group.begin (), group.end (), std::ref (less));
            })),
        std::to_string (network_size (n))});
  return text;
}

} // namespace

int
main (int argc, char **argv)
{
  const std::string tables[] = {recurrence_table (), insertion_table (),
      saving_table (), measured_table (false), measured_table (true)};
  if (argc < 2) {
    for (const auto &table : tables)
      std::printf ("%s\n", table.c_str ());
    return 0;
  }

  std::ifstream file (argv[1]);
  const std::string page{std::istreambuf_iterator<char> (file), {}};
  for (const auto &table : tables) {
    if (page.find (table) == std::string::npos) {
      std::printf ("%s lacks this table:\n%s", argv[1], table.c_str ());
      return 1;
    }
  }
}
