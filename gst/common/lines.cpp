/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "lines.h"

#include <cerrno>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace codedexposure::gst
{

namespace
{

/** Writes all of @p text; 0, or the errno of the failure. */
int
write_all (int file, std::string_view text)
{
  while (!text.empty ()) {
    const ssize_t n =
        TEMP_FAILURE_RETRY (::write (file, text.data (), text.size ()));
    if (n < 0)
      return errno;
    text.remove_prefix (std::size_t (n));
  }
  return 0;
}

} // namespace

bool
LineFile::open (gpointer element, const std::string &location)
{
  close ();
  element_ = GST_ELEMENT (element);
  location_ = location;
  file_ = ::open (
      location.c_str (), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ >= 0)
    return true;
  GST_ELEMENT_ERROR (element_, RESOURCE, OPEN_WRITE,
      ("Cannot open \"%s\" for writing: %s", location.c_str (),
          g_strerror (errno)),
      (nullptr));
  return false;
}

bool
LineFile::write (const std::string &line)
{
  const int failure = write_all (file_, line + "\n");
  if (failure == 0)
    return true;
  gst_element_message_full (element_, GST_MESSAGE_ERROR, GST_RESOURCE_ERROR,
      failure == ENOSPC ? GST_RESOURCE_ERROR_NO_SPACE_LEFT
                        : GST_RESOURCE_ERROR_WRITE,
      g_strdup_printf (
          "Cannot write to \"%s\": %s. It contains the frames before this one.",
          location_.c_str (), g_strerror (failure)),
      nullptr, __FILE__, GST_FUNCTION, __LINE__);
  return false;
}

void
LineFile::close ()
{
  /* Network and quota errors may be reported only here. */
  if (file_ >= 0 && ::close (std::exchange (file_, -1)) != 0)
    GST_ELEMENT_ERROR (element_, RESOURCE, CLOSE,
        ("Cannot close \"%s\": %s", location_.c_str (), g_strerror (errno)),
        (nullptr));
}

} // namespace codedexposure::gst
