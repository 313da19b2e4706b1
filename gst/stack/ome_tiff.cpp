/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include <tiffio.h>

#include "base/result.h"
#include "common/meta.h"
#include "common/raii.h"
#include "stack_file.h"

namespace codedexposure::gst
{

namespace
{

std::string
escaped (const std::string &text)
{
  return CharPtr (g_markup_escape_text (text.c_str (), gssize (text.size ())))
      .get ();
}

/* All digits of the time, which has more than a double. */
std::string
seconds_text (GstClockTime time)
{
  std::string digits = std::to_string (time % GST_SECOND);
  digits.insert (0, 9 - digits.size (), '0');
  return std::to_string (time / GST_SECOND) + "." + digits;
}

/* Programs that show the interval expect a picture at each of its multiples. */
bool
is_even (const StackFormat &format, const std::vector<StackRow> &rows)
{
  if (format.rate.num <= 0 || rows.empty () ||
      !GST_CLOCK_TIME_IS_VALID (rows.front ().pts))
    return false;
  const double period = 1e9 * format.rate.den / format.rate.num;
  for (std::size_t i = 0; i < rows.size (); i++) {
    const double moved =
        double (rows[i].pts) - double (rows.front ().pts) - period * double (i);
    if (!GST_CLOCK_TIME_IS_VALID (rows[i].pts) || std::abs (moved) > period / 2)
      return false;
  }
  return true;
}

std::string
interval (const StackFormat &format, const std::vector<StackRow> &rows)
{
  if (!is_even (format, rows))
    return "";
  const auto ns = gst_util_uint64_scale (
      GST_SECOND, guint64 (format.rate.den), guint64 (format.rate.num));
  return " TimeIncrement=\"" + seconds_text (ns) + "\"";
}

std::string
plane (std::size_t number, const StackRow &row)
{
  std::string text =
      "<Plane TheZ=\"0\" TheT=\"" + std::to_string (number) + "\" TheC=\"0\"";
  if (GST_CLOCK_TIME_IS_VALID (row.pts))
    text += " DeltaT=\"" + seconds_text (row.pts) + "\"";
  if (GST_CLOCK_TIME_IS_VALID (row.exposure))
    text += " ExposureTime=\"" + seconds_text (row.exposure) + "\"";
  return text + "/>\n";
}

/* The columns of times.csv, with the number of the picture for its file. */
std::string
table (const std::vector<StackRow> &rows)
{
  std::string text = "picture,frame,slot,pts_ns,duration_ns,synchronised,"
                     "corrupted,lost_before\n";
  for (std::size_t i = 0; i < rows.size (); i++) {
    const StackRow &row = rows[i];
    const auto truth = [] (bool value) { return value ? "true" : "false"; };
    text += std::to_string (i) + "," +
            (row.frame ? std::to_string (*row.frame) : "") + "," +
            (row.slot >= 0 ? std::to_string (row.slot) : "") + "," +
            time_text (row.pts) + "," + time_text (row.duration) + "," +
            (row.synchronised ? truth (*row.synchronised) : "unknown") + "," +
            truth (row.corrupted) + "," + std::to_string (row.lost_before) +
            "\n";
  }
  return text;
}

std::string
annotation (
    std::size_t number, const std::string &name, const std::string &value)
{
  return "<CommentAnnotation ID=\"Annotation:" + std::to_string (number) +
         "\" Namespace=\"codedexposure/" + name + "\"><Value>" +
         escaped (value) + "</Value></CommentAnnotation>\n";
}

/* The OME-XML (schema 2016-06) of pictures, one for each row, over time. Their
 * exact times and what OME has no word for are in annotations. */
std::string
ome_xml (const StackFormat &format, const std::vector<StackRow> &rows,
    const std::vector<StackOrigin> &origins, const char *description)
{
  const std::string count = std::to_string (rows.size ());
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\" "
      "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
      "xsi:schemaLocation=\"http://www.openmicroscopy.org/Schemas/OME/2016-06 "
      "http://www.openmicroscopy.org/Schemas/OME/2016-06/ome.xsd\" "
      "Creator=\"gst-codedexposure\">\n"
      "<Image ID=\"Image:0\"><Description>" +
      escaped (description) +
      "</Description>\n<Pixels ID=\"Pixels:0\" DimensionOrder=\"XYZCT\" Type="
      "\"" +
      (format.bytes == 1 ? "uint8" : "uint16") + "\" SignificantBits=\"" +
      std::to_string (format.bits) + "\" BigEndian=\"" +
      (G_BYTE_ORDER == G_BIG_ENDIAN ? "true" : "false") + "\" SizeX=\"" +
      std::to_string (format.width) + "\" SizeY=\"" +
      std::to_string (format.height) + "\" SizeZ=\"1\" SizeC=\"1\" SizeT=\"" +
      count + "\"" + interval (format, rows) +
      ">\n<Channel ID=\"Channel:0\" SamplesPerPixel=\"1\"/>\n"
      "<TiffData IFD=\"0\" PlaneCount=\"" +
      count + "\"/>\n";
  for (std::size_t i = 0; i < rows.size (); i++)
    text += plane (i, rows[i]);
  text += "</Pixels>\n";
  for (std::size_t i = 0; i <= origins.size (); i++)
    text += "<AnnotationRef ID=\"Annotation:" + std::to_string (i) + "\"/>";
  text += "</Image>\n<StructuredAnnotations>\n" +
          annotation (0, "pictures", table (rows));
  for (std::size_t i = 0; i < origins.size (); i++) {
    const std::string from = std::to_string (origins[i].picture);
    text += annotation (i + 1, "origin/" + from, origins[i].json);
  }
  return text + "</StructuredAnnotations>\n</OME>\n";
}

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
  void finish (bool whole) override;

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
  std::unique_ptr<TIFF, FreeWith<TIFFClose>> tiff_;
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
OmeTiff::finish (bool whole)
{
  errno = 0;
  check (TIFFSetDirectory (tiff_.get (), 0) == 1);
  set (TIFFTAG_IMAGEDESCRIPTION,
      ome_xml (format_, rows_, origins_, whole ? "" : kBrokenOff).c_str ());
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
