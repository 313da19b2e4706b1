/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include <cctype>
#include <set>

#include "pipeline/graph.h"
#include "pipeline/pads.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

constexpr const char *kPlain = "abcdefghijklmnopqrstuvwxyz"
                               "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                               "+-_./:,=@%";

/* A value, quoted for a shell and for gst-launch-1.0. */
std::string
quoted (const std::string &text)
{
  if (!text.empty () && text.find_first_not_of (kPlain) == text.npos)
    return text;
  std::string inner = "\"";
  for (const char c : text)
    inner +=
        c == '"' || c == '\\' ? std::string ("\\") + c : std::string (1, c);
  return shell_word (inner + "\"");
}

/* A text for gst-launch-1.0, whose words a shell keeps as they are. */
std::string
shell_words (const std::string &text)
{
  std::string words, word;
  bool in_quotes = false;
  const auto end_word = [&] {
    if (!word.empty ())
      words += (words.empty () ? "" : " ") + shell_word (word);
    word.clear ();
  };
  for (std::size_t i = 0; i < text.size (); i++) {
    const bool escapes = text[i] == '\\' && i + 1 < text.size ();
    in_quotes ^= text[i] == '"';
    if (std::isspace (static_cast<unsigned char> (text[i])) && !in_quotes)
      end_word ();
    else
      word += text[i];
    if (escapes)
      word += text[++i];
  }
  end_word ();
  return words;
}

/* " NAME=VALUE" of each property that is not at its default. */
std::string
properties_of (GstElement *element)
{
  std::string text;
  guint n = 0;
  GParamSpec **specs =
      g_object_class_list_properties (G_OBJECT_GET_CLASS (element), &n);
  for (guint i = 0; i < n; i++) {
    GParamSpec *spec = specs[i];
    constexpr auto kBoth = G_PARAM_READABLE | G_PARAM_WRITABLE;
    if ((spec->flags & kBoth) != kBoth ||
        (spec->flags & (G_PARAM_CONSTRUCT_ONLY | G_PARAM_DEPRECATED)) ||
        g_str_equal (spec->name, "name") ||
        g_type_is_a (spec->value_type, G_TYPE_OBJECT))
      continue;
    GValue value = G_VALUE_INIT;
    g_object_get_property (G_OBJECT (element), spec->name, &value);
    if (!g_param_value_defaults (spec, &value)) {
      const CharPtr serialized (
          G_VALUE_HOLDS_STRING (&value) ? g_value_dup_string (&value)
          : GST_VALUE_HOLDS_CAPS (&value)
              ? gst_caps_to_string (gst_value_get_caps (&value))
              : gst_value_serialize (&value));
      if (serialized)
        text +=
            std::string (" ") + spec->name + "=" + quoted (serialized.get ());
    }
    g_value_unset (&value);
  }
  g_free (specs);
  return text;
}

/** Writes elements as chains: an element with one link follows the one before,
 * others are named. */
class Writer
{
public:
  explicit Writer (GstElement *pipeline) : pipeline_ (pipeline) {}

  std::string write ()
  {
    for (GList *item = g_list_last (GST_BIN (pipeline_)->children); item;
         item = item->prev)
      write_chain (GST_ELEMENT (item->data));
    return "gst-launch-1.0 -e" + text_ + links_;
  }

private:
  void write_element (GstElement *element)
  {
    written_.insert (element);
    const auto *given = static_cast<const char *> (
        g_object_get_data (G_OBJECT (element), "description"));
    if (given)
      text_ += std::string (" \\( name=") + GST_OBJECT_NAME (element) + " " +
               shell_words (given) + " \\)";
    else
      text_ += " " + factory_of (element) +
               " name=" + GST_OBJECT_NAME (element) + properties_of (element);
  }

  /* The only link of @element, if it is to the only sink pad of the next. */
  GstElement *only_next (GstElement *element) const
  {
    if (element->numsrcpads != 1)
      return nullptr;
    const auto next = element_behind (GST_PAD (element->srcpads->data));
    if (!next || next->numsinkpads != 1 || written_.contains (next.get ()) ||
        GST_OBJECT_PARENT (next.get ()) != GST_OBJECT (pipeline_))
      return nullptr;
    return next.get ();
  }

  void write_chain (GstElement *element)
  {
    if (written_.contains (element))
      return;
    write_element (element);
    while (GstElement *next = only_next (element)) {
      text_ += " !";
      write_element (next);
      element = next;
    }
    for (GList *item = element->srcpads; item; item = item->next) {
      GstPad *pad = GST_PAD (item->data);
      if (const auto next = element_behind (pad))
        links_ += std::string (" ") + GST_OBJECT_NAME (element) + "." +
                  GST_PAD_NAME (pad) + " ! " + GST_OBJECT_NAME (next.get ()) +
                  "." + GST_PAD_NAME (GST_PAD_PEER (pad));
    }
    if (element->numsrcpads == 0 && late_link_of (element))
      links_ += std::string (" ") + GST_OBJECT_NAME (element) + ". ! " +
                GST_OBJECT_NAME (late_link_of (element)) + ".";
  }

  GstElement *pipeline_;
  std::string text_, links_;
  std::set<GstElement *> written_;
};

} // namespace

std::string
shell_word (const std::string &text)
{
  if (!text.empty () && text.find_first_not_of (kPlain) == text.npos)
    return text;
  return CharPtr (g_shell_quote (text.c_str ())).get ();
}

std::string
launch_line (GstElement *pipeline)
{
  return Writer (pipeline).write ();
}

} // namespace codedexposure::app
