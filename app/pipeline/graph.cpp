/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "graph.h"

#include <utility>

#include "failure.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* "demux", or "demux-2" for the second one: only for messages and printed
 * lines, as elements are not found by their names. gst-launch-1.0 would take
 * "queue2" for one that a bin has inside. */
std::string
name_for (GstElement *pipeline, std::string_view factory)
{
  constexpr std::string_view kOwn = "codedexposure-";
  if (factory.starts_with (kOwn))
    factory.remove_prefix (kOwn.size ());
  std::string name (factory);
  for (int k = 2;; k++) {
    const ObjectPtr<GstElement> taken (
        gst_bin_get_by_name (GST_BIN (pipeline), name.c_str ()));
    if (!taken)
      return name;
    name = std::string (factory) + "-" + std::to_string (k);
  }
}

/* Reads @text into @value. Returns what it must be; empty: it is that. */
std::string
read_value (const std::string &text, GParamSpec *spec, GValue *value)
{
  if (!gst_value_deserialize_with_pspec (value, text.c_str (), spec))
    return std::string ("a ") + g_type_name (spec->value_type);
  GValue nearest = G_VALUE_INIT;
  g_value_init (&nearest, spec->value_type);
  g_value_copy (value, &nearest);
  std::string rule;
  if (g_param_value_validate (spec, &nearest)) {
    const CharPtr limit (gst_value_serialize (&nearest));
    const bool is_below =
        gst_value_compare (value, &nearest) == GST_VALUE_LESS_THAN;
    rule = (is_below ? "at least " : "at most ") + std::string (limit.get ());
  }
  g_value_unset (&nearest);
  return rule;
}

/* A text is set as it is: only the parser of gst-launch-1.0 unescapes it. A
 * value that GLib would replace by the default is an error; options that are
 * not checked before have the names of their properties. */
void
set (GstElement *element, const char *property, const std::string &text)
{
  GObject *object = G_OBJECT (element);
  GParamSpec *spec =
      g_object_class_find_property (G_OBJECT_GET_CLASS (object), property);
  if (!spec)
    fail ("the element \"" + factory_of (element) + "\" has no property \"" +
          property + "\"; install the version that this program needs");
  if (spec->value_type == G_TYPE_STRING) {
    g_object_set (object, property, text.c_str (), nullptr);
    return;
  }
  GValue value = G_VALUE_INIT;
  g_value_init (&value, spec->value_type);
  const std::string rule = read_value (text, spec, &value);
  if (rule.empty ())
    g_object_set_property (object, property, &value);
  g_value_unset (&value);
  if (!rule.empty ())
    usage_error (
        "--" + std::string (property) + " must be " + rule + ", not " + text);
}

} // namespace

GstElement *
Graph::add (const char *factory, const Settings &settings)
{
  GstElement *element = gst_element_factory_make (
      factory, name_for (pipeline (), factory).c_str ());
  if (!element) {
    const std::string package = package_of (factory);
    fail ("the element \"" + std::string (factory) + "\" is missing" +
          (package.empty () ? "; a build with -Dparts=all has all elements of "
                              "this project"
                            : "; run apt-get install " + package));
  }
  for (const Setting &setting : settings)
    if (setting.value)
      set (element, setting.name, *setting.value);
  gst_bin_add (GST_BIN (pipeline ()), element);
  return element;
}

namespace
{

/* Null: @error, which may be null, says why. */
GstElement *
parse (const std::string &description, GError **error)
{
  return gst_parse_bin_from_description_full (description.c_str (), TRUE,
      nullptr,
      GstParseFlags (
          GST_PARSE_FLAG_FATAL_ERRORS | GST_PARSE_FLAG_NO_SINGLE_ELEMENT_BINS),
      error);
}

} // namespace

/* The parser takes caps between two elements only, and not at the end. */
GstElement *
Graph::add_text (const std::string &description)
{
  GError *error = nullptr;
  std::string text = description;
  GstElement *bin = parse (description, &error);
  if (!bin) {
    text += " ! identity";
    bin = parse (text, nullptr);
  }
  if (!bin) {
    const std::string why = error ? error->message : "it is empty";
    g_clear_error (&error);
    fail ("\"" + description + "\" is no part of a pipeline: " + why,
        Exit::usage);
  }
  g_clear_error (&error);
  gst_bin_add (GST_BIN (pipeline ()), bin);
  g_object_set_data_full (
      G_OBJECT (bin), "description", g_strdup (text.c_str ()), g_free);
  return bin;
}

namespace
{

constexpr const char *kLateLink = "late-link";

struct LateLink {
  std::string from_pad, to_pad;
  GstElement *to; // of the same pipeline
};

const char *
name_or_null (const std::string &name)
{
  return name.empty () ? nullptr : name.c_str ();
}

/* Pads that do not fit, such as those of another medium, stay free. */
void
on_pad_added (GstElement *element, GstPad *pad, gpointer data)
{
  const auto *link = static_cast<const LateLink *> (data);
  if (!link->from_pad.empty () && link->from_pad != GST_PAD_NAME (pad))
    return;
  gst_element_link_pads (
      element, GST_PAD_NAME (pad), link->to, name_or_null (link->to_pad));
}

bool
has_late_pads (GstElement *element)
{
  for (const GList *t = gst_element_class_get_pad_template_list (
           GST_ELEMENT_GET_CLASS (element));
       t; t = t->next) {
    const auto *templ = GST_PAD_TEMPLATE (t->data);
    if (GST_PAD_TEMPLATE_DIRECTION (templ) == GST_PAD_SRC &&
        GST_PAD_TEMPLATE_PRESENCE (templ) == GST_PAD_SOMETIMES)
      return true;
  }
  return false;
}

} // namespace

void
Graph::link (GstElement *from, const char *from_pad, GstElement *to,
    const char *to_pad) const
{
  if (gst_element_link_pads (from, from_pad, to, to_pad))
    return;
  if (!has_late_pads (from))
    fail ("cannot link " + factory_of (from) + " to " + factory_of (to) +
          "; their formats do not fit");
  g_object_set_data (G_OBJECT (from), kLateLink, to);
  auto *late = new LateLink{from_pad ? from_pad : "", to_pad ? to_pad : "", to};
  g_signal_connect_data (
      from, "pad-added", G_CALLBACK (on_pad_added), late,
      [] (gpointer data, GClosure *) { delete static_cast<LateLink *> (data); },
      GConnectFlags (0));
}

GstElement *
late_link_of (GstElement *element)
{
  return static_cast<GstElement *> (
      g_object_get_data (G_OBJECT (element), kLateLink));
}

Chain
Graph::begin (const char *factory, const Settings &settings)
{
  return {*this, add (factory, settings), nullptr};
}

Chain
Graph::from (GstElement *element, const char *pad)
{
  return {*this, element, pad};
}

void
each_element (GstElement *bin, const std::function<void (GstElement *)> &visit)
{
  GstIterator *elements = gst_bin_iterate_recurse (GST_BIN (bin));
  GValue item = G_VALUE_INIT;
  while (gst_iterator_next (elements, &item) == GST_ITERATOR_OK) {
    visit (GST_ELEMENT (g_value_get_object (&item)));
    g_value_reset (&item);
  }
  g_value_unset (&item);
  gst_iterator_free (elements);
}

std::string
factory_of (gpointer object)
{
  GstElementFactory *factory =
      GST_IS_ELEMENT (object) ? gst_element_get_factory (GST_ELEMENT (object))
                              : nullptr;
  return factory ? GST_OBJECT_NAME (factory) : "";
}

std::string
text_property (gpointer object, const std::string &property)
{
  gchar *text = nullptr;
  g_object_get (object, property.c_str (), &text, nullptr);
  const CharPtr owned (text);
  return text ? text : "";
}

} // namespace codedexposure::app
