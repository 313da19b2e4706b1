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

/** @p mapping: of the stream, which the camera points to. */
PartnerWatch::Camera
camera_of (const PairStream &stream, const std::optional<Mapping> &mapping)
{
  PartnerWatch::Camera camera{
      {stream.info.width, stream.info.height}, mapping ? &*mapping : nullptr};
  int bits = 0;
  if (stream.setup) {
    bits = stream.setup->bits;
    if (stream.setup->bench)
      camera.black = stream.setup->bench->black ();
  }
  bits = significant_bits_of (bits, stream.info);
  camera.white = largest_pixel (
      bits > 0 ? bits : int (GST_VIDEO_INFO_COMP_DEPTH (&stream.info, 0)));
  return camera;
}

GreyView
grey_view (MappedFrame &mapped)
{
  return read_pixels (mapped, [] (auto pixels) { return GreyView (pixels); });
}

} // namespace

void
PairCheck::configure (const PairStream &on, const PairStream &off)
{
  watch_.reset ();
  drift_.reset ();
  on_ = on.info;
  off_ = off.info;
  const auto mapping_of = [] (const PairStream &stream) {
    return stream.setup ? stream.setup->known_mapping () : std::nullopt;
  };
  const auto mapping = mapping_of (on), other = mapping_of (off);
  const PartnerWatch::Camera first = camera_of (on, mapping),
                             second = camera_of (off, other);
  const auto fits = [] (const PartnerWatch::Camera &camera) {
    return !camera.mapping || camera.mapping->camera () == camera.size;
  };
  const Extent mirrors = first.mirrors ();
  if (on.setup && fits (first) && fits (second) &&
      second.mirrors () == mirrors && on.setup->schedule.complement () &&
      on.setup->schedule.check_size (mirrors.width, mirrors.height))
    watch_.emplace (on.setup->schedule, first, second);
  if (watch_ && on.setup->schedule.regions ().empty ())
    drift_.emplace (on.setup->schedule, first, second);
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
  return on && off ? watch_->take (grey_view (on), grey_view (off))
                   : Verdict::unknown;
}

void
PairCheck::take_alone (GstBuffer *frame, bool off)
{
  MappedFrame mapped (off ? off_ : on_, frame, GST_MAP_READ);
  if (watch_ && mapped)
    watch_->take_alone (grey_view (mapped), off);
}

std::optional<PartnerDrift::Shift>
PairCheck::drift (GstBuffer *coded, GstBuffer *partner) const
{
  if (!drift_)
    return {};
  MappedFrame on (on_, coded, GST_MAP_READ);
  MappedFrame off (off_, partner, GST_MAP_READ);
  return on && off ? drift_->largest (grey_view (on), grey_view (off))
                   : std::nullopt;
}

} // namespace codedexposure::gst
