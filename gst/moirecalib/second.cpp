/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* moirecalib: the mapping of a second camera, while that of the first is
 * measured. */
#include "common/meta.h"
#include "moirecalib.h"

namespace codedexposure::gst::moire
{

void
SecondSession::collect (const Pattern &pattern, const Partner &partner)
{
  GstVideoInfo info;
  if (failure_ || !gst_video_info_from_caps (&info, partner.caps.get ()))
    return;
  if (!session_) {
    const auto meta = get_frame_meta (partner.buffer.get ());
    info_ = info;
    session_.emplace (
        CalibrationSession::Options{.camera = {info.width, info.height},
            .mirrors = first_.mirrors,
            .bits = bits_ > 0 ? bits_ : (meta ? meta->bits : 0),
            .patterns = first_.patterns,
            .off_beam = !first_.off_beam});
  }
  MappedFrame mapped (*info_, partner.buffer.get (), GST_MAP_READ);
  if (!mapped || !gst_video_info_is_equal (&*info_, &info))
    return;
  const auto added = read_pixels (mapped,
      [&] (auto pixels) { return session_->collect (pattern, pixels); });
  if (!added)
    failure_ = added.error ();
}

Result<std::optional<CalibrationResult>>
SecondSession::solve ()
{
  if (failure_)
    return *failure_;
  return session_ ? session_->solve () : std::optional<CalibrationResult> ();
}

} // namespace codedexposure::gst::moire
