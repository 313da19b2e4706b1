/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Sorting networks of any size, made while compiling. */
#pragma once

namespace codedexposure
{

/**
 * One comparator: afterwards the smaller value is on wire @p low, the larger
 * on wire @p high. The flags say when a wire has to be fetched and when it can
 * be put away, so that no more wires are held than need be.
 */
struct Comparator {
  short low = 0;
  short high = 0;
  bool low_first = false, high_first = false; ///< first use of the wire
  bool low_last = false, high_last = false;   ///< last use of the wire
};

/** A short list of wires that can be built while compiling. */
template <int Capacity>
struct WireList {
  short at[Capacity] = {};
  int size = 0;

  constexpr void add (int wire) { at[size++] = short (wire); }
  /** Every second wire, from @p first on. */
  constexpr WireList every_second (int first) const
  {
    WireList part;
    for (int i = first; i < size; i += 2)
      part.add (at[i]);
    return part;
  }
  constexpr WireList slice (int first, int count) const
  {
    WireList part;
    for (int i = first; i < first + count; i++)
      part.add (at[i]);
    return part;
  }
};

/* The smallest networks known for sizes that merging does not reach (Knuth,
 * The Art of Computer Programming 3, 5.3.4). Sizes below them are made by
 * leaving out the last inputs. */
struct Pair {
  signed char low, high;
};
inline constexpr Pair kBest10[] = {{0, 8}, {1, 9}, {2, 7}, {3, 5}, {4, 6},
    {0, 2}, {1, 4}, {5, 8}, {7, 9}, {0, 3}, {2, 4}, {5, 7}, {6, 9}, {0, 1},
    {3, 6}, {8, 9}, {1, 5}, {2, 3}, {4, 8}, {6, 7}, {1, 2}, {3, 5}, {4, 6},
    {7, 8}, {2, 3}, {4, 5}, {6, 7}, {3, 4}, {5, 6}};
inline constexpr Pair kBest9[] = {{0, 3}, {1, 7}, {2, 5}, {4, 8}, {0, 7},
    {2, 4}, {3, 8}, {5, 6}, {0, 2}, {1, 3}, {4, 5}, {7, 8}, {1, 4}, {3, 6},
    {5, 7}, {0, 1}, {2, 4}, {3, 5}, {6, 8}, {2, 3}, {4, 5}, {6, 7}, {1, 2},
    {3, 4}, {5, 6}};
inline constexpr Pair kBest12[] = {{0, 8}, {1, 7}, {2, 6}, {3, 11}, {4, 10},
    {5, 9}, {0, 1}, {2, 5}, {3, 4}, {6, 9}, {7, 8}, {10, 11}, {0, 2}, {1, 6},
    {5, 10}, {9, 11}, {0, 3}, {1, 2}, {4, 6}, {5, 7}, {8, 11}, {9, 10}, {1, 4},
    {3, 5}, {6, 8}, {7, 10}, {1, 3}, {2, 5}, {6, 9}, {8, 10}, {2, 3}, {4, 5},
    {6, 7}, {8, 9}, {4, 6}, {5, 7}, {3, 4}, {5, 6}, {7, 8}};
inline constexpr Pair kBest16[] = {{0, 13}, {1, 12}, {2, 15}, {3, 14}, {4, 8},
    {5, 6}, {7, 11}, {9, 10}, {0, 5}, {1, 7}, {2, 9}, {3, 4}, {6, 13}, {8, 14},
    {10, 15}, {11, 12}, {0, 1}, {2, 3}, {4, 5}, {6, 8}, {7, 9}, {10, 11},
    {12, 13}, {14, 15}, {0, 2}, {1, 3}, {4, 10}, {5, 11}, {6, 7}, {8, 9},
    {12, 14}, {13, 15}, {1, 2}, {3, 12}, {4, 6}, {5, 7}, {8, 10}, {9, 11},
    {13, 14}, {1, 4}, {2, 6}, {5, 8}, {7, 10}, {9, 13}, {11, 14}, {2, 4},
    {3, 6}, {9, 12}, {11, 13}, {3, 5}, {6, 8}, {7, 9}, {10, 12}, {3, 4}, {5, 6},
    {7, 8}, {9, 10}, {11, 12}, {6, 7}, {8, 9}};

/**
 * A network on wires 0..Wires-1 and the wire on which each rank ends.
 *
 * Above the best-known sizes halves are sorted and joined by Batcher's
 * odd-even merge, which takes lists of any two lengths.
 */
template <int Wires>
class Network
{
public:
  using List = WireList<Wires>;

  static constexpr Network sort ()
  {
    Network network;
    network.rank_ = network.sorted (all_wires ());
    network.in_order_of_demand ();
    return network;
  }

  constexpr int size () const { return size_; }
  constexpr Comparator operator[] (int i) const { return comparators_[i]; }
  /** The wire that holds rank @p k in the end. */
  constexpr int wire (int k) const { return rank_.at[k]; }
  /** The rank that wire @p w holds in the end. */
  constexpr int rank (int w) const
  {
    int k = 0;
    while (rank_.at[k] != w)
      k++;
    return k;
  }

private:
  /* 3 791 comparators sort 256 wires. */
  static constexpr int kCapacity = Wires * (Wires <= 32 ? 8 : 15);

  static constexpr List all_wires ()
  {
    List all;
    for (int w = 0; w < Wires; w++)
      all.add (w);
    return all;
  }

  constexpr void compare (int low, int high)
  {
    comparators_[size_].low = short (low);
    comparators_[size_++].high = short (high);
  }

  constexpr List sorted (const List &in)
  {
    if (in.size == 9)
      return known (kBest9, in);
    if (in.size == 10)
      return known (kBest10, in);
    if (in.size == 11 || in.size == 12)
      return known (kBest12, in);
    if (in.size >= 13 && in.size <= 16)
      return known (kBest16, in);
    if (in.size < 2)
      return in;
    const int half = (in.size + 1) / 2;
    return merged (
        sorted (in.slice (0, half)), sorted (in.slice (half, in.size - half)));
  }

  /** A table, its last inputs left out as if they were infinite. */
  template <int Count>
  constexpr List known (const Pair (&table)[Count], const List &in)
  {
    short wires[16];
    for (int i = 0; i < 16; i++)
      wires[i] = i < in.size ? in.at[i] : short (-1);
    for (const Pair pair : table) {
      short &low = wires[int (pair.low)];
      short &high = wires[int (pair.high)];
      if (low >= 0 && high >= 0) {
        compare (low, high);
      } else if (high >= 0) {
        low = high;
        high = -1;
      }
    }
    List out;
    for (int i = 0; i < in.size; i++)
      out.add (wires[i]);
    return out;
  }

  constexpr List merged (const List &a, const List &b)
  {
    if (a.size == 0)
      return b;
    if (b.size == 0)
      return a;
    List out;
    if (a.size == 1 && b.size == 1) {
      compare (a.at[0], b.at[0]);
      out.add (a.at[0]);
      out.add (b.at[0]);
      return out;
    }
    const List even = merged (a.every_second (0), b.every_second (0));
    const List odd = merged (a.every_second (1), b.every_second (1));
    out.add (even.at[0]);
    for (int i = 0; i < odd.size || i + 1 < even.size; i++) {
      if (i < odd.size && i + 1 < even.size)
        compare (odd.at[i], even.at[i + 1]);
      if (i < odd.size)
        out.add (odd.at[i]);
      if (i + 1 < even.size)
        out.add (even.at[i + 1]);
    }
    return out;
  }

  /** Puts the comparators in the order in which ranks 0, 1, 2, ... need them:
   * fewer wires are under way at any time, so fewer leave the registers. */
  constexpr void in_order_of_demand ()
  {
    const Network as_built = *this;
    bool emitted[kCapacity] = {};
    size_ = 0;
    for (int k = 0; k < Wires; k++)
      emit_before (as_built, as_built.size_, rank_.at[k], emitted);
    mark_uses ();
  }

  /** Emits what wire @p wire needs of the comparators before @p end. */
  constexpr void emit_before (
      const Network &from, int end, int wire, bool *emitted)
  {
    for (int i = end - 1; i >= 0; i--) {
      const Comparator &c = from.comparators_[i];
      if (c.low != wire && c.high != wire)
        continue;
      if (!emitted[i]) {
        emit_before (from, i, c.low, emitted);
        emit_before (from, i, c.high, emitted);
        emitted[i] = true;
        compare (c.low, c.high);
      }
      return;
    }
  }

  constexpr void mark_uses ()
  {
    bool used[Wires] = {};
    for (int i = 0; i < size_; i++) {
      Comparator &c = comparators_[i];
      c.low_first = !used[c.low];
      c.high_first = !used[c.high];
      used[c.low] = used[c.high] = true;
    }
    for (bool &wire : used)
      wire = false;
    for (int i = size_ - 1; i >= 0; i--) {
      Comparator &c = comparators_[i];
      c.low_last = !used[c.low];
      c.high_last = !used[c.high];
      used[c.low] = used[c.high] = true;
    }
  }

  Comparator comparators_[kCapacity] = {};
  int size_ = 0;
  List rank_ = {};
};

} // namespace codedexposure
