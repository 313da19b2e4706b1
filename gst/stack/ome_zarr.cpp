/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* OME-Zarr 0.5: a folder that any part of can be read, and at any moment.
 *
 * Zarr v3, https://zarr-specs.readthedocs.io/en/latest/v3/core/index.html, with
 * its codecs "sharding_indexed" and "crc32c"; OME-Zarr 0.5,
 * https://ngff.openmicroscopy.org/0.5/. */
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include <nlohmann/json.hpp>
#include <zstd.h>

#include "base/result.h"
#include "common/meta.h"
#include "common/raii.h"
#include "stack_file.h"

namespace codedexposure::gst
{

namespace
{

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int kZstdLevel = 1;

using FilePtr = std::unique_ptr<std::FILE, FreeWith<std::fclose>>;

[[noreturn]] void
fail ()
{
  throw Error{g_strerror (errno), ErrorCode::io};
}

/* Castagnoli's polynomial, RFC 3720, appendix B.4. */
guint32
crc32c (const std::vector<guint8> &bytes)
{
  constexpr guint32 kPolynomial = 0x82F63B78;
  guint32 crc = ~guint32 (0);
  for (const guint8 byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; bit++)
      crc = crc >> 1 ^ (crc & 1 ? kPolynomial : 0);
  }
  return ~crc;
}

void
append_le (std::vector<guint8> &to, guint64 value, int bytes)
{
  for (int k = 0; k < bytes; k++)
    to.push_back (guint8 (value >> (8 * k)));
}

constexpr const char *kNext = ".next"; // while it is written

/** A file whose content is always whole for those that read it. */
void
replace_file (const std::string &path, const std::string &content)
{
  const std::string next = path + kNext;
  std::FILE *file = std::fopen (next.c_str (), "wb");
  if (!file)
    fail ();
  const bool written = std::fwrite (content.data (), 1, content.size (),
                           file) == content.size ();
  if ((std::fclose (file) != 0) | !written ||
      std::rename (next.c_str (), path.c_str ()) != 0)
    fail ();
}

/** Several pictures in a file that ends with their places. It has its name when
 * it is whole. */
class Shard
{
public:
  Shard (std::string path, std::size_t pictures)
      : path_ (std::move (path)),
        file_ (std::fopen ((path_ + kNext).c_str (), "wb")),
        places_ (pictures, {~guint64 (0), ~guint64 (0)})
  {
    if (!file_)
      fail ();
  }

  bool is_full () const { return next_ == places_.size (); }
  void add (const std::vector<guint8> &picture)
  {
    write (picture);
    places_[next_++] = {end_, picture.size ()};
    end_ += picture.size ();
  }
  void finish ()
  {
    std::vector<guint8> index;
    for (const auto &[begin, size] : places_) {
      append_le (index, begin, 8);
      append_le (index, size, 8);
    }
    append_le (index, crc32c (index), 4);
    write (index);
    if (std::fclose (file_.release ()) != 0 ||
        std::rename ((path_ + kNext).c_str (), path_.c_str ()) != 0)
      fail ();
  }

private:
  void write (const std::vector<guint8> &bytes)
  {
    if (std::fwrite (bytes.data (), 1, bytes.size (), file_.get ()) !=
        bytes.size ())
      fail ();
  }

  const std::string path_;
  FilePtr file_;
  std::vector<std::pair<guint64, guint64>> places_; // begin, size
  std::size_t next_ = 0;
  guint64 end_ = 0;
};

class OmeZarr : public StackFile
{
public:
  OmeZarr (const std::string &path, const StackFormat &format);

  void add_origin (const std::string &json) override;
  void add (const StackRow &row, const guint8 *pixels, gsize stride) override;
  void finish (bool whole) override;

private:
  Json codecs () const;
  void describe (const char *status);
  void describe_pictures ();
  void pack (const guint8 *pixels, gsize stride);
  void finish_shard ();

  const std::string path_;
  const StackFormat format_;
  const std::size_t shard_; // pictures
  guint64 pictures_ = 0;
  Json origins_ = Json::array ();
  std::vector<guint8> packed_, compressed_; // a picture
  std::unique_ptr<Shard> current_;
  std::string times_; // of its pictures, lines of the table
  FilePtr table_;
};

/* A kill costs those of the last shard, at most, which is a second at 100
 * pictures/s; and an hour of them is some thousand files. */
std::size_t
pictures_in_shard (const StackFormat &format)
{
  constexpr std::size_t kBytes = std::size_t (64) << 20, kMost = 100;
  return std::clamp<std::size_t> (
      kBytes / (std::size_t (format.width) * std::size_t (format.height) *
                   std::size_t (format.bytes)),
      1, kMost);
}

OmeZarr::OmeZarr (const std::string &path, const StackFormat &format)
    : path_ (path), format_ (format), shard_ (pictures_in_shard (format))
{
  std::error_code error;
  fs::remove_all (path_ + "/0/c", error); // a longer stack was here
  if (!error)
    fs::create_directories (path_ + "/0/c", error);
  if (error)
    throw Error{error.message (), ErrorCode::io};
  table_.reset (std::fopen ((path_ + "/times.csv").c_str (), "wb"));
  if (!table_ ||
      std::fputs ("picture,pts_ns,duration_ns,exposure_ns,frame,slot,"
                  "synchronised,corrupted,lost_before\n",
          table_.get ()) < 0)
    fail ();
  describe_pictures ();
  describe ("unfinished: the program that wrote this folder was killed, or is "
            "still writing it");
}

/* The group, with what OME asks for and what is known of the pictures. */
void
OmeZarr::describe (const char *status)
{
  const bool has_rate = format_.rate.num > 0;
  const double step =
      has_rate ? double (format_.rate.den) / format_.rate.num : 1;
  Json time{{"name", "t"}, {"type", "time"}};
  if (has_rate)
    time["unit"] = "second";
  const Json scale{{"type", "scale"}, {"scale", {step, 1, 1}}};
  const Json set{
      {"path", "0"}, {"coordinateTransformations", Json::array ({scale})}};
  const Json axes = Json::array ({time, {{"name", "y"}, {"type", "space"}},
      {{"name", "x"}, {"type", "space"}}});
  Json own{{"format", "codedexposure-stack"}, {"version", 1},
      {"status", status}, {"significant_bits", format_.bits}};
  if (has_rate)
    own["rate_hz"] = 1 / step;
  own["origins"] = origins_;
  const Json group{{"zarr_format", 3}, {"node_type", "group"},
      {"attributes",
          {{"ome", {{"version", "0.5"},
                       {"multiscales",
                           Json::array ({{{"name", "pictures"}, {"axes", axes},
                               {"datasets", Json::array ({set})}}})}}},
              {"codedexposure", own}}}};
  replace_file (path_ + "/zarr.json", group.dump (2));
}

Json
OmeZarr::codecs () const
{
  const Json little{
      {"name", "bytes"}, {"configuration", {{"endian", "little"}}}};
  Json of_picture = Json::array ({little});
  if (format_.deflate)
    of_picture.push_back ({{"name", "zstd"},
        {"configuration", {{"level", kZstdLevel}, {"checksum", false}}}});
  return Json::array ({{{"name", "sharding_indexed"},
      {"configuration",
          {{"chunk_shape", {1, format_.height, format_.width}},
              {"codecs", of_picture},
              {"index_codecs", Json::array ({little, {{"name", "crc32c"}}})},
              {"index_location", "end"}}}}});
}

/* As many as there are now. */
void
OmeZarr::describe_pictures ()
{
  const Json array{{"zarr_format", 3}, {"node_type", "array"},
      {"shape", {pictures_, format_.height, format_.width}},
      {"data_type", format_.bytes == 1 ? "uint8" : "uint16"},
      {"chunk_grid",
          {{"name", "regular"},
              {"configuration",
                  {{"chunk_shape", {shard_, format_.height, format_.width}}}}}},
      {"chunk_key_encoding",
          {{"name", "default"}, {"configuration", {{"separator", "/"}}}}},
      {"fill_value", 0}, {"codecs", codecs ()},
      {"dimension_names", {"t", "y", "x"}}, {"attributes", Json::object ()}};
  replace_file (path_ + "/0/zarr.json", array.dump (2));
}

void
OmeZarr::add_origin (const std::string &json)
{
  origins_.push_back ({{"picture", pictures_}, {"origin", Json::parse (json)}});
  describe ("unfinished: the program that wrote this folder was killed, or is "
            "still writing it");
}

/* Without padding, and compressed. */
void
OmeZarr::pack (const guint8 *pixels, gsize stride)
{
  const gsize length = gsize (format_.width) * gsize (format_.bytes);
  packed_.clear ();
  for (int y = 0; y < format_.height; y++) {
    const guint8 *line = pixels + gsize (y) * stride;
    packed_.insert (packed_.end (), line, line + length);
  }
  if (!format_.deflate)
    return;
  compressed_.resize (ZSTD_compressBound (packed_.size ()));
  const std::size_t size = ZSTD_compress (compressed_.data (),
      compressed_.size (), packed_.data (), packed_.size (), kZstdLevel);
  if (ZSTD_isError (size))
    throw Error{ZSTD_getErrorName (size)};
  compressed_.resize (size);
  std::swap (packed_, compressed_);
}

void
OmeZarr::add (const StackRow &row, const guint8 *pixels, gsize stride)
{
  if (!current_) {
    const std::string folder =
        path_ + "/0/c/" + std::to_string (pictures_ / shard_) + "/0";
    std::error_code error;
    fs::create_directories (folder, error);
    current_ = std::make_unique<Shard> (folder + "/0", shard_);
  }
  pack (pixels, stride);
  current_->add (packed_);
  times_ += std::to_string (pictures_) + "," + time_text (row.pts) + "," +
            time_text (row.duration) + "," + time_text (row.exposure) + "," +
            (row.frame ? std::to_string (*row.frame) : "") + "," +
            (row.slot < 0 ? "" : std::to_string (row.slot)) + "," +
            (row.synchronised ? *row.synchronised ? "true" : "false" : "") +
            "," + (row.corrupted ? "true" : "false") + "," +
            std::to_string (row.lost_before) + "\n";
  pictures_++;
  if (current_->is_full ())
    finish_shard ();
}

/* First the pictures, then their times, then their number: what is counted is
 * there. */
void
OmeZarr::finish_shard ()
{
  current_->finish ();
  current_.reset ();
  if (std::fputs (std::exchange (times_, "").c_str (), table_.get ()) < 0 ||
      std::fflush (table_.get ()) != 0)
    fail ();
  describe_pictures ();
}

void
OmeZarr::finish (bool whole)
{
  if (current_)
    finish_shard ();
  if (std::fclose (table_.release ()) != 0)
    fail ();
  describe (whole ? "complete" : kBrokenOff);
}

} // namespace

std::unique_ptr<StackFile>
open_ome_zarr (const std::string &path, const StackFormat &format)
{
  return std::make_unique<OmeZarr> (path, format);
}

} // namespace codedexposure::gst
