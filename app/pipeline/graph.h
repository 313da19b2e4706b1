/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Builds a pipeline from elements, and keeps pointers to them: no element is
 * found by its name, and no text is parsed but what a user gave. */
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <gst/gst.h>

#include "base/text.h"
#include "common/raii.h"

namespace codedexposure::app
{

/** A property of an element and its value. */
struct Setting {
  /** @p given  as gst-launch-1.0 takes it, in the C locale. Without a value,
   * the property stays as it is. */
  template <typename Value>
  Setting (const char *property, const Value &given) : name (property)
  {
    if constexpr (requires { given.has_value (); }) {
      if (given)
        value = Setting (property, *given).value;
    } else if constexpr (std::is_same_v<Value, bool>)
      value = given ? "true" : "false";
    else if constexpr (std::is_integral_v<Value>)
      value = std::to_string (given);
    else if constexpr (std::is_floating_point_v<Value>)
      value = real_text (given);
    else
      value = given;
  }

  const char *name;
  std::optional<std::string> value;
};
using Settings = std::vector<Setting>;

class Chain;

/** A pipeline that is being built. Elements belong to the pipeline, and
 * pointers to them are valid as long as it is. */
class Graph
{
public:
  Graph ()
      : pipeline_ (
            GST_ELEMENT (gst_object_ref_sink (gst_pipeline_new (nullptr))))
  {
  }
  ~Graph () { gst_element_set_state (pipeline (), GST_STATE_NULL); }
  Graph (const Graph &) = delete;
  Graph &operator= (const Graph &) = delete;

  GstElement *pipeline () const { return pipeline_.get (); }

  /** A new element of the pipeline. Throws Failure, with the Debian package, if
   * there is none of that kind. */
  GstElement *add (const char *factory, const Settings &settings = {});
  /** The elements of @p description, as of gst-launch-1.0, in a bin whose free
   * pads are its own. Throws Failure. */
  GstElement *add_text (const std::string &description);

  /** Links a pad of @p from, null: any that fits, to one of @p to. A pad that
   * comes later is linked when it comes. Throws Failure. */
  void link (GstElement *from, const char *from_pad, GstElement *to,
      const char *to_pad) const;

  /** A chain that begins with a new element. */
  Chain begin (const char *factory, const Settings &settings = {});
  /** A chain that begins at @p element, or one of its pads. */
  Chain from (GstElement *element, const char *pad = nullptr);

private:
  gst::ObjectPtr<GstElement> pipeline_;
};

/** The end of a chain of linked elements, to which the next is linked. */
class Chain
{
public:
  Chain (Graph &graph, GstElement *last, const char *pad)
      : graph_ (&graph), last_ (last), pad_ (pad)
  {
  }

  /** Links a new element; returns this chain, which now ends with it. */
  Chain &to (const char *factory, const Settings &settings = {})
  {
    return to (graph_->add (factory, settings));
  }
  /** Links an element of the pipeline, at its pad @p pad if named. */
  Chain &to (GstElement *element, const char *pad = nullptr)
  {
    graph_->link (last_, std::exchange (pad_, nullptr), element, pad);
    last_ = element;
    return *this;
  }
  /** A filter for these caps. */
  Chain &caps (const std::string &caps)
  {
    return to ("capsfilter", {{"caps", caps}});
  }
  /** A queue that holds @p frames buffers of any size and time. */
  Chain &queue (int frames, const char *leaky = "no")
  {
    return to ("queue", {{"max-size-buffers", frames}, {"max-size-bytes", 0},
                            {"max-size-time", 0}, {"leaky", leaky}});
  }

  GstElement *last () const { return last_; }
  Graph &graph () const { return *graph_; }

private:
  Graph *graph_;
  GstElement *last_;
  const char *pad_; // of the last one; null: any
};

/** Calls @p visit with every element of @p bin, also in bins. */
void each_element (
    GstElement *bin, const std::function<void (GstElement *)> &visit);

using gst::pad_of;

/** The name of the factory of the element @p object; empty: it has none, or is
 * no element. */
std::string factory_of (gpointer object);
/** A property of the GObject @p object that is a text; empty: it is not set. */
std::string text_property (gpointer object, const std::string &property);

/** The element to which a pad of @p element is linked when it comes; null:
 * none.
 */
GstElement *late_link_of (GstElement *element);

/** The pipeline as a line of a shell with gst-launch-1.0 that does the same. */
std::string launch_line (GstElement *pipeline);
/** @p text as one word of a shell. */
std::string shell_word (const std::string &text);

} // namespace codedexposure::app
