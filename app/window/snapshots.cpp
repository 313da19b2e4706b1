/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "snapshots.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <utility>

#include <gst/video/video.h>

#include "base/part.h"
#include "base/try.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

namespace
{

using namespace gst;

Error
unwritten (const std::string &name, const std::string &why)
{
  return Error{"cannot write " + name + ": " + why +
                   "; free space on the disk, and press S again",
      ErrorCode::io};
}

Result<void>
save_window (const Snapshot &snapshot, Part &part)
{
  const cairo_status_t status = cairo_surface_write_to_png (
      snapshot.window.get (), part.path ().c_str ());
  if (status != CAIRO_STATUS_SUCCESS)
    return unwritten (part.name (), cairo_status_to_string (status));
  return part.publish (false);
}

/* Null: @error is set. */
SamplePtr
converted (const SamplePtr &sample, const CapsPtr &caps, GError **error)
{
  constexpr GstClockTime kMost = 10 * GST_SECOND;
  return SamplePtr (
      gst_video_convert_sample (sample.get (), caps.get (), kMost, error));
}

/* With all of its pixels and bits, as decode writes them: without its format
 * in a file, 16-bit grey becomes 8-bit colours. */
Result<void>
save_picture (const FullPicture &picture, Part &part)
{
  const CapsPtr from (gst_video_info_to_caps (&picture.info));
  const CapsPtr grey (gst_caps_from_string (picture.info.finfo->bits > 8
                                                ? "video/x-raw,format=GRAY16_BE"
                                                : "video/x-raw,format=GRAY8"));
  const CapsPtr png (gst_caps_new_empty_simple ("image/png"));
  const SamplePtr sample (
      gst_sample_new (picture.frame.get (), from.get (), nullptr, nullptr));
  GError *error = nullptr;
  SamplePtr coded = converted (sample, grey, &error);
  if (coded)
    coded = converted (coded, png, &error);
  if (!coded) {
    const std::string why = error->message;
    g_error_free (error);
    return unwritten (part.name (), why);
  }
  gpointer bytes = nullptr;
  gsize size = 0;
  gst_buffer_extract_dup (
      gst_sample_get_buffer (coded.get ()), 0, G_MAXSIZE, &bytes, &size);
  const CharPtr owner (static_cast<gchar *> (bytes));
  std::ofstream file (part.path (), std::ios::binary);
  file.write (owner.get (), std::streamsize (size));
  file.close ();
  if (!file)
    return unwritten (part.name (), g_strerror (errno));
  return part.publish (false);
}

/* Returns the name of the file. */
template <typename Save>
Result<std::string>
save_as (const std::string &name, Save save)
{
  Part part (name, Part::kFile);
  Result<void> saved = part.claim (false);
  if (saved)
    saved = save (part);
  if (!saved) {
    part.discard ();
    return saved.error ();
  }
  return name;
}

/* Their names, which no other files had. */
Result<std::vector<std::string>>
save (const Snapshot &snapshot)
{
  std::string stem = snapshot.name;
  std::vector<std::string> names;
  std::error_code ignored;
  for (int k = 2; std::filesystem::exists (stem + ".png", ignored); k++)
    stem = format ("%s-%d", snapshot.name.c_str (), k);
  for (const auto &[what, picture] : snapshot.pictures) {
    ASSIGN_OR_RETURN (const std::string name,
        save_as (stem + "-" + what + ".png",
            [&] (Part &part) { return save_picture (*picture, part); }));
    names.push_back (name);
  }
  ASSIGN_OR_RETURN (const std::string name,
      save_as (stem + ".png",
          [&] (Part &part) { return save_window (snapshot, part); }));
  names.push_back (name);
  return names;
}

} // namespace

Snapshots::~Snapshots ()
{
  while (g_idle_remove_by_data (this)) {
  }
}

void
Snapshots::take (Snapshot snapshot)
{
  const auto on_idle = [] (gpointer self) {
    static_cast<Snapshots *> (self)->write ();
    return gboolean (G_SOURCE_REMOVE);
  };
  const std::lock_guard lock (mutex_);
  taken_.push_back (std::move (snapshot));
  g_idle_add (on_idle, this);
}

void
Snapshots::write ()
{
  for (;;) {
    Snapshot next;
    {
      const std::lock_guard lock (mutex_);
      if (taken_.empty ())
        return;
      next = std::move (taken_.front ());
      taken_.pop_front ();
    }
    if (const auto saved = save (next))
      wrote_ (*saved);
    else
      failed_ (saved.error ().message);
  }
}

} // namespace codedexposure::app
