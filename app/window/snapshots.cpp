/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "snapshots.h"

#include <filesystem>
#include <utility>

#include <glib.h>

#include "pipeline/messages.h"
#include "pipeline/part.h"

namespace codedexposure::app
{

Snapshots::~Snapshots ()
{
  while (g_idle_remove_by_data (this)) {
  }
}

void
Snapshots::take (Surface picture, const std::string &name)
{
  const auto on_idle = [] (gpointer self) {
    static_cast<Snapshots *> (self)->write ();
    return gboolean (G_SOURCE_REMOVE);
  };
  const std::lock_guard lock (mutex_);
  taken_.push_back ({std::move (picture), name});
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
    const Result<std::string> saved = save (next);
    said_ (saved ? *saved : saved.error ().message, !saved);
  }
}

/* Returns the name of the file, which no other had. */
Result<std::string>
Snapshots::save (const Snapshot &snapshot)
{
  std::string name = snapshot.name + ".png";
  std::error_code ignored;
  for (int k = 2; std::filesystem::exists (name, ignored); k++)
    name = format ("%s-%d.png", snapshot.name.c_str (), k);
  Part part (name, Part::kFile);
  if (auto claimed = part.claim (false); !claimed)
    return claimed.error ();
  const cairo_status_t status = cairo_surface_write_to_png (
      snapshot.picture.get (), part.path ().c_str ());
  Result<void> written =
      status == CAIRO_STATUS_SUCCESS
          ? part.publish (false)
          : Error{"cannot write " + name + ": " +
                      cairo_status_to_string (status) +
                      "; free space on the disk, and press S again",
                ErrorCode::io};
  if (!written) {
    part.discard ();
    return written.error ();
  }
  return name;
}

} // namespace codedexposure::app
