/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "pair/check.h"

#include "base/pixels.h"
#include "common/meta.h"
#include "common/raii.h"

namespace codedexposure::gst
{

namespace
{

using Verdict = PartnerWatch::Verdict;

PartnerWatch::Camera
camera_of (const PairStream &stream)
{
  PartnerWatch::Camera camera{{stream.info.width, stream.info.height}, nullptr};
  int bits = 0;
  if (stream.setup) {
    bits = stream.setup->bits;
    if (stream.setup->mapping)
      camera.mapping = &*stream.setup->mapping;
    if (stream.setup->bench)
      camera.black = stream.setup->bench->black ();
  }
  bits = significant_bits_of (bits, stream.info);
  camera.white = largest_pixel (
      bits > 0 ? bits : int (GST_VIDEO_INFO_COMP_DEPTH (&stream.info, 0)));
  return camera;
}

Extent
mirrors_of (const PartnerWatch::Camera &camera)
{
  return camera.mapping ? camera.mapping->mirrors () : camera.size;
}

} // namespace

void
PairCheck::configure (const PairStream &on, const PairStream &off)
{
  watch_.reset ();
  on_ = on.info;
  off_ = off.info;
  const PartnerWatch::Camera first = camera_of (on), second = camera_of (off);
  const auto fits = [] (const PartnerWatch::Camera &camera) {
    return !camera.mapping || camera.mapping->camera () == camera.size;
  };
  const Extent mirrors = mirrors_of (first);
  if (on.setup && fits (first) && fits (second) &&
      mirrors_of (second) == mirrors && on.setup->schedule.complement () &&
      on.setup->schedule.check_size (mirrors.width, mirrors.height))
    watch_.emplace (on.setup->schedule, first, second);
}

void
PairCheck::reset ()
{
  if (watch_)
    watch_->reset ();
}

Verdict
PairCheck::check (GstBuffer *coded, GstBuffer *partner)
{
  if (!watch_)
    return Verdict::unknown;
  MappedFrame on (on_, coded, GST_MAP_READ);
  MappedFrame off (off_, partner, GST_MAP_READ);
  if (!on || !off)
    return Verdict::unknown;
  return read_pixels (on, [&] (const auto &first) {
    return read_pixels (
        off, [&] (const auto &second) { return watch_->take (first, second); });
  });
}

} // namespace codedexposure::gst
