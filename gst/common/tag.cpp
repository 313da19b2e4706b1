/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "tag.h"

#include <string>
#include <string_view>
#include <vector>

#include "raii.h"

namespace codedexposure::gst
{

namespace
{

constexpr std::string_view kPrefix = "coded-exposure=";

/** The comments in @p tags, in their order. */
std::vector<std::string>
comments_of (const GstTagList *tags)
{
  std::vector<std::string> comments;
  const guint count = gst_tag_list_get_tag_size (tags, GST_TAG_COMMENT);
  for (guint i = 0; i < count; i++) {
    gchar *owned = nullptr;
    if (gst_tag_list_get_string_index (tags, GST_TAG_COMMENT, i, &owned))
      comments.emplace_back (CharPtr (owned).get ());
  }
  return comments;
}

bool
has_setup (std::string_view comment)
{
  return comment.substr (0, kPrefix.size ()) == kPrefix;
}

GstTagList *
setup_to_tags (const StreamSetup &setup)
{
  const std::string comment = std::string (kPrefix) + setup.to_json ();
  return gst_tag_list_new (GST_TAG_COMMENT, comment.c_str (), nullptr);
}

} // namespace

GstTagList *
schedule_to_tags (const Schedule &schedule)
{
  return setup_to_tags ({schedule, {}});
}

GstEvent *
schedule_to_event (const Schedule &schedule)
{
  return gst_event_new_tag (schedule_to_tags (schedule));
}

GstEvent *
setup_to_event (const StreamSetup &setup)
{
  return gst_event_new_tag (setup_to_tags (setup));
}

std::optional<Result<StreamSetup>>
setup_from_tags (const GstTagList *tags)
{
  for (const std::string &comment : comments_of (tags))
    if (has_setup (comment))
      return StreamSetup::from_json (
          std::string_view (comment).substr (kPrefix.size ()));
  return std::nullopt;
}

std::optional<Result<Schedule>>
schedule_from_tags (const GstTagList *tags)
{
  const auto setup = setup_from_tags (tags);
  if (!setup)
    return std::nullopt;
  return *setup ? Result<Schedule> (setup->value ().schedule)
                : Result<Schedule> (setup->error ());
}

GstEvent *
replace_setup (GstEvent *event, const StreamSetup &setup)
{
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event, &tags);
  GstTagList *ours = setup_to_tags (setup);
  gst_tag_list_set_scope (ours, gst_tag_list_get_scope (tags));
  for (const std::string &comment : comments_of (tags))
    if (!has_setup (comment))
      gst_tag_list_add (ours, GST_TAG_MERGE_APPEND, GST_TAG_COMMENT,
          comment.c_str (), nullptr);

  /* KEEP adds the other tags only, because there are comments already. */
  gst_tag_list_insert (ours, tags, GST_TAG_MERGE_KEEP);
  GstEvent *replaced = gst_event_new_tag (ours);
  gst_event_set_seqnum (replaced, gst_event_get_seqnum (event));
  gst_event_unref (event);
  return replaced;
}

} // namespace codedexposure::gst
