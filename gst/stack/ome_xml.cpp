/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "ome_xml.h"

#include <cstdlib>

#include "common/raii.h"

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

std::string
known (GstClockTime time)
{
  return GST_CLOCK_TIME_IS_VALID (time) ? std::to_string (time) : "";
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
            known (row.pts) + "," + known (row.duration) + "," +
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

} // namespace

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

} // namespace codedexposure::gst
