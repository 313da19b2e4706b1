/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "common/partner_reader.h"

#include "base/try.h"

namespace codedexposure::gst
{

Result<PartnerReader>
PartnerReader::make (const PartnerSetup &partner, const CodedFormat &format,
    const RectifyOptions &options)
{
  PartnerReader reader;
  reader.format_ = GST_VIDEO_INFO_FORMAT (&format.info);
  reader.size_ = partner.size;
  ASSIGN_OR_RETURN (const Schedule complement, format.schedule.complement ());
  if (!partner.mapping && partner.size == format.size)
    return reader;
  if (!partner.mapping)
    return Error{"they have another size than the mirrors, and no mapping; "
                 "calibrate the second camera"};
  auto made = Rectifier::make (*partner.mapping, complement, options);
  if (!made)
    return made.error ().with_prefix ("their mapping cannot be used: ");
  if (!(made->mirrors () == format.size))
    return Error{"their mapping is to another number of mirrors than the coded "
                 "frames have; calibrate both cameras"};
  if (!(made->camera () == partner.size))
    return Error{"their mapping is for frames of " +
                 size_text (made->camera ()) + " pixels, but they have " +
                 size_text (partner.size) + "; calibrate the second camera"};
  reader.rectifier_ = std::make_shared<const Rectifier> (*std::move (made));
  return reader;
}

template <typename Pixel>
Result<std::optional<ImageView<const Pixel>>>
PartnerReader::read (
    GstBuffer *coded, int bits, Workers *workers, Image<float> *errors)
{
  using View = ImageView<const Pixel>;
  mapped_.reset ();
  auto partner = get_partner (coded);
  GstVideoInfo info;
  if (!partner || !gst_video_info_from_caps (&info, partner->caps.get ()))
    return std::optional<View> ();
  const GstVideoFormat format = GST_VIDEO_INFO_FORMAT (&info);
  const Extent size{info.width, info.height};
  if (format != format_)
    return Error{std::string ("it is ") + gst_video_format_to_string (format_) +
                 ", but the frame of the second camera is " +
                 gst_video_format_to_string (format) +
                 "; set both cameras to the same pixel format"};
  if (!(size == size_))
    return Error{"the frame of the second camera has " + size_text (size) +
                 " pixels, but the stream tag says " + size_text (size_) +
                 "; do not scale or crop it"};
  mapped_ = std::make_unique<Mapped> ();
  mapped_->buffer = std::move (partner->buffer);
  mapped_->frame.map (info, mapped_->buffer.get (), GST_MAP_READ);
  if (!mapped_->frame)
    return std::optional<View> ();
  const View seen = view_of<const Pixel> (mapped_->frame);
  if (!rectifier_)
    return std::optional<View> (seen);
  ASSIGN_OR_RETURN (const View mirrors,
      rectify (*rectifier_, seen, bits, rectified_, errors, workers));
  return std::optional<View> (mirrors);
}

template Result<std::optional<ImageView<const std::uint8_t>>>
PartnerReader::read (GstBuffer *, int, Workers *, Image<float> *);
template Result<std::optional<ImageView<const std::uint16_t>>>
PartnerReader::read (GstBuffer *, int, Workers *, Image<float> *);

} // namespace codedexposure::gst
