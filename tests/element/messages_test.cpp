/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Messages, events and queries have on the wire the names and types that
 * docs/streams.md tells, and come back as they were. */
#include "common/messages.h"

#include <string>

#include <gtest/gtest.h>

#include "common/events.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;

/* The text of @p value on the wire. */
template <typename T>
std::string
wire (const T &value)
{
  const StructurePtr structure (to_structure (value));
  return CharPtr (gst_structure_to_string (structure.get ())).get ();
}

/* @p text, read as a T and written again. */
template <typename T>
std::string
echo (const std::string &text)
{
  const StructurePtr structure (
      gst_structure_from_string (text.c_str (), nullptr));
  const auto value = from_structure<T> (structure.get ());
  return value ? wire (*value) : "";
}

TEST (Messages, OfDecodersAreAsDocumented)
{
  const std::string lost = "codedexposure/frames-lost, count=(guint64)3, "
                           "from=(guint64)40, to=(guint64)120;";
  EXPECT_EQ (wire (FramesLost{3, 40, 120}), lost);
  EXPECT_EQ (echo<FramesLost> (lost), lost);

  const std::string begun =
      "codedexposure/saturated, active=(boolean)true, frame=(guint64)7, "
      "from=(guint64)40, pixels=(guint64)5;";
  EXPECT_EQ (echo<Saturated> (begun), begun);
  const std::string ended =
      "codedexposure/saturated, active=(boolean)false, frames=(guint64)2, "
      "from=(guint64)40, to=(guint64)80, pixels=(guint64)6;";
  EXPECT_EQ (echo<Saturated> (ended), ended);

  const std::string seen =
      "codedexposure/mapping, exact=(guint64)1, weighted=(guint64)2, "
      "mixed=(guint64)3, unseen=(guint64)4;";
  EXPECT_EQ (wire (MirrorsSeen{1, 2, 3, 4}), seen);
  EXPECT_EQ (echo<MirrorsSeen> (seen), seen);
}

TEST (Messages, OfAnotherNameOrWithoutAFieldAreNotRead)
{
  EXPECT_EQ (echo<FramesLost> ("codedexposure/mapping, count=(guint64)3, "
                               "from=(guint64)4, to=(guint64)5;"),
      "");
  EXPECT_EQ (
      echo<FramesLost> (
          "codedexposure/frames-lost, count=(guint64)3, from=(guint64)4;"),
      "");
  EXPECT_EQ (echo<FramesLost> ("codedexposure/frames-lost, count=(int)-3, "
                               "from=(guint64)4, to=(guint64)5;"),
      "");
  EXPECT_FALSE (from_structure<FramesLost> (nullptr));
}

TEST (Events, PatternRequestsAreAsDocumented)
{
  const std::string request =
      "dmdsync/pattern, pattern=(string)x:4, frames=(guint64)50;";
  EXPECT_EQ (echo<PatternRequest> (request), request);
  EXPECT_EQ (echo<PatternRequest> ("dmdsync/pattern;"), "dmdsync/pattern;");

  /* As programs write it that do not care about the size of integers. */
  EXPECT_EQ (
      echo<PatternRequest> ("dmdsync/pattern, pattern=x:4, frames=(int)50;"),
      request);

  const EventPtr event (new_event (PatternRequest{"x:4", 50}));
  EXPECT_EQ (GST_EVENT_TYPE (event.get ()), GST_EVENT_CUSTOM_UPSTREAM);
  const auto parsed = parse_event<PatternRequest> (event.get ());
  ASSERT_TRUE (parsed);
  EXPECT_EQ (parsed->pattern, "x:4");
  EXPECT_EQ (parsed->frames, 50u);
  EXPECT_FALSE (
      parse_event<PatternRequest> (EventPtr (gst_event_new_eos ()).get ()));
}

TEST (Queries, OfMirrorsAreAsDocumented)
{
  const QueryPtr query (new_query<MirrorsAnswer> ());
  EXPECT_TRUE (is_query<MirrorsAnswer> (query.get ()));
  EXPECT_FALSE (parse_query<MirrorsAnswer> (query.get ())) << "no answer yet";
  answer_query (query.get (),
      MirrorsAnswer{
          .width = 912, .height = 1140, .patterns = true, .reason = ""});
  EXPECT_STREQ (
      CharPtr (gst_structure_to_string (gst_query_get_structure (query.get ())))
          .get (),
      "dmdsync/mirrors, width=(int)912, height=(int)1140, "
      "patterns=(boolean)true, reason=(string)\"\";");
  const auto answer = parse_query<MirrorsAnswer> (query.get ());
  ASSERT_TRUE (answer);
  EXPECT_EQ (answer->width, 912);
  EXPECT_TRUE (answer->patterns);
  EXPECT_FALSE (
      is_query<MirrorsAnswer> (QueryPtr (gst_query_new_latency ()).get ()));
}

} // namespace
