/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "gstcodedexposuretag.h"

#include <string>
#include <string_view>

#include "gstraii.h"

namespace cexp::gst
{

namespace
{
constexpr std::string_view kPrefix = "coded-exposure=";
}

GstTagList *
schedule_to_tags (const Schedule &schedule)
{
  const std::string comment = std::string (kPrefix) + schedule.to_json ();
  return gst_tag_list_new (GST_TAG_COMMENT, comment.c_str (), nullptr);
}

GstEvent *
schedule_to_event (const Schedule &schedule)
{
  return gst_event_new_tag (schedule_to_tags (schedule));
}

std::optional<Result<Schedule>>
schedule_from_tags (const GstTagList *tags)
{
  const guint comments = gst_tag_list_get_tag_size (tags, GST_TAG_COMMENT);
  for (guint i = 0; i < comments; i++) {
    gchar *owned = nullptr;
    if (!gst_tag_list_get_string_index (tags, GST_TAG_COMMENT, i, &owned))
      continue;
    const CharPtr text (owned);
    const std::string_view comment (text.get ());
    if (comment.substr (0, kPrefix.size ()) == kPrefix)
      return Schedule::from_json (comment.substr (kPrefix.size ()));
  }
  return std::nullopt;
}

} // namespace cexp::gst
