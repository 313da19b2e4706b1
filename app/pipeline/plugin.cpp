/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "plugin.h"

#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gst/gst.h>

#include "common/raii.h"
#include "failure.h"

namespace codedexposure::app
{

using namespace gst;
namespace fs = std::filesystem;

namespace
{

constexpr const char *kPlugin = "libgstcodedexposure.so";

/* The folder of the plugin beside @program; empty: GStreamer looks there. */
fs::path
plugin_folder (const fs::path &program)
{
  const fs::path prefix = program.parent_path ().parent_path ();
  std::error_code ignored;
  if (fs::exists (prefix / "gst" / kPlugin, ignored)) {
    setenv ("GST_REGISTRY_1_0", (prefix / "registry.bin").c_str (), 1);
    return prefix / "gst";
  }
  if (fs::exists (prefix / "lib/gstreamer-1.0" / kPlugin, ignored))
    return prefix / "lib/gstreamer-1.0";
  for (const auto &entry : fs::directory_iterator (prefix / "lib", ignored))
    if (fs::exists (entry.path () / "gstreamer-1.0" / kPlugin, ignored))
      return entry.path () / "gstreamer-1.0";
  return {};
}

fs::path
this_program ()
{
  std::error_code ignored;
  return fs::read_symlink ("/proc/self/exe", ignored);
}

} // namespace

void
name_this_program ()
{
  setenv ("CODEDEXPOSURE_TOOL", this_program ().c_str (), 0);
}

void
start_gstreamer ()
{
  if (gst_is_initialized ())
    return;
  name_this_program ();
  if (const fs::path folder = plugin_folder (this_program ());
      !folder.empty ()) {
    const char *given = std::getenv ("GST_PLUGIN_PATH_1_0");
    const std::string path =
        folder.string () + (given ? std::string (":") + given : "");
    setenv ("GST_PLUGIN_PATH_1_0", path.c_str (), 1);
  }
  gst_init (nullptr, nullptr);
  /* GStreamer takes the locale of the user, in which numbers may have a comma:
   * texts are translated, but numbers are printed and read as in C. */
  std::setlocale (LC_NUMERIC, "C");
  const ObjectPtr<GstElementFactory> found (
      gst_element_factory_find ("codedexposure-demux"));
  if (!found)
    fail ("the elements of this program are not installed; run \"meson install "
          "-C build\", or set GST_PLUGIN_PATH to their folder");
}

} // namespace codedexposure::app
