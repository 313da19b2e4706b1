/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A pipeline that is played to its end. */
#pragma once

#include "harness.h"

namespace codedexposure::test
{

/* Long enough for a loaded machine; only a pipeline that hangs uses it up.
 * Sanitizers make all of it some ten times slower. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr GstClockTime kPatience = 300 * GST_SECOND;
#else
inline constexpr GstClockTime kPatience = 60 * GST_SECOND;
#endif

class Pipeline
{
public:
  explicit Pipeline (const std::string &line)
  {
    GError *error = nullptr;
    GstElement *made = gst_parse_launch (line.c_str (), &error);
    EXPECT_EQ (error, nullptr) << error->message;
    pipeline_.reset (GST_ELEMENT (gst_object_ref_sink (made)));
    bus_.reset (gst_element_get_bus (made));
  }
  ~Pipeline () { gst_element_set_state (pipeline_.get (), GST_STATE_NULL); }

  ObjectPtr<GstElement> operator[] (const char *name) const
  {
    return ObjectPtr<GstElement> (
        gst_bin_get_by_name (GST_BIN (pipeline_.get ()), name));
  }
  ObjectPtr<GstPad> pad (const char *element, const char *name) const
  {
    return ObjectPtr<GstPad> (
        gst_element_get_static_pad ((*this)[element].get (), name));
  }

  /** Plays to the end; returns the error that ended it, or "". */
  std::string play ()
  {
    gst_element_set_state (pipeline_.get (), GST_STATE_PLAYING);
    const MessagePtr message (gst_bus_timed_pop_filtered (bus_.get (),
        kPatience, GstMessageType (GST_MESSAGE_EOS | GST_MESSAGE_ERROR)));
    if (!message)
      return "the pipeline hangs";
    if (GST_MESSAGE_TYPE (message.get ()) == GST_MESSAGE_EOS)
      return "";
    GError *error = nullptr;
    gst_message_parse_error (message.get (), &error, nullptr);
    const std::string text = error->message;
    g_error_free (error);
    return text;
  }

private:
  ObjectPtr<GstElement> pipeline_;
  ObjectPtr<GstBus> bus_;
};

} // namespace codedexposure::test
