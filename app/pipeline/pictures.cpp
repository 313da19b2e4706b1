/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "pictures.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <optional>
#include <regex>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "pipeline/graph.h"
#include "pipeline/messages.h"
#include "pipeline/pads.h"

namespace codedexposure::app
{

using namespace gst;
namespace fs = std::filesystem;

namespace
{

/* A text that is formatted back to itself. */
std::string
escaped (const std::string &text)
{
  return std::regex_replace (text, std::regex ("%"), "%%");
}

/* 0, if the caps at @pad have no fixed rate. */
double
rate_at (GstPad *pad)
{
  const CapsPtr caps (pad ? gst_pad_get_current_caps (pad) : nullptr);
  gint num = 0, den = 1;
  if (!caps ||
      !gst_structure_get_fraction (
          gst_caps_get_structure (caps.get (), 0), "framerate", &num, &den))
    return 0;
  return double (num) / den;
}

/* A name as a field of the table. */
std::string
field_of (const std::string &name)
{
  if (name.find_first_of (",\"") == name.npos)
    return name;
  std::ostringstream field;
  field << std::quoted (name, '"', '"');
  return field.str ();
}

/* The name in the first field of a line of the table. */
std::string
first_name (const std::string &line)
{
  static const std::regex quoted ("\"((?:[^\"]|\"\")*)\",.*");
  static const std::regex twice ("\"\"");
  std::smatch found;
  return std::regex_match (line, found, quoted)
             ? std::regex_replace (found.str (1), twice, "\"")
             : line.substr (0, line.find (','));
}

/* Whether @path is a PNG file up to its last chunk. */
bool
is_complete (const std::string &path)
{
  constexpr std::string_view kEnd ("IEND\xae\x42\x60\x82", 8);
  std::ifstream file (path, std::ios::binary);
  std::string end (kEnd.size (), '\0');
  return file.seekg (-std::streamoff (end.size ()), std::ios::end) &&
         file.read (end.data (), std::streamsize (end.size ())) && end == kEnd;
}

} // namespace

Result<PictureNames>
PictureNames::parse (const std::string &format)
{
  static const std::regex pattern (
      R"((?:((?:[^%]|%%)*)/)?([^%/]*)(%(?:0[1-9])?d)([^%/]*))");
  std::smatch parts;
  if (!std::regex_match (format, parts, pattern))
    return Error{format + " has other numbers than one %d or %06d in the name "
                          "of its pictures; name a folder, such as pictures/"};
  return PictureNames{
      std::regex_replace (parts[1].str (), std::regex ("%%"), "%"), parts[2],
      parts[3], parts[4]};
}

bool
PictureNames::include (const std::string &file) const
{
  if (file == table ())
    return true;
  const std::size_t around = prefix.size () + suffix.size ();
  if (file.size () <= around || !file.starts_with (prefix) ||
      !file.ends_with (suffix))
    return false;
  return std::all_of (file.begin () + gssize (prefix.size ()),
      file.end () - gssize (suffix.size ()),
      [] (char c) { return c >= '0' && c <= '9'; });
}

std::string
PictureNames::picture (gint index) const
{
  const int width = number == "%d" ? 1 : number[2] - '0';
  const std::string digits = app::format ("%0*d", width, index);
  return prefix + digits + suffix;
}

std::string
PictureNames::path (const std::string &file) const
{
  return folder.empty () ? file : folder + "/" + file;
}

Pictures::Pictures (GstElement *sink, GstPad *coded, const std::string &format)
    : Output (format, {}), sink_ (sink), coded_ (coded), format_ (format)
{
  if (auto names = PictureNames::parse (format))
    names_ = *std::move (names);
}

std::string
Pictures::place () const
{
  return fills_named_folder ()
             ? names_.folder
             : names_.path (names_.prefix + names_.number + names_.suffix);
}

Result<void>
Pictures::check_unused () const
{
  std::error_code ignored;
  const fs::path folder = names_.folder.empty () ? "." : names_.folder;
  for (const auto &entry : fs::directory_iterator (folder, ignored)) {
    const std::string file = entry.path ().filename ();
    if (names_.fill_folder ())
      return Error{name_ + " is not empty; choose another folder, or set "
                           "--force to replace the pictures of an earlier run"};
    if (names_.include (file))
      return Error{names_.path (file) + " exists; choose another name, or set "
                                        "--force to replace it"};
  }
  return {};
}

Result<void>
Pictures::check_name (bool replace)
{
  if (const auto names = PictureNames::parse (format_); !names)
    return names.error ();
  name_ = place () + (fills_named_folder () ? "/" : "");
  std::error_code ignored;
  if (!names_.folder.empty () && fs::exists (names_.folder, ignored) &&
      !fs::is_directory (names_.folder, ignored))
    return Error{names_.folder + " is a file; name a folder"};
  return replace ? Result<void> () : check_unused ();
}

Result<void>
Pictures::claim (bool replace)
{
  replace_ = replace;
  part_ = std::make_unique<Part> (place (), Part::kFolder);
  if (auto claimed = part_->claim (replace); !claimed)
    return claimed;
  table_.reset (
      std::fopen ((part_->path () + "/" + names_.table ()).c_str (), "w"));
  if (!table_) {
    discard ();
    return Error{"cannot write the table of " + name_ + ": " +
                 std::generic_category ().message (errno)};
  }
  g_object_set (sink_, "location",
      (escaped (part_->path ()) + "/" + names_.prefix + names_.number +
          names_.suffix)
          .c_str (),
      nullptr);
  write_line ("file,frame,slot,pts_ns,duration_ns,synchronised,corrupted,"
              "lost_before");
  const ObjectPtr<GstPad> sink = pad_of (sink_, "sink");
  watch_buffers (sink.get (),
      [this] (GstPad *pad, GstBuffer *picture) { add (pad, picture); });
  watch_flags (sink.get ());
  return {};
}

/* An encoder drops the flags of its pictures, and gives each on at once. */
void
Pictures::watch_flags (GstPad *sink_pad)
{
  const auto encoder = element_behind (sink_pad);
  const ObjectPtr<GstPad> pad (
      encoder ? gst_element_get_static_pad (encoder.get (), "sink") : nullptr);
  if (pad)
    watch_buffers (pad.get (), [this] (GstPad *, GstBuffer *picture) {
      corrupted_ = is_corrupted (picture);
    });
}

/* The slot of the recording, also of a frame that comes late; otherwise, or if
 * that number is taken, the number after the last. */
gint
Pictures::next_index (GstPad *pad, const std::optional<FrameMeta> &meta)
{
  const double slots = rate_at (pad) / std::max (rate_at (coded_), 1e-9);
  const guint64 most = std::numeric_limits<gint>::max ();
  const gint after = taken_.empty () ? 0 : *taken_.rbegin () + 1;
  guint64 number = most + 1;
  if (meta && slots >= 0.5 && slots <= 1e6 && meta->frame <= most)
    number = meta->frame * guint64 (slots + 0.5) +
             guint64 (std::max (meta->subframe, 0));
  const gint index =
      number > most || taken_.contains (gint (number)) ? after : gint (number);
  taken_.insert (index);
  return index;
}

/* Before the sink writes @picture. The last one is complete. */
void
Pictures::add (GstPad *pad, GstBuffer *picture)
{
  write_line (line_);
  const auto meta = get_frame_meta (picture);
  const gint index = next_index (pad, meta);
  g_object_set (sink_, "index", index, nullptr);
  last_ = names_.picture (index);
  const char *synchronised = "unknown";
  if (meta && meta->locked)
    synchronised = *meta->locked ? "true" : "false";
  line_ = format ("%s,%s,%s,%s,%s,%s,%s,%" G_GUINT64_FORMAT,
      field_of (last_).c_str (),
      meta ? std::to_string (meta->frame).c_str () : "",
      meta && meta->subframe >= 0 ? std::to_string (meta->subframe).c_str ()
                                  : "",
      time_text (stream_time (pad, GST_BUFFER_PTS (picture))).c_str (),
      time_text (GST_BUFFER_DURATION (picture)).c_str (), synchronised,
      corrupted_ ? "true" : "false", meta ? meta->lost_before : 0);
  frames_++;
}

void
Pictures::write_line (const std::string &line)
{
  if (!line.empty () && std::fprintf (table_.get (), "%s\n", line.c_str ()) < 0)
    table_failed_ = true;
}

/* Deletes the pictures that the table of an earlier run lists. */
void
Pictures::remove_earlier () const
{
  std::ifstream table (names_.path (names_.table ()));
  std::error_code ignored;
  for (std::string line; std::getline (table, line);) {
    const std::string file = first_name (line);
    if (names_.include (file))
      fs::remove (names_.path (file), ignored);
  }
}

void
Pictures::name_element ()
{
  g_object_set (sink_, "location", format_.c_str (), nullptr);
}

std::string
Pictures::table () const
{
  return PictureNames::parse (format_) ? names_.path (names_.table ()) : "";
}

std::string
Pictures::preparation () const
{
  return names_.folder.empty ()
             ? ""
             : "mkdir -p -- " + shell_word (names_.folder) + " && ";
}

bool
Pictures::has_content () const
{
  return frames_ > 1 ||
         (frames_ == 1 && is_complete (part_->path () + "/" + last_));
}

Result<void>
Pictures::publish ()
{
  const std::string last = part_->path () + "/" + last_;
  std::error_code error;
  if (is_complete (last)) {
    write_line (line_);
  } else { // the disk is full, or the run was stopped
    fs::remove (last, error);
    frames_--;
  }
  table_failed_ |= std::fclose (table_.release ()) != 0;
  if (table_failed_)
    return Error{"cannot write the table of times in " + part_->path () +
                 "; the pictures are there"};
  if (!names_.folder.empty ())
    fs::create_directories (names_.folder, error);
  if (replace_)
    remove_earlier ();
  std::vector<std::string> files;
  for (const auto &entry : fs::directory_iterator (part_->path (), error))
    files.push_back (entry.path ().filename ());
  for (const std::string &file : files)
    if (auto moved = move_file (
            part_->path () + "/" + file, names_.path (file), replace_);
        !moved)
      return moved;
  discard ();
  return {};
}

} // namespace codedexposure::app
