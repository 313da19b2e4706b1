/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include <array>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include <hdf5.h>

#include "base/result.h"
#include "stack_file.h"

namespace codedexposure::gst
{

namespace
{

/* The library is not made for threads. */
std::mutex library;

/* The reason of the system alone, if @text has one among its addresses and
 * sizes. */
std::string
reason_in (const std::string &text)
{
  constexpr std::string_view kBefore = "error message = '";
  const std::size_t at = text.find (kBefore);
  if (at == std::string::npos)
    return text;
  const std::size_t begin = at + kBefore.size ();
  return text.substr (begin, text.find ('\'', begin) - begin);
}

/* The innermost error, which has the reason. */
[[noreturn]] void
fail ()
{
  std::string text;
  const auto take = [] (unsigned, const H5E_error2_t *error, void *to) {
    auto &text = *static_cast<std::string *> (to);
    if (text.empty () && error->desc)
      text = error->desc;
    return herr_t (0);
  };
  H5Ewalk2 (H5E_DEFAULT, H5E_WALK_UPWARD, take, &text);
  throw Error{reason_in (text), ErrorCode::io};
}

void
check (herr_t status)
{
  if (status < 0)
    fail ();
}

/** An object of the library. */
class Object
{
public:
  using Close = herr_t (*) (hid_t);

  Object () = default;
  Object (hid_t id, Close close) : id_ (id), close_ (close)
  {
    if (id < 0)
      fail ();
  }
  ~Object () { reset (); }
  Object (Object &&other) noexcept
      : id_ (std::exchange (other.id_, -1)), close_ (other.close_)
  {
  }
  Object &operator= (Object &&other) noexcept
  {
    reset ();
    id_ = std::exchange (other.id_, -1);
    close_ = other.close_;
    return *this;
  }
  operator hid_t () const { return id_; }
  herr_t reset () { return id_ < 0 ? 0 : close_ (std::exchange (id_, -1)); }

private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

Object
text_type ()
{
  Object type (H5Tcopy (H5T_C_S1), H5Tclose);
  check (H5Tset_size (type, H5T_VARIABLE));
  check (H5Tset_cset (type, H5T_CSET_UTF8));
  return type;
}

Object
truth_type (bool with_unknown)
{
  Object type (H5Tenum_create (H5T_NATIVE_INT8), H5Tclose);
  const std::pair<const char *, gint8> names[] = {
      {"FALSE", gint8 (0)}, {"TRUE", gint8 (1)}, {"UNKNOWN", gint8 (-1)}};
  for (const auto &[name, value] : names)
    if (value >= 0 || with_unknown)
      check (H5Tenum_insert (type, name, &value));
  return type;
}

void
set_attribute (hid_t object, const char *name, hid_t type, const void *value)
{
  const Object space (H5Screate (H5S_SCALAR), H5Sclose);
  const Object attribute (
      H5Acreate2 (object, name, type, space, H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  check (H5Awrite (attribute, type, value));
}

void
set_attribute (hid_t object, const char *name, const char *text)
{
  set_attribute (object, name, text_type (), &text);
}

/** A data set that grows along its first axis. */
class Column
{
public:
  Column (hid_t file, const char *name, Object type,
      std::vector<hsize_t> shape = {}, hsize_t chunk = 1024,
      bool deflate = false)
      : type_ (std::move (type)), shape_ (std::move (shape))
  {
    shape_.insert (shape_.begin (), 0);
    std::vector<hsize_t> most = shape_, block = shape_;
    most[0] = H5S_UNLIMITED;
    block[0] = chunk;
    const int rank = int (shape_.size ());
    const Object space (
        H5Screate_simple (rank, shape_.data (), most.data ()), H5Sclose);
    const Object options (H5Pcreate (H5P_DATASET_CREATE), H5Pclose);
    /* The same pictures give the same bytes. */
    check (H5Pset_obj_track_times (options, false));
    check (H5Pset_chunk (options, rank, block.data ()));
    if (deflate && H5Tget_size (type_) > 1)
      check (H5Pset_shuffle (options));
    if (deflate)
      check (H5Pset_deflate (options, 1));
    set_ = Object (H5Dcreate2 (file, name, type_, space, H5P_DEFAULT, options,
                       H5P_DEFAULT),
        H5Dclose);
  }

  void append (const void *values, hsize_t count)
  {
    std::vector<hsize_t> begin (shape_.size ()), block = shape_;
    begin[0] = std::exchange (shape_[0], shape_[0] + count);
    block[0] = count;
    check (H5Dset_extent (set_, shape_.data ()));
    const Object to (H5Dget_space (set_), H5Sclose);
    check (H5Sselect_hyperslab (
        to, H5S_SELECT_SET, begin.data (), nullptr, block.data (), nullptr));
    const Object from (
        H5Screate_simple (int (block.size ()), block.data (), nullptr),
        H5Sclose);
    check (H5Dwrite (set_, type_, from, to, H5P_DEFAULT, values));
  }
  void close () { check (set_.reset ()); }

private:
  Object type_, set_;
  std::vector<hsize_t> shape_;
};

Object
copy_of (hid_t type)
{
  return Object (H5Tcopy (type), H5Tclose);
}

/* A part of this program has locked the file, which the library would take for
 * another program. */
Object
create_file (const std::string &path)
{
  /* At the end of the process, the library writes again what a full disk did
   * not take, and crashes. Files are closed here. */
  H5dont_atexit ();
  H5Eset_auto2 (H5E_DEFAULT, nullptr, nullptr);
  const Object access (H5Pcreate (H5P_FILE_ACCESS), H5Pclose);
  check (H5Pset_file_locking (access, 0, 1));
  return Object (
      H5Fcreate (path.c_str (), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
}

class Hdf5 : public StackFile
{
public:
  /** With the library locked: if it fails, its objects are closed. */
  Hdf5 (const std::string &path, const StackFormat &format);
  ~Hdf5 () override;

  void add_origin (const std::string &json) override;
  void add (const StackRow &row, const guint8 *pixels, gsize stride) override;
  void finish (bool whole) override;

private:
  void flush ();

  const StackFormat format_;
  guint64 pictures_ = 0;
  std::vector<StackRow> waiting_; // to be written
  std::vector<guint8> packed_;    // a picture without padding
  Object file_;
  std::vector<Column> columns_;
};

gint64
known (GstClockTime time)
{
  return GST_CLOCK_TIME_IS_VALID (time) ? gint64 (time) : -1;
}

/* The columns after the pictures, a number for each. */
enum class Type { number, truth, truth_or_unknown };
constexpr std::pair<const char *, Type> kRowColumns[] = {
    {"pts_ns", Type::number}, {"duration_ns", Type::number},
    {"exposure_ns", Type::number}, {"frame", Type::number},
    {"slot", Type::number}, {"synchronised", Type::truth_or_unknown},
    {"corrupted", Type::truth}, {"lost_before", Type::number}};
constexpr std::size_t kNumbers = std::size (kRowColumns);
constexpr std::size_t kPictures = 0, kOrigin = kNumbers + 1,
                      kOriginPicture = kOrigin + 1;

std::array<gint64, kNumbers>
numbers_of (const StackRow &row)
{
  return {known (row.pts), known (row.duration), known (row.exposure),
      row.frame ? gint64 (*row.frame) : -1, row.slot,
      row.synchronised ? gint64 (*row.synchronised) : -1, row.corrupted,
      gint64 (row.lost_before)};
}

Hdf5::Hdf5 (const std::string &path, const StackFormat &format)
    : format_ (format)
{
  file_ = create_file (path);
  set_attribute (file_, "format", "codedexposure-stack");
  const int version = 1;
  set_attribute (file_, "version", H5T_NATIVE_INT, &version);
  set_attribute (file_, "status",
      "unfinished: the program that wrote this file was killed, or is still "
      "writing it");
  set_attribute (file_, "significant_bits", H5T_NATIVE_INT, &format.bits);
  if (const double rate = double (format.rate.num) / format.rate.den; rate > 0)
    set_attribute (file_, "rate_hz", H5T_NATIVE_DOUBLE, &rate);

  columns_.emplace_back (file_, "pictures",
      copy_of (format.bytes == 1 ? H5T_NATIVE_UINT8 : H5T_NATIVE_UINT16),
      std::vector<hsize_t>{hsize_t (format.height), hsize_t (format.width)}, 1,
      format.deflate);
  for (const auto &[name, type] : kRowColumns)
    columns_.emplace_back (file_, name,
        type == Type::number ? copy_of (H5T_NATIVE_INT64)
                             : truth_type (type == Type::truth_or_unknown));
  columns_.emplace_back (
      file_, "origin", text_type (), std::vector<hsize_t>{}, 16);
  columns_.emplace_back (file_, "origin_picture", copy_of (H5T_NATIVE_INT64));
  flush ();
}

Hdf5::~Hdf5 ()
{
  const std::lock_guard lock (library);
  columns_.clear ();
  file_.reset ();
}

void
Hdf5::add_origin (const std::string &json)
{
  const std::lock_guard lock (library);
  const char *text = json.c_str ();
  const auto picture = gint64 (pictures_);
  columns_[kOrigin].append (&text, 1);
  columns_[kOriginPicture].append (&picture, 1);
  check (H5Fflush (file_, H5F_SCOPE_LOCAL));
}

/* The library writes its tables only when it is told to, and what they do not
 * list is lost if the program is killed. */
void
Hdf5::add (const StackRow &row, const guint8 *pixels, gsize stride)
{
  constexpr std::size_t kFlush = 25;
  const std::lock_guard lock (library);
  const gsize length = gsize (format_.width) * gsize (format_.bytes);
  if (length != stride) {
    packed_.clear ();
    for (int y = 0; y < format_.height; y++) {
      const guint8 *line = pixels + gsize (y) * stride;
      packed_.insert (packed_.end (), line, line + length);
    }
    pixels = packed_.data ();
  }
  columns_[kPictures].append (pixels, 1);
  pictures_++;
  waiting_.push_back (row);
  if (waiting_.size () >= kFlush)
    flush ();
}

void
Hdf5::flush ()
{
  const std::vector<StackRow> rows = std::exchange (waiting_, {});
  for (std::size_t i = 0; i < kNumbers && !rows.empty (); i++) {
    std::vector<gint64> values;
    for (const StackRow &row : rows)
      values.push_back (numbers_of (row)[i]);
    const std::vector<gint8> bytes (values.begin (), values.end ());
    if (kRowColumns[i].second == Type::number)
      columns_[i + 1].append (values.data (), rows.size ());
    else
      columns_[i + 1].append (bytes.data (), rows.size ());
  }
  check (H5Fflush (file_, H5F_SCOPE_LOCAL));
}

void
Hdf5::finish (bool whole)
{
  const std::lock_guard lock (library);
  flush ();
  check (H5Adelete (file_, "status"));
  set_attribute (file_, "status", whole ? "complete" : kBrokenOff);
  for (Column &column : columns_)
    column.close ();
  check (file_.reset ());
}

} // namespace

std::unique_ptr<StackFile>
open_hdf5 (const std::string &path, const StackFormat &format)
{
  const std::lock_guard lock (library);
  return std::make_unique<Hdf5> (path, format);
}

} // namespace codedexposure::gst
