/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include <cerrno>
#include <cstdarg>
#include <cstdio>

#include <tiffio.h>

#include "base/result.h"
#include "ome_xml.h"
#include "stack_file.h"

namespace codedexposure::gst
{

namespace
{

struct TiffClose {
  void operator() (TIFF *tiff) const { TIFFClose (tiff); }
};

class OmeTiff : public StackFile
{
public:
  OmeTiff (const std::string &path, const StackFormat &format)
      : format_ (format)
  {
    errno = 0;
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc ();
    TIFFOpenOptionsSetErrorHandlerExtR (options, on_error, this);
    tiff_.reset (
        TIFFOpenExt (path.c_str (), format.big ? "w8" : "w4", options));
    TIFFOpenOptionsFree (options);
    check (tiff_ != nullptr);
  }

  void add_origin (const std::string &json) override
  {
    origins_.push_back ({rows_.size (), json});
  }
  void add (const StackRow &row, const guint8 *pixels, gsize stride) override;
  void finish () override;

private:
  static int on_error (
      TIFF *, void *self, const char *, const char *form, va_list arguments)
  {
    char text[256];
    std::vsnprintf (text, sizeof text, form, arguments);
    static_cast<OmeTiff *> (self)->error_ = text;
    return 1;
  }
  void check (bool success)
  {
    if (success && error_.empty ())
      return;
    throw Error{error_ + (errno ? std::string (": ") + g_strerror (errno) : ""),
        ErrorCode::io};
  }
  template <typename T>
  void set (uint32_t tag, T value)
  {
    check (TIFFSetField (tiff_.get (), tag, value) == 1);
  }
  void begin_picture ();

  const StackFormat format_;
  std::string error_;
  std::vector<StackRow> rows_;
  std::vector<StackOrigin> origins_;
  std::unique_ptr<TIFF, TiffClose> tiff_;
};

/* ImageJ reads neither a predictor nor LZW of every kind. */
void
OmeTiff::begin_picture ()
{
  set (TIFFTAG_IMAGEWIDTH, uint32_t (format_.width));
  set (TIFFTAG_IMAGELENGTH, uint32_t (format_.height));
  set (TIFFTAG_BITSPERSAMPLE, 8 * format_.bytes);
  set (TIFFTAG_SAMPLESPERPIXEL, 1);
  set (TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  set (TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  set (TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  set (TIFFTAG_ROWSPERSTRIP, uint32_t (format_.height));
  set (TIFFTAG_COMPRESSION,
      format_.deflate ? COMPRESSION_ADOBE_DEFLATE : COMPRESSION_NONE);
  if (format_.deflate)
    set (TIFFTAG_ZIPQUALITY, 1);
}

/* Until the end, the first picture has a text for itself alone, so that a file
 * of a run that was killed is valid. */
void
OmeTiff::add (const StackRow &row, const guint8 *pixels, gsize stride)
{
  errno = 0;
  rows_.push_back (row);
  begin_picture ();
  if (rows_.size () == 1)
    set (TIFFTAG_IMAGEDESCRIPTION,
        ome_xml (format_, rows_, origins_,
            "unfinished: the program that wrote this file was killed, or is "
            "still writing it. The file has more pictures than are described "
            "here.")
            .c_str ());
  for (int y = 0; y < format_.height; y++)
    check (TIFFWriteScanline (tiff_.get (),
               const_cast<guint8 *> (pixels + gsize (y) * stride), uint32_t (y),
               0) == 1);
  check (TIFFWriteDirectory (tiff_.get ()) == 1);
}

void
OmeTiff::finish ()
{
  errno = 0;
  check (TIFFSetDirectory (tiff_.get (), 0) == 1);
  set (TIFFTAG_IMAGEDESCRIPTION,
      ome_xml (format_, rows_, origins_, "").c_str ());
  check (TIFFRewriteDirectory (tiff_.get ()) == 1);
  tiff_.reset (); // writes the rest
  check (true);
}

} // namespace

std::unique_ptr<StackFile>
open_ome_tiff (const std::string &path, const StackFormat &format)
{
  return std::make_unique<OmeTiff> (path, format);
}

} // namespace codedexposure::gst
