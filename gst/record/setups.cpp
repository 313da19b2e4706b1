/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "setups.h"

#include <string>

#include "common/raii.h"

namespace codedexposure::gst
{

namespace
{

constexpr char kPrefix[] = "coded-exposure-setup=";

} // namespace

GstEvent *
add_setups (GstEvent *event, const std::vector<StreamSetup> &setups)
{
  constexpr std::size_t kMostSetups = 64;
  if (setups.size () < 2)
    return event;
  GstTagList *tags = tags_of (event);
  tags = gst_tag_list_copy (tags);
  const std::size_t first =
      setups.size () > kMostSetups ? setups.size () - kMostSetups : 0;
  for (std::size_t i = first; i + 1 < setups.size (); i++)
    gst_tag_list_add (tags, GST_TAG_MERGE_APPEND, GST_TAG_COMMENT,
        (kPrefix + setups[i].to_json ()).c_str (), nullptr);
  GstEvent *with_all = gst_event_new_tag (tags);
  gst_event_set_seqnum (with_all, gst_event_get_seqnum (event));
  gst_event_unref (event);
  return with_all;
}

std::vector<StreamSetup>
setups_from_tags (const GstTagList *tags)
{
  std::vector<StreamSetup> setups;
  const guint count = gst_tag_list_get_tag_size (tags, GST_TAG_COMMENT);
  for (guint i = 0; i < count; i++) {
    const gchar *text = nullptr;
    if (!gst_tag_list_peek_string_index (tags, GST_TAG_COMMENT, i, &text) ||
        !g_str_has_prefix (text, kPrefix))
      continue;
    if (auto setup = StreamSetup::from_json (text + sizeof kPrefix - 1))
      setups.push_back (*std::move (setup));
  }
  return setups;
}

} // namespace codedexposure::gst
