/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The output of gst-inspect-1.0 is the manual, so it must be complete. */
#include <memory>
#include <string>

#include <gst/gst.h>
#include <gtest/gtest.h>

namespace
{

struct FeatureListFree {
  void operator() (GList *list) const { gst_plugin_feature_list_free (list); }
};
using FeatureList = std::unique_ptr<GList, FeatureListFree>;

struct ObjectUnref {
  void operator() (gpointer object) const { gst_object_unref (object); }
};

FeatureList
features ()
{
  GList *list = nullptr;
  for (const char *plugin : {"codedexposure", "codedexposuredevices"}) {
    GList *const of_plugin =
        gst_registry_get_feature_list_by_plugin (gst_registry_get (), plugin);
    EXPECT_NE (of_plugin, nullptr)
        << "the plugin " << plugin << " is missing or blacklisted";
    list = g_list_concat (list, of_plugin);
  }
  return FeatureList (list);
}

/** Every element of the plugin, one after the other. */
template <typename Check>
void
for_each_element (Check check)
{
  const FeatureList list = features ();
  for (GList *at = list.get (); at; at = at->next) {
    if (!GST_IS_ELEMENT_FACTORY (at->data))
      continue;
    auto *factory = GST_ELEMENT_FACTORY (at->data);
    SCOPED_TRACE (GST_OBJECT_NAME (factory));
    const std::unique_ptr<GstElement, ObjectUnref> element (
        gst_element_factory_create (factory, nullptr));
    ASSERT_NE (element, nullptr);
    check (factory, element.get ());
  }
}

bool
is_ours (const GParamSpec *spec)
{
  const gchar *owner = g_type_name (spec->owner_type);
  return g_str_has_prefix (owner, "GstCoded") ||
         g_str_has_prefix (owner, "GstDmd") ||
         g_str_has_prefix (owner, "GstMoire") ||
         g_str_has_prefix (owner, "GstSubframe");
}

} // namespace

TEST (Plugin, HasTheElementsOfTheBench)
{
  for (const char *name : {"codedexposure-camerasrc", "codedexposure-sim",
           "codedexposure-demux", "codedexposure-filesink",
           "codedexposure-fuse", "codedexposure-recorddemux",
           "codedexposure-recordmux", "codedexposure-scene",
           "codedexposure-view", "dmdsync", "moirecalib", "subframestats"}) {
    const std::unique_ptr<GstElementFactory, ObjectUnref> factory (
        gst_element_factory_find (name));
    EXPECT_NE (factory, nullptr) << name;
  }
}

TEST (Plugin, ConsumersOfCodedFramesShareABaseClass)
{
  for (const char *name : {"codedexposure-demux", "codedexposure-fuse"}) {
    const std::unique_ptr<GstElement, ObjectUnref> element (
        gst_element_factory_make (name, nullptr));
    ASSERT_NE (element, nullptr);
    const GType base = g_type_parent (G_OBJECT_TYPE (element.get ()));
    EXPECT_STREQ (g_type_name (base), "GstCodedFilter");
    EXPECT_TRUE (G_TYPE_IS_ABSTRACT (base));
    EXPECT_STREQ (g_type_name (g_type_parent (base)), "GstElement");
    const std::unique_ptr<GstPad, ObjectUnref> src (
        gst_element_get_static_pad (element.get (), "src"));
    EXPECT_STREQ (G_OBJECT_TYPE_NAME (src.get ()), "GstCodedPad");
  }
}

TEST (Plugin, EveryElementIsDescribed)
{
  for_each_element ([] (GstElementFactory *factory, GstElement *) {
    for (const char *key :
        {GST_ELEMENT_METADATA_LONGNAME, GST_ELEMENT_METADATA_KLASS,
            GST_ELEMENT_METADATA_DESCRIPTION, GST_ELEMENT_METADATA_AUTHOR}) {
      const gchar *text = gst_element_factory_get_metadata (factory, key);
      EXPECT_TRUE (text && *text) << key;
    }
  });
}

TEST (Plugin, EveryPropertyIsExplained)
{
  for_each_element ([] (GstElementFactory *, GstElement *element) {
    guint count = 0;
    GParamSpec **specs =
        g_object_class_list_properties (G_OBJECT_GET_CLASS (element), &count);
    for (guint i = 0; i < count; i++) {
      if (!is_ours (specs[i]))
        continue;
      SCOPED_TRACE (specs[i]->name);
      const std::string nick = g_param_spec_get_nick (specs[i]);
      const gchar *blurb = g_param_spec_get_blurb (specs[i]);
      EXPECT_FALSE (nick.empty ());
      EXPECT_NE (nick, specs[i]->name) << "the nick only repeats the name";
      ASSERT_NE (blurb, nullptr);
      EXPECT_GE (std::string (blurb).size (), 20u) << blurb;
      /* Limits that gst-inspect-1.0 shows are not those of the type. */
      if (G_IS_PARAM_SPEC_UINT64 (specs[i])) {
        EXPECT_LE (
            G_PARAM_SPEC_UINT64 (specs[i])->maximum, guint64 (G_MAXINT64));
      }
    }
    g_free (specs);
  });
}
