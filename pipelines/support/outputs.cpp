/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "outputs.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>
#include <utility>

#include "each_element.h"
#include "pictures.h"
#include "record/matroska.h"

using namespace codedexposure::gst;
using codedexposure::Error;
using codedexposure::Result;
namespace fs = std::filesystem;

namespace
{

/** Elements that write a file, and the property with its name. */
constexpr struct {
  std::string_view factory;
  const char *property;
} kWriters[] = {
    {"codedexposure-filesink", "location"},
    {"codedexposure-log", "location"},
    {"codedexposure-stack", "location"},
    {"filesink", "location"},
    {"moirecalib", "location"},
    {"moirecalib", "report"},
    {"multifilesink", "location"},
    {"subframestats", "location"},
};

std::string
factory_of (GstElement *element)
{
  GstElementFactory *factory = gst_element_get_factory (element);
  return factory ? GST_OBJECT_NAME (factory) : "";
}

std::string
text_property (GstElement *element, const char *property)
{
  gchar *text = nullptr;
  g_object_get (element, property, &text, nullptr);
  const CharPtr owned (text);
  return text ? text : "";
}

/* The pad at which frames for the file of @element are counted: of the muxer or
 * encoder before a filesink, whose own buffers are no frames. */
ObjectPtr<GstPad>
frames_pad (GstElement *element)
{
  ObjectPtr<GstPad> own (gst_element_get_static_pad (element, "sink"));
  const ObjectPtr<GstPad> peer (gst_pad_get_peer (own.get ()));
  const ObjectPtr<GstElement> before (
      peer ? gst_pad_get_parent_element (peer.get ()) : nullptr);
  if (!before || !factory_of (element).ends_with ("filesink"))
    return own;
  for (const char *name : {"video_0", "sink"})
    if (ObjectPtr<GstPad> pad{gst_element_get_static_pad (before.get (), name)})
      return pad;
  return own;
}

class File : public Output
{
public:
  File (GstElement *element, const char *property, const std::string &name)
      : element_ (element), property_ (property), part_ (name, Part::kFile)
  {
  }

  Result<void> claim (bool replace) override
  {
    replace_ = replace;
    const std::string &name = part_.name ();
    std::error_code ignored;
    if (fs::is_directory (name, ignored))
      return Error{name + " is a folder; give the name of a file"};
    if (!replace && fs::exists (fs::symlink_status (name, ignored)))
      return Error{name + " exists; choose another name, or set --force to "
                          "replace it"};
    if (auto claimed = part_.claim (replace); !claimed)
      return claimed;
    g_object_set (element_, property_, part_.path ().c_str (), nullptr);
    const ObjectPtr<GstPad> pad = frames_pad (element_);
    gst_pad_add_probe (
        pad.get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *, gpointer frames) {
          (*static_cast<std::atomic<guint64> *> (frames))++;
          return GST_PAD_PROBE_OK;
        },
        &frames_, nullptr);
    return {};
  }
  Result<void> publish () override
  {
    /* Of elements that finish a file only at its end. */
    const bool may_fail =
        g_object_class_find_property (G_OBJECT_GET_CLASS (element_), "problem");
    if (may_fail && !text_property (element_, "problem").empty ())
      return Error{part_.name () +
                   " could not be finished; what was written "
                   "is in " +
                   part_.path ()};
    if (auto tidied = codedexposure::tidy_matroska (part_.path ()); !tidied)
      return tidied;
    return part_.publish (replace_);
  }
  void discard () override { part_.discard (); }
  bool has_content () const override
  {
    return frames_ > 0 && !part_.is_empty ();
  }
  const std::string &name () const override { return part_.name (); }
  bool is_sidecar () const override
  {
    return !GST_OBJECT_FLAG_IS_SET (element_, GST_ELEMENT_FLAG_SINK);
  }

private:
  GstElement *element_; // of the pipeline, which outlives this
  const char *property_;
  Part part_;
  bool replace_ = false;
};

/* Null: @name is no file of its own, such as /dev/null. */
std::unique_ptr<Output>
output_of (GstElement *element, const char *property, const std::string &name,
    GstPad *coded)
{
  if (factory_of (element) == "multifilesink")
    return std::make_unique<Pictures> (element, coded, name);
  std::error_code ignored;
  const auto status = fs::status (name, ignored);
  if (fs::exists (status) && !fs::is_regular_file (status) &&
      !fs::is_directory (status))
    return nullptr;
  /* A link stays, and the file that it leads to is replaced. */
  return std::make_unique<File> (element, property,
      fs::is_symlink (name, ignored) ? fs::weakly_canonical (name, ignored)
                                     : fs::path (name));
}

std::vector<std::unique_ptr<Output>>
outputs_of (GstElement *element, GstPad *coded)
{
  std::vector<std::unique_ptr<Output>> outputs;
  const std::string kind = factory_of (element);
  for (const auto &[factory, property] : kWriters) {
    if (factory != kind)
      continue;
    const std::string name = text_property (element, property);
    if (auto output = name.empty ()
                          ? nullptr
                          : output_of (element, property, name, coded))
      outputs.push_back (std::move (output));
  }
  return outputs;
}

} // namespace

std::vector<std::string>
Outputs::claim (GstElement *pipeline, GstPad *coded, bool replace)
{
  for_each_element (pipeline, [&] (GstElement *element) {
    for (auto &output : outputs_of (element, coded))
      outputs_.push_back (std::move (output));
  });
  std::ranges::reverse (outputs_); // a bin lists its last element first
  std::vector<std::string> errors;
  std::set<std::string> names;
  std::vector<Output *> claimed;
  for (const auto &output : outputs_) {
    std::error_code ignored;
    Result<void> result;
    if (!names
             .insert (fs::weakly_canonical (
                 fs::absolute (output->name (), ignored), ignored))
             .second)
      result = Error{
          output->name () + " is written twice; give each output its own name"};
    else
      result = output->claim (replace);
    if (result)
      claimed.push_back (output.get ());
    else
      errors.push_back (result.error ().message);
  }
  if (!errors.empty ()) {
    for (Output *output : claimed)
      output->discard ();
    outputs_.clear ();
  }
  return errors;
}

std::vector<std::string>
Outputs::finish (bool publish)
{
  bool only_sidecars = true, have_frames = false;
  for (const auto &output : outputs_) {
    only_sidecars &= output->is_sidecar ();
    have_frames |= !output->is_sidecar () && output->has_content ();
  }
  std::vector<std::string> errors;
  for (const auto &output : outputs_) {
    const bool described =
        !output->is_sidecar () || only_sidecars || have_frames;
    if (!publish || !output->has_content () || !described)
      output->discard ();
    else if (const auto published = output->publish (); !published)
      errors.push_back (published.error ().message);
    else
      published_.push_back (output.get ());
  }
  return errors;
}

std::string
Outputs::summary (std::optional<guint64> usual) const
{
  std::string text;
  for (const Output *output : published_) {
    if (!text.empty ())
      text += output == published_.back () ? " and " : ", ";
    text += output->name ();
    if (usual && output->frames () != *usual)
      text += " (" + std::to_string (output->frames ()) + " frames)";
  }
  return text;
}
