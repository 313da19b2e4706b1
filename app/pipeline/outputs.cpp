/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "outputs.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include <fcntl.h>
#include <unistd.h>

#include "failure.h"
#include "pipeline/graph.h"
#include "pipeline/pads.h"
#include "pipeline/pictures.h"
#include "record/matroska.h"

namespace codedexposure::app
{

using namespace gst;
namespace fs = std::filesystem;

namespace
{

/* Without its index, which comes after the first second, no program plays it.
 * A file consists of parts with their length, 4 bytes, and their kind. */
bool
is_mp4_without_index (const std::string &path)
{
  std::error_code ignored;
  if (!fs::is_regular_file (path, ignored))
    return false;
  std::ifstream file (path, std::ios::binary);
  const std::uint64_t size = fs::file_size (path, ignored);
  std::uint64_t at = 0, length = 0;
  for (unsigned char head[16] = {}; at < size; at += length) {
    file.seekg (std::streamoff (at));
    file.read (reinterpret_cast<char *> (head), sizeof head);
    length = GST_READ_UINT32_BE (head);
    if (length == 1) // it does not fit
      length = GST_READ_UINT64_BE (head + 8);
    if (length < 8 || length > size - at)
      return true;
    if (std::memcmp (head + 4, "moov", 4) == 0)
      return false;
    file.clear ();
  }
  return true;
}

class File : public Output
{
public:
  File (GstElement *element, const char *property, const std::string &name,
      const FileKind &of_kind)
      : Output (name, of_kind), element_ (element), property_ (property)
  {
    part_ = std::make_unique<Part> (
        name_, kind.folder_with ? Part::kFolder : Part::kFile);
    if (kind.frames)
      pad_.reset (GST_PAD (gst_object_ref (kind.frames)));
  }

  Result<void> check_name (bool replace) override
  {
    std::error_code ignored;
    if (kind.folder_with && fs::exists (name_, ignored) &&
        !fs::exists (fs::path (name_) / kind.folder_with, ignored))
      return Error{name_ + " exists and has another content; choose another "
                           "name"};
    if (!kind.folder_with && fs::is_directory (name_, ignored))
      return Error{name_ + " is a folder; give the name of a file"};
    if (!replace && fs::exists (fs::symlink_status (name_, ignored)))
      return Error{name_ + " exists; choose another name, or set --force to "
                           "replace it"};
    return {};
  }
  Result<void> claim (bool replace) override
  {
    replace_ = replace;
    if (auto claimed = part_->claim (replace); !claimed)
      return claimed;
    g_object_set (element_, property_, part_->path ().c_str (), nullptr);
    if (pad_)
      watch_buffers (
          pad_.get (), [this] (GstPad *, GstBuffer *) { frames_++; });
    return {};
  }
  void name_element () override
  {
    g_object_set (element_, property_, name_.c_str (), nullptr);
  }
  Result<void> finished () const override
  {
    /* Of elements that finish a file only at its end. */
    const bool may_fail =
        g_object_class_find_property (G_OBJECT_GET_CLASS (element_), "problem");
    if (may_fail && !text_property (element_, "problem").empty ())
      return Error{name_ +
                   " could not be finished; what was written "
                   "is in " +
                   part_->path ()};
    return {};
  }
  Result<void> publish () override { return part_->publish (replace_); }
  void recount () override
  {
    if (const auto written = recording_info (part_->path ()); pad_ && written)
      frames_ = written->times.size ();
  }
  bool has_content () const override
  {
    return (!pad_ || frames_ > 0) && !part_->is_empty () &&
           !(name_.ends_with (".mp4") && is_mp4_without_index (part_->path ()));
  }

private:
  GstElement *element_; // of the pipeline, which outlives this
  const char *property_;
  ObjectPtr<GstPad> pad_;
};

/* The files that elements read: those of sources, and those that settings
 * name. */
std::vector<std::string>
inputs_of (GstElement *pipeline)
{
  std::vector<std::string> inputs;
  each_element (pipeline, [&inputs] (GstElement *element) {
    const bool reads =
        GST_OBJECT_FLAG_IS_SET (element, GST_ELEMENT_FLAG_SOURCE);
    for (const char *property : {"location", "schedule", "mapping", "bench"})
      if ((reads || !g_str_equal (property, "location")) &&
          g_object_class_find_property (G_OBJECT_GET_CLASS (element), property))
        inputs.push_back (text_property (element, property));
  });
  return inputs;
}

fs::path
place_of (const std::string &name)
{
  std::error_code error;
  const fs::path whole = fs::absolute (name, error);
  const fs::path canonical = fs::weakly_canonical (whole, error);
  return error ? whole : canonical;
}

/* A link stays, and the file that it leads to is written, also if it is not
 * there yet. One that leads to itself is a file. */
std::string
behind_link (const std::string &name)
{
  std::error_code error;
  const fs::path target = fs::read_symlink (name, error);
  if (error)
    return name;
  const fs::path canonical =
      fs::weakly_canonical (fs::path (name).parent_path () / target, error);
  return error ? name : canonical.string ();
}

bool
lies_in (const fs::path &place, const fs::path &folder)
{
  const fs::path below = place.lexically_relative (folder);
  return below != "." && *below.begin () != "..";
}

} // namespace

Result<void>
check_is_no_input (
    const std::string &output, const std::vector<std::string> &inputs)
{
  std::error_code ignored;
  for (const std::string &input : inputs) {
    if (fs::equivalent (output, input, ignored))
      return Error{output + " is the input; use another name for the output"};
    /* Pictures replace a folder, and the input may be in it. */
    if (fs::is_directory (output, ignored))
      for (fs::path above = fs::absolute (input, ignored).parent_path ();;
           above = above.parent_path ()) {
        if (fs::equivalent (above, output, ignored))
          return Error{output + " holds the input " + input +
                       "; use another folder for the output"};
        if (above == above.parent_path ())
          break;
      }
  }
  return {};
}

Result<void>
check_is_no_recording (const std::string &output)
{
  const auto info = recording_info (output);
  if (!info || !info->setup)
    return {};
  return Error{output +
               " is a recording, which nothing but a recording replaces; use "
               "another name, or delete it yourself"};
}

Outputs::Outputs () = default;
Outputs::~Outputs ()
{
  for (const auto &[name, opened] : pipes_)
    if (opened >= 0)
      close (opened);
}

void
Outputs::file (GstElement *element, const char *property,
    const std::string &name, const FileKind &kind)
{
  std::error_code ignored;
  const auto status = fs::status (name, ignored);
  if (fs::exists (status) && !fs::is_regular_file (status) &&
      !fs::is_directory (status)) {
    g_object_set (element, property, name.c_str (), nullptr);
    if (fs::is_fifo (status))
      pipes_.emplace_back (name, -1);
    return;
  }
  outputs_.push_back (
      std::make_unique<File> (element, property, behind_link (name), kind));
}

void
Outputs::pictures (GstElement *sink, GstPad *coded, const std::string &format)
{
  outputs_.push_back (std::make_unique<Pictures> (sink, coded, format));
}

Result<void>
Outputs::check (GstElement *pipeline) const
{
  std::vector<std::string> inputs = inputs_of (pipeline);
  inputs.insert (inputs.end (), inputs_.begin (), inputs_.end ());
  std::set<fs::path> places;
  for (const auto &output : outputs_) {
    for (const std::string &written : {output->name (), output->unfinished ()})
      if (auto checked = check_is_no_input (written, inputs); !checked)
        return checked;
    if (!output->kind.recording)
      if (auto checked = check_is_no_recording (output->name ()); !checked)
        return checked;
    for (const std::string &written : {output->name (), output->table ()})
      if (!written.empty () && !places.insert (place_of (written)).second)
        return Error{
            written + " is written twice; give each output its own name"};
  }
  for (const auto &output : outputs_)
    for (const fs::path &place : places) {
      const fs::path unfinished = place_of (output->unfinished ());
      if (place == unfinished || lies_in (place, unfinished))
        return Error{output->unfinished () + " is where " + output->name () +
                     " is written until it is complete; use another name"};
      if (output->kind.folder_with &&
          lies_in (place, place_of (output->name ())))
        return Error{place.string () + " lies in " + output->name () +
                     ", which is one output; name a file beside it"};
    }
  return {};
}

std::vector<std::string>
Outputs::claim (bool replace)
{
  std::vector<std::string> errors;
  std::vector<Output *> checked, claimed;
  const auto sort_in = [&errors] (std::vector<Output *> &good, Output *output,
                           const Result<void> &result) {
    if (result)
      good.push_back (output);
    else
      errors.push_back (result.error ().message);
  };
  /* A claim makes folders, which are no content of an earlier run. */
  for (const auto &output : outputs_)
    sort_in (checked, output.get (), output->check_name (replace));
  for (Output *output : checked)
    sort_in (claimed, output, output->claim (replace));
  if (!errors.empty ()) {
    for (Output *output : claimed)
      output->discard ();
    outputs_.clear ();
  }
  return errors;
}

std::string
Outputs::unread_pipe ()
{
  for (auto &[name, opened] : pipes_) {
    if (opened < 0)
      opened = open (name.c_str (), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    if (opened < 0)
      return name;
  }
  return {};
}

std::string
Outputs::name_elements (bool replace)
{
  std::string before;
  for (const auto &output : outputs_) {
    value_of (output->check_name (replace));
    output->name_element ();
    before += output->preparation ();
  }
  return before;
}

std::vector<std::string>
Outputs::finish (Finish how, bool failed)
{
  if (failed)
    for (const auto &output : outputs_)
      output->recount ();
  bool only_sidecars = true, have_frames = false;
  for (const auto &output : outputs_) {
    only_sidecars &= output->kind.sidecar;
    have_frames |= !output->kind.sidecar && output->has_content ();
  }
  std::vector<std::string> errors;
  published_ = how == Finish::publish;
  for (const auto &output : outputs_) {
    const bool described =
        !output->kind.sidecar || only_sidecars || have_frames;
    if (how == Finish::discard || !output->has_content () || !described) {
      output->discard ();
      continue;
    }
    Result<void> done = output->finished ();
    if (done && published_)
      done = output->publish ();
    if (!done) {
      errors.push_back (done.error ().message);
      continue;
    }
    kept_.push_back (output.get ());
  }
  return errors;
}

std::string
Outputs::summary (std::optional<guint64> usual) const
{
  std::string text;
  for (const Output *output : kept_) {
    if (!text.empty ())
      text += output == kept_.back () ? " and " : ", ";
    text += published_ ? output->name () : output->part ();
    if (usual && output->frames () > 0 && output->frames () != *usual)
      text += " (" + std::to_string (output->frames ()) + " frames)";
  }
  return text;
}

std::vector<std::string>
Outputs::names () const
{
  std::vector<std::string> names;
  for (const Output *output : kept_)
    names.push_back (published_ ? output->name () : output->part ());
  return names;
}

} // namespace codedexposure::app
