/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Many groups sorted side by side: wire k holds pixel k of as many groups as a
 * vector has lanes, and a network sorts them without a branch. */
#pragma once

#include "extract/cells.h"
#include "extract/kernels.h"
#include "extract/network.h"
#include "extract/split.h"
#include "extract/vector.h"

namespace cexp::CEXP_TARGET
{

template <int Wires>
inline constexpr auto kSort = Network<Wires>::sort ();
template <int First, int Second>
inline constexpr auto kMerge = Network<First + Second>::merge (First);

template <const auto &Net, int I, typename V, typename Fetch, typename Put>
CEXP_INLINE void
run_comparator (V *wires, Fetch &fetch, Put &put)
{
  constexpr Comparator c = Net[I];
  if constexpr (c.low_first)
    fetch (wires, c.low);
  if constexpr (c.high_first)
    fetch (wires, c.high);
  const V low = smaller (wires[c.low], wires[c.high]);
  wires[c.high] = larger (wires[c.low], wires[c.high]);
  wires[c.low] = low;
  if constexpr (c.low_last)
    put (Net.rank (c.low), wires[c.low]);
  if constexpr (c.high_last)
    put (Net.rank (c.high), wires[c.high]);
}

template <const auto &Net, typename V, typename Fetch, typename Put, int... I>
CEXP_INLINE void
run_network (V *wires, Fetch fetch, Put put, std::integer_sequence<int, I...>)
{
  (run_comparator<Net, I> (wires, fetch, put), ...);
}

/** Where sorted wires go: row k starts at rows[k] + at. */
template <typename T>
struct Rows {
  T *const *rows;
  std::ptrdiff_t at;
  bool streams;

  CEXP_INLINE void put (int k, Vector<T> v) const
  {
    if (streams)
      stream (rows[k] + at, v);
    else
      store (rows[k] + at, v);
  }
  Rows from (int k) const { return {rows + k, at, streams}; }
};

/** Sorts Wires wires that lie one after the other. */
template <int Wires, typename T>
void
sort_leaf (const T *from, const Rows<T> &to)
{
  if constexpr (Wires == 1) {
    to.put (0, load (from));
  } else {
    Vector<T> wires[Wires];
    run_network<kSort<Wires>> (
        wires,
        [from] (Vector<T> *held, int w)
            CEXP_INLINE_BODY { held[w] = load (from + w * kLanes<T>); },
        [&to] (int k, Vector<T> v) CEXP_INLINE_BODY { to.put (k, v); },
        std::make_integer_sequence<int, kSort<Wires>.size ()> ());
  }
}

/** Sorted wires, @p step lanes apart. */
template <typename T>
struct List {
  const T *wires;
  std::ptrdiff_t step;
  int size;
};

template <int First, int Second, typename T>
void
merge_leaf (const List<T> &a, const List<T> &b, const Rows<T> &to)
{
  Vector<T> wires[First + Second];
  run_network<kMerge<First, Second>> (
      wires,
      [&] (Vector<T> *held, int w) CEXP_INLINE_BODY {
        held[w] = w < First ? load (a.wires + w * a.step)
                            : load (b.wires + (w - First) * b.step);
      },
      [&to] (int k, Vector<T> v) CEXP_INLINE_BODY { to.put (k, v); },
      std::make_integer_sequence<int, kMerge<First, Second>.size ()> ());
}

/* Networks that are compiled as straight lines. All others are put together
 * from them: small enough for the instruction cache, large enough for most
 * values to stay in registers. */
constexpr int kLeaf = 16;
constexpr int kMergeLeaf = 16;

constexpr bool
has_leaf (int n)
{
  return n <= kLeaf || n == 64 || n == 81;
}

template <typename T>
using SortLeaf = void (*) (const T *, const Rows<T> &);
template <typename T>
using MergeLeaf = void (*) (const List<T> &, const List<T> &, const Rows<T> &);

template <typename T, typename Sizes>
struct LeafTable;
template <typename T, int... I>
struct LeafTable<T, std::integer_sequence<int, I...>> {
  static constexpr SortLeaf<T> kSorts[] = {sort_leaf<I + 1, T>...};
  /** Of two lists of I + 1, or the second one shorter by one. */
  static constexpr MergeLeaf<T> kEven[] = {merge_leaf<I + 1, I + 1, T>...};
  static constexpr MergeLeaf<T> kOdd[] = {
      merge_leaf<I + 1, (I > 0 ? I : 1), T>...};
};

template <typename T>
void
sort_wires (const T *from, int n, const Rows<T> &to)
{
  using Table = LeafTable<T, std::make_integer_sequence<int, kLeaf>>;
  if (n == 81)
    sort_leaf<81, T> (from, to);
  else if (n == 64)
    sort_leaf<64, T> (from, to);
  else
    Table::kSorts[n - 1](from, to);
}

template <typename T>
void
merge_wires (const List<T> &a, const List<T> &b, const Rows<T> &to)
{
  using Table = LeafTable<T, std::make_integer_sequence<int, kMergeLeaf>>;
  if (a.size < b.size)
    merge_wires (b, a, to);
  else if (a.size == 32 && b.size == 32)
    merge_leaf<32, 32, T> (a, b, to);
  else
    (a.size == b.size ? Table::kEven : Table::kOdd)[a.size - 1](a, b, to);
}

constexpr bool
has_merge (int larger_list, int smaller_list)
{
  return larger_list <= kMergeLeaf || (larger_list == 32 && smaller_list == 32);
}

/** The last layer of an odd-even merge: rank 0, then pairs of an odd and the
 * next even wire. */
template <typename T>
void
zip_wires (const T *even, int evens, const T *odd, int odds, const Rows<T> &to)
{
  constexpr int kL = kLanes<T>;
  to.put (0, load (even));
  const int pairs = odds < evens - 1 ? odds : evens - 1;
  for (int i = 0; i < pairs; i++) {
    const Vector<T> a = load (odd + i * kL);
    const Vector<T> b = load (even + (i + 1) * kL);
    to.put (2 * i + 1, smaller (a, b));
    to.put (2 * i + 2, larger (a, b));
  }
  if (odds > pairs)
    to.put (2 * pairs + 1, load (odd + pairs * kL));
  else if (evens - 1 > pairs)
    to.put (2 * pairs + 1, load (even + (pairs + 1) * kL));
}

/** ceil ((size - first) / step): length of a residue class of a list. */
constexpr int
class_size (int size, int first, int step)
{
  return (size - first + step - 1) / step;
}

/**
 * Sorts up to 256 wires: halves as long as there is no leaf for the parts, all
 * parts equally often so that they lie in the same one of two buffers; lists
 * too long for a merge leaf are merged by residue classes first, which is what
 * the odd-even merge does, in blocks.
 */
template <typename T>
class BlockSort
{
public:
  static constexpr int kL = kLanes<T>;
  static constexpr int kMaxWires = 256;

  BlockSort (int n) : n_ (n)
  {
    for (int b = 0; b < 2; b++)
      for (int w = 0; w < n; w++)
        rows_[b][w] = wires_[b] + w * kL;
    while (!has_leaf (part (levels_)) || !has_leaf (n >> levels_))
      levels_++;
  }

  /** The wires to sort, to be filled in before run (). */
  T *const *wires () const { return rows_[0]; }

  void run (const Rows<T> &to) { sort (0, n_, levels_, to); }

private:
  /** The largest part after @p halvings. */
  int part (int halvings) const
  {
    return (n_ + (1 << halvings) - 1) >> halvings;
  }
  Rows<T> buffer (int b, int first) const
  {
    return {rows_[b] + first, 0, false};
  }

  /** Sorts wires [first, first + n), @p level halvings above the leaves; the
   * result is in @p to at the top and else in the buffer that is returned. */
  int sort (int first, int n, int level, const Rows<T> &to)
  {
    const bool top = level == levels_;
    if (level == 0) {
      sort_wires (wires_[0] + first * kL, n, top ? to : buffer (1, first));
      return 1;
    }
    const int half = (n + 1) / 2;
    sort (first, half, level - 1, to);
    const int now = sort (first + half, n - half, level - 1, to);
    return merge (now, first, half, n, level, top ? &to : nullptr);
  }

  int merge (int now, int first, int half, int n, int level, const Rows<T> *to)
  {
    /* The same number of classes for all parts of a level. */
    const int halvings = levels_ - level + 1;
    int classes = 1;
    while (!has_merge (
        class_size (part (halvings), 0, classes), (n_ >> halvings) / classes))
      classes *= 2;

    const T *const a = wires_[now] + first * kL;
    const T *const b = a + half * kL;
    int start[kMaxWires / kMergeLeaf + 1] = {};
    now = 1 - now;
    for (int c = 0; c < classes; c++) {
      const List<T> part_a = {a + c * kL, std::ptrdiff_t (classes) * kL,
          class_size (half, c, classes)};
      const List<T> part_b = {b + c * kL, std::ptrdiff_t (classes) * kL,
          class_size (n - half, c, classes)};
      merge_wires (part_a, part_b,
          classes == 1 && to ? *to : buffer (now, first + start[c]));
      start[c + 1] = start[c] + part_a.size + part_b.size;
    }
    for (; classes > 1; classes /= 2) {
      const T *const in = wires_[now] + first * kL;
      now = 1 - now;
      int out = 0;
      for (int c = 0; c < classes / 2; c++) {
        const int odd = c + classes / 2;
        const int evens = start[c + 1] - start[c];
        const int odds = start[odd + 1] - start[odd];
        zip_wires (in + start[c] * kL, evens, in + start[odd] * kL, odds,
            classes == 2 && to ? *to : buffer (now, first + out));
        out += evens + odds;
        zipped_[c + 1] = out;
      }
      for (int c = 1; c <= classes / 2; c++)
        start[c] = zipped_[c];
    }
    return now;
  }

  alignas (64) T wires_[2][kMaxWires * kL];
  T *rows_[2][kMaxWires];
  int zipped_[kMaxWires / kMergeLeaf + 1];
  int n_;
  int levels_ = 0;
};

/** Kernels::rank for any cells, vector by vector through a buffer. */
template <typename T>
T
rank_any (const Block<T> &block, const Planes<T> &to)
{
  const auto strip = split_strip_of<T> (block.width);
  BlockSort<T> sort (block.width * block.height);
  Vector<T> most = {};
  for (int j = 0; j < block.rows; j++) {
    const std::ptrdiff_t row = j * to.stride / std::ptrdiff_t (sizeof (T));
    for_strips<T> (block.cells, to.rows[0] + row, to.stream,
        [&] (int at, auto put) CEXP_INLINE_BODY {
          most = larger (most, strip (block, j, at, sort.wires ()));
          sort.run ({to.rows, row + at, put.kStreams});
        });
  }
  return largest_lane<T> (most);
}

/** Kernels::rank: the network on wires that are in registers. */
struct RankInRegisters {
  template <int N, typename V, typename Put>
  CEXP_INLINE void operator() (V (&wires)[N], Put put) const
  {
    run_network<kSort<N>> (
        wires, [] (V *, int) CEXP_INLINE_BODY {}, put,
        std::make_integer_sequence<int, kSort<N>.size ()> ());
  }
};

template <typename T>
T
rank (const Block<T> &block, const Planes<T> &to)
{
  const auto own = in_registers<RankInRegisters, T> (block.width, block.height);
  return own ? own (block, to, {}) : rank_any (block, to);
}

} // namespace cexp::CEXP_TARGET
