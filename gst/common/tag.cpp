/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "tag.h"

#include <string_view>
#include <utility>
#include <vector>

#include <gst/video/video.h>

#include "element.h"
#include "raii.h"

namespace codedexposure::gst
{

namespace
{

constexpr std::string_view kPrefix = "coded-exposure=";
constexpr std::string_view kDecodedPrefix = "coded-exposure-decoded=";
/** Of a recording whose setup changes. */
constexpr std::string_view kSetupsPrefix = "coded-exposure-setup=";

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

/** The JSON after @p prefix in one of the comments. */
std::optional<std::string>
comment_after (std::string_view prefix, const GstTagList *tags)
{
  for (const std::string &comment : comments_of (tags))
    if (comment.starts_with (prefix))
      return comment.substr (prefix.size ());
  return std::nullopt;
}

GstTagList *
comment_to_tags (std::string_view prefix, const std::string &json)
{
  const std::string comment = std::string (prefix) + json;
  return gst_tag_list_new (GST_TAG_COMMENT, comment.c_str (), nullptr);
}

GstTagList *
setup_to_tags (const StreamSetup &setup)
{
  return comment_to_tags (kPrefix, setup.to_json ());
}

/** A TAG event with @p tags. Transfer: full, of all. */
GstEvent *
in_place_of (GstEvent *event, GstTagList *tags)
{
  GstEvent *made = gst_event_new_tag (tags);
  gst_event_set_seqnum (made, gst_event_get_seqnum (event));
  gst_event_unref (event);
  return made;
}

/** The TAG event @p event with @p ours in place of its setup and its
 * provenance. Transfer: full, of all. */
GstEvent *
merge_others (GstTagList *ours, GstEvent *event)
{
  GstTagList *tags = tags_of (event);
  gst_tag_list_set_scope (ours, gst_tag_list_get_scope (tags));
  for (const std::string &comment : comments_of (tags))
    if (!comment.starts_with (kPrefix) &&
        !comment.starts_with (kDecodedPrefix) &&
        !comment.starts_with (kSetupsPrefix))
      gst_tag_list_add (ours, GST_TAG_MERGE_APPEND, GST_TAG_COMMENT,
          comment.c_str (), nullptr);
  const auto copy_other = [] (const GstTagList *from, const gchar *tag,
                              gpointer to) {
    for (guint i = 0; i < gst_tag_list_get_tag_size (from, tag); i++)
      if (!g_str_equal (tag, GST_TAG_COMMENT))
        gst_tag_list_add_value (static_cast<GstTagList *> (to),
            GST_TAG_MERGE_APPEND, tag,
            gst_tag_list_get_value_index (from, tag, i));
  };
  gst_tag_list_foreach (tags, copy_other, ours);
  return in_place_of (event, ours);
}

} // namespace

StreamSetup
setup_at (GstPad *src, const Schedule &schedule, std::optional<Mapping> mapping)
{
  StreamSetup setup{schedule, std::move (mapping)};
  const CapsPtr caps (gst_pad_get_current_caps (src));
  GstVideoInfo info;
  if (caps && gst_video_info_from_caps (&info, caps.get ())) {
    setup.size = Extent{info.width, info.height};
    if (info.fps_n > 0)
      setup.rate = FrameRate{info.fps_n, info.fps_d};
  }
  return setup;
}

GstEvent *
setup_to_event (const StreamSetup &setup)
{
  return gst_event_new_tag (setup_to_tags (setup));
}

std::optional<Result<StreamSetup>>
setup_from_tags (const GstTagList *tags)
{
  const auto json = comment_after (kPrefix, tags);
  return json ? std::optional (StreamSetup::from_json (*json)) : std::nullopt;
}

GstEvent *
replace_setup (GstEvent *event, const StreamSetup &setup)
{
  return merge_others (setup_to_tags (setup), event);
}

GstEvent *
add_setups (GstEvent *event, const std::vector<StreamSetup> &setups)
{
  constexpr std::size_t kMostSetups = 64;
  if (setups.size () < 2)
    return event;
  GstTagList *tags = gst_tag_list_copy (tags_of (event));
  const std::size_t first =
      setups.size () > kMostSetups ? setups.size () - kMostSetups : 0;
  for (std::size_t i = first; i + 1 < setups.size (); i++)
    gst_tag_list_add (tags, GST_TAG_MERGE_APPEND, GST_TAG_COMMENT,
        (std::string (kSetupsPrefix) + setups[i].to_json ()).c_str (), nullptr);
  return in_place_of (event, tags);
}

std::vector<StreamSetup>
setups_from_tags (const GstTagList *tags)
{
  std::vector<StreamSetup> setups;
  for (const std::string &comment : comments_of (tags))
    if (comment.starts_with (kSetupsPrefix))
      if (auto setup =
              StreamSetup::from_json (comment.substr (kSetupsPrefix.size ())))
        setups.push_back (*std::move (setup));
  return setups;
}

GstEvent *
remove_setup_and_provenance (GstEvent *event)
{
  GstEvent *rest = merge_others (gst_tag_list_new_empty (), event);
  GstTagList *tags = tags_of (rest);
  if (!gst_tag_list_is_empty (tags))
    return rest;
  gst_event_unref (rest);
  return nullptr;
}

GstEvent *
provenance_to_event (const Provenance &provenance)
{
  return gst_event_new_tag (
      comment_to_tags (kDecodedPrefix, provenance.to_json ()));
}

bool
takes_provenance (GstEvent *event)
{
  GstTagList *tags = tags_of (event);
  return gst_tag_list_get_scope (tags) != GST_TAG_SCOPE_GLOBAL ||
         comment_after (kPrefix, tags);
}

/* The last tags of a scope are those that a late link gets: the provenance is
 * always among those of the stream. */
GstEvent *
replace_by_provenance (GstEvent *event, const Provenance &provenance)
{
  if (!takes_provenance (event))
    return event;
  return merge_others (
      comment_to_tags (kDecodedPrefix, provenance.to_json ()), event);
}

void
follow_tagged_bits (GstEvent *event, int &bits)
{
  if (GST_EVENT_TYPE (event) == GST_EVENT_STREAM_START)
    bits = 0;
  if (GST_EVENT_TYPE (event) != GST_EVENT_TAG)
    return;
  if (const auto setup = setup_from_tags (tags_of (event)))
    bits = *setup ? setup->value ().bits : 0;
  else if (const auto made = provenance_from_tags (tags_of (event)))
    bits = *made ? made->value ().setup.bits : 0;
}

std::optional<std::string>
why_not_coded (GstEvent *event, const char *where)
{
  GstTagList *tags = tags_of (event);
  const auto made = provenance_from_tags (tags);
  if (!made)
    return std::nullopt;
  return std::string ("The frames") + where + " were decoded before (" +
         (*made ? made->value ().text () : "in an unknown way") +
         "). Only coded frames can be used here. Use the recording from which "
         "they were decoded.";
}

void
refuse_decoded (gpointer element, GstEvent *event)
{
  if (const auto why = why_not_coded (event))
    POST_ERROR (element, STREAM, WRONG_TYPE, *why);
}

std::optional<Result<Provenance>>
provenance_from_tags (const GstTagList *tags)
{
  const auto json = comment_after (kDecodedPrefix, tags);
  return json ? std::optional (Provenance::from_json (*json)) : std::nullopt;
}

} // namespace codedexposure::gst
