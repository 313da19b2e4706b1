/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pixels of partners, a pixel a mirror. */
#pragma once

#include <memory>
#include <optional>

#include "base/image.h"
#include "common/coded_filter.h"
#include "common/partner.h"

namespace codedexposure::gst
{

class PartnerReader
{
public:
  /** @p partner: as the tag of coded frames of @p format says. Error when its
   * frames cannot be used. */
  static Result<PartnerReader> make (const PartnerSetup &partner,
      const CodedFormat &format, const RectifyOptions &options);

  /** Null: it sees one mirror with each pixel. */
  const Rectifier *rectifier () const { return rectifier_.get (); }
  /** The partner of @p coded, until the next call; none if it has none of use.
   * @p bits: significant ones; 0: all. @p workers and @p errors: see
   * Rectifier::run (), if there is a rectifier; or null. */
  template <typename Pixel>
  Result<std::optional<ImageView<const Pixel>>> read (GstBuffer *coded,
      int bits, Workers *workers = nullptr, Image<float> *errors = nullptr);
  /** What read () has given, with a rectifier, for its correction. */
  template <typename Pixel>
  ImageView<Pixel> rectified ()
  {
    return std::get<Image<Pixel>> (rectified_).view ();
  }

private:
  struct Mapped {
    BufferPtr buffer;
    MappedFrame frame; ///< of the buffer, which it is unmapped before
  };

  GstVideoFormat format_ = GST_VIDEO_FORMAT_UNKNOWN;
  Extent size_;
  std::shared_ptr<const Rectifier> rectifier_; ///< null: a pixel a mirror
  std::unique_ptr<Mapped> mapped_;
  Scratch rectified_;
};

} // namespace codedexposure::gst
