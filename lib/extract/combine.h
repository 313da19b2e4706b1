/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Rows of elements into rows of slots. Most are plain loops over cells, which
 * the compiler turns into vectors. */
#pragma once

#include "extract/kernels.h"
#include "extract/split.h"
#include "extract/vector.h"

namespace cexp::CEXP_TARGET
{

template <typename T>
std::uint64_t
count (const T *row, int pixels, T largest)
{
  std::uint64_t found = 0;
  for (int x = 0; x < pixels; x++)
    found += row[x] >= largest;
  return found;
}

inline void
fence ()
{
#ifdef __SSE2__
  _mm_sfence ();
#endif
}

template <typename T>
void
relabel (const T *const *places, const std::uint8_t *place, int n, int repeat,
    int phase, const T *comb, T *const *out, const Strips &strips)
{
  for_strips<T> (strips, [&] (int at, auto put) CEXP_INLINE_BODY {
    const int first = (at + phase) % repeat;
    for (int e = 0; e < n; e++) {
      Vector<T> v = {};
      int shift = first;
      for (int c = 0; c < repeat; c++) {
        v |= load (comb + shift) & load (places[place[e * repeat + c]] + at);
        shift = shift > 0 ? shift - 1 : repeat - 1;
      }
      put (out[e] + at, v);
    }
  });
}

template <typename T>
void
difference (const T *const *elements, int n, int cells, int gain, T largest,
    T *const *out)
{
  const T limit = T (largest / gain);
  for (int k = 0; k < n; k++) {
    const T *__restrict now = elements[k];
    T *__restrict to = out[k];
    if (k == 0) {
      for (int i = 0; i < cells; i++)
        to[i] = now[i] > limit ? largest : T (now[i] * gain);
      continue;
    }
    const T *__restrict before = elements[k - 1];
    for (int i = 0; i < cells; i++) {
      const T step = T (now[i] > before[i] ? now[i] - before[i] : 0);
      to[i] = step > limit ? largest : T (step * gain);
    }
  }
}

/** The element at the centre of the cell, 4 n times as large; @p between has
 * one cell more than @p values at either end. */
template <typename Wide, typename T>
CEXP_INLINE void
lerp_row (const ElementRow<T> &element, int cells, Wide *__restrict between,
    Wide *__restrict values)
{
  const T *__restrict here = element.here - 1;
  const T *__restrict there = element.there - 1;
  const Wide near_y = Wide (element.y.near), far_y = Wide (element.y.far);
  for (int i = 0; i < cells + 2; i++)
    between[i] = Wide (near_y * here[i] + far_y * there[i]);
  const Wide near_x = Wide (element.x.near), far_x = Wide (element.x.far);
  const Wide *beside = between + 1 + element.step;
  for (int i = 0; i < cells; i++)
    values[i] = Wide (near_x * between[i + 1] + far_x * beside[i]);
}

/** @p Wide holds 4 n times the largest pixel, and 2 more. */
template <typename Wide, typename T>
void
lerp_difference_in (
    const ElementRow<T> *elements, int n, int cells, T largest, T *const *out)
{
  Wide between[kMaxRowCells + 2];
  Wide values[2][kMaxRowCells];
  for (int i = 0; i < cells; i++)
    values[1][i] = 0;
  for (int k = 0; k < n; k++) {
    Wide *__restrict now = values[k & 1];
    const Wide *__restrict before = values[1 - (k & 1)];
    lerp_row (elements[k], cells, between, now);
    T *__restrict to = out[k];
    for (int i = 0; i < cells; i++) {
      const Wide step = Wide (now[i] > before[i] ? now[i] - before[i] : 0);
      const Wide light = Wide ((step + 2) >> 2);
      to[i] = light > largest ? largest : T (light);
    }
  }
}

template <typename T>
void
lerp_difference (
    const ElementRow<T> *elements, int n, int cells, T largest, T *const *out)
{
  if (sizeof (T) == 1 && n <= 64)
    lerp_difference_in<std::uint16_t> (elements, n, cells, largest, out);
  else
    lerp_difference_in<std::uint32_t> (elements, n, cells, largest, out);
}

/** Cells that decode () works on at a time. */
constexpr int kDecodeBlock = 16;

template <typename T>
CEXP_INLINE void
decode_block (const ElementRow<T> *elements, const TermList *terms, int n,
    int at, int cells, T largest, T *const *out)
{
  double values[256][kDecodeBlock];
  for (int e = 0; e < n; e++) {
    const ElementRow<T> &row = elements[e];
    for (int i = 0; i < cells; i++) {
      const int here =
          row.y.near * row.here[at + i] + row.y.far * row.there[at + i];
      const int beside = row.y.near * row.here[at + i + row.step] +
                         row.y.far * row.there[at + i + row.step];
      values[e][i] = row.x.near * here + row.x.far * beside;
    }
  }
  const double bound = double (largest);
  for (int s = 0; s < n; s++) {
    double light[kDecodeBlock] = {};
    for (int t = 0; t < terms[s].size; t++) {
      const double factor = terms[s].factors[t];
      const double *value = values[terms[s].elements[t]];
      for (int i = 0; i < cells; i++)
        light[i] += factor * value[i];
    }
    for (int i = 0; i < cells; i++) {
      const double up = light[i] + 0.5;
      const double low = up < 0.0 ? 0.0 : up;
      out[s][at + i] = T (int (low > bound ? bound : low));
    }
  }
}

template <typename T>
void
decode (const ElementRow<T> *elements, const TermList *terms, int n, int cells,
    T largest, T *const *out)
{
  int at = 0;
  for (; at + kDecodeBlock <= cells; at += kDecodeBlock)
    decode_block (elements, terms, n, at, kDecodeBlock, largest, out);
  if (at < cells)
    decode_block (elements, terms, n, at, cells - at, largest, out);
}

} // namespace cexp::CEXP_TARGET
