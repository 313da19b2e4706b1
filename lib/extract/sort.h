/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Many groups sorted side by side: wire k holds pixel k of as many groups as a
 * vector has lanes, and a network sorts them without a branch. */
#pragma once

#include "base/vector.h"
#include "extract/kernels.h"
#include "extract/network.h"
#include "extract/select.h"
#include "extract/split.h"

namespace codedexposure::CODEDEXPOSURE_TARGET
{

template <int Wires>
inline constexpr auto kSort = Network<Wires>::sort ();

template <const auto &Net, int I, typename V, typename Fetch, typename Put>
CODEDEXPOSURE_INLINE void
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
CODEDEXPOSURE_INLINE void
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

  CODEDEXPOSURE_INLINE void put (int k, Vector<T> v) const
  {
    if (streams)
      stream (rows[k] + at, v);
    else
      store (rows[k] + at, v);
  }
};

/** Sorted wires stay where the wires lay, one after the other. */
template <typename T>
struct InPlace {
  T *wires;

  CODEDEXPOSURE_INLINE void put (int k, Vector<T> v) const
  {
    store (wires + k * kLanes<T>, v);
  }
};

/** Sorts Wires wires that lie one after the other. All are fetched before the
 * first is put. */
template <int Wires, typename T, typename To>
void
sort_leaf (const T *from, To to)
{
  if constexpr (Wires == 1) {
    to.put (0, load (from));
  } else {
    Vector<T> wires[Wires];
    run_network<kSort<Wires>> (
        wires,
        [from] (Vector<T> *held, int w) CODEDEXPOSURE_INLINE_BODY {
          held[w] = load (from + w * kLanes<T>);
        },
        [&to] (int k, Vector<T> v) CODEDEXPOSURE_INLINE_BODY { to.put (k, v); },
        std::make_integer_sequence<int, kSort<Wires>.size ()> ());
  }
}

/* Networks up to here are compiled as straight lines: few enough wires for most
 * values to stay in registers. */
constexpr int kLeaf = 16;

template <typename T, int... I>
CODEDEXPOSURE_INLINE void
sort_leaf_of (
    int n, const T *from, const Rows<T> &to, std::integer_sequence<int, I...>)
{
  using SortLeaf = void (*) (const T *, Rows<T>);
  static constexpr SortLeaf kAll[] = {sort_leaf<I + 1, T, Rows<T>>...};
  kAll[n - 1](from, to);
}

template <typename V>
CODEDEXPOSURE_INLINE void
compare (V &a, V &b)
{
  const V low = smaller (a, b);
  b = larger (a, b);
  a = low;
}

template <int Apart, typename V, int... I>
CODEDEXPOSURE_INLINE void
compare_apart (V *wires, std::integer_sequence<int, I...>)
{
  (compare (wires[I % Apart + I / Apart * 2 * Apart],
       wires[I % Apart + I / Apart * 2 * Apart + Apart]),
      ...);
}

/** The last steps of a bitonic merge, on kLeaf wires that lie one after the
 * other. */
template <typename T, typename To>
void
merge_leaf (const T *from, To to)
{
  constexpr std::make_integer_sequence<int, kLeaf / 2> comparators;
  Vector<T> wires[kLeaf];
#pragma GCC unroll 16
  for (int w = 0; w < kLeaf; w++)
    wires[w] = load (from + w * kLanes<T>);
  compare_apart<8> (wires, comparators);
  compare_apart<4> (wires, comparators);
  compare_apart<2> (wires, comparators);
  compare_apart<1> (wires, comparators);
#pragma GCC unroll 16
  for (int w = 0; w < kLeaf; w++)
    to.put (w, wires[w]);
}

/**
 * Batcher's bitonic sort (Knuth, The Art of Computer Programming 3, 5.3.4) of
 * up to 256 wires in memory, from sorted leaves on. Every comparator leaves the
 * smaller value on the lower wire, so that wires above the last one can be left
 * out as if they were infinite; the last leaf is filled up with such.
 */
template <typename T>
class MergeSort
{
public:
  explicit MergeSort (int n)
      : n_ (n), padded_ ((n + kLeaf - 1) / kLeaf * kLeaf), wires_ (padded_)
  {
  }

  /** The wires to sort, to be filled in before run (). */
  T *const *wires () const { return wires_.rows; }

  void run (const Rows<T> &to)
  {
    constexpr std::make_integer_sequence<int, kLeaf> sizes;
    if (n_ <= kLeaf)
      return sort_leaf_of<T> (n_, wires_.lanes, to, sizes);
    for (int w = n_; w < padded_; w++)
      store (wires_.rows[w], Vector<T>{} - 1);
    for (int first = 0; first < padded_; first += kLeaf)
      sort_leaf<kLeaf, T> (wires_.rows[first], InPlace<T>{wires_.rows[first]});
    for (int size = 2 * kLeaf; size / 2 < padded_; size *= 2)
      merge (size, to);
  }

private:
  /** Makes sorted runs of @p size wires; those of all wires in @p to. */
  void merge (int size, const Rows<T> &to)
  {
    for (int first = 0; first + size / 2 < padded_; first += size) {
      const int end = first + size < padded_ ? first + size : padded_;
      for (int w = first + size - end; w < size / 2; w++)
        compare_wires (first + w, first + size - 1 - w);
      for (int apart = size / 4; apart >= kLeaf; apart /= 2)
        for (int w = first; w + apart < end; w += 2 * apart)
          for (int i = w; i < w + apart && i + apart < end; i++)
            compare_wires (i, i + apart);
      for (int w = first; w < end; w += kLeaf)
        if (size >= padded_ && w + kLeaf <= n_)
          merge_leaf (wires_.rows[w], Rows<T>{to.rows + w, to.at, to.streams});
        else
          merge_leaf (wires_.rows[w], InPlace<T>{wires_.rows[w]});
    }
    if (size >= padded_)
      for (int k = n_ / kLeaf * kLeaf; k < n_; k++)
        to.put (k, load (wires_.rows[k]));
  }

  CODEDEXPOSURE_INLINE void compare_wires (int a, int b)
  {
    T *const low = wires_.lanes + a * kLanes<T>;
    T *const high = wires_.lanes + b * kLanes<T>;
    const Vector<T> x = load (low), y = load (high);
    store (low, smaller (x, y));
    store (high, larger (x, y));
  }

  int n_;
  int padded_;
  Wires<T> wires_;
};

/** Kernels::rank for any cells, vector by vector through a buffer. */
template <typename T>
T
rank_any (const Block<T> &block, const Planes<T> &to)
{
  const auto split = split_strip_of<T> (block.width);
  MergeSort<T> sort (block.width * block.height);
  Vector<T> most = {};
  for (int j = 0; j < block.rows; j++) {
    const std::ptrdiff_t row = j * to.stride / std::ptrdiff_t (sizeof (T));
    for_strips<T> (block.cells, to.rows[0] + row, to.stream,
        [&] (int at, auto put) CODEDEXPOSURE_INLINE_BODY {
          most = larger (most, split (block, j, at, sort.wires ()));
          sort.run ({to.rows, row + at, put.streams ()});
        });
  }
  return largest_lane<T> (most);
}

/** Kernels::rank of cells that are small enough to be held in registers. */
template <int Width, int Height, typename T>
T
rank_in_registers (const Block<T> &block, const Planes<T> &to)
{
  constexpr int kN = Width * Height;
  Vector<T> most = {};
  T *out[kN];
  for (int j = 0; j < block.rows; j++) {
    const T *row =
        bytes_on (block.pixels, std::ptrdiff_t (j) * Height * block.stride);
    for (int k = 0; k < kN; k++)
      out[k] = bytes_on (to.rows[k], j * to.stride);
    for_strips<T> (block.cells, out[0], to.stream,
        [&] (int at, auto put) CODEDEXPOSURE_INLINE_BODY {
          Vector<T> wires[kN];
          most = read_cells<Width, Height> (block, row, at, wires, most);
          run_network<kSort<kN>> (
              wires, [] (Vector<T> *, int) CODEDEXPOSURE_INLINE_BODY {},
              [&] (int k, Vector<T> v)
                  CODEDEXPOSURE_INLINE_BODY { put (out[k] + at, v); },
              std::make_integer_sequence<int, kSort<kN>.size ()> ());
        });
  }
  return largest_lane<T> (most);
}

template <typename T>
T
rank (const Block<T> &block, const Planes<T> &to)
{
  constexpr auto in_registers = []<int Width, int Height> () {
    return &rank_in_registers<Width, Height, T>;
  };
  if (const auto run = of_small_cells<in_registers> (block.width, block.height))
    return run (block, to);
  return rank_any (block, to);
}

} // namespace codedexposure::CODEDEXPOSURE_TARGET
