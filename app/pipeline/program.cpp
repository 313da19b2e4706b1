/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "program.h"

#include <clocale>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gst/gst.h>
#include <unistd.h>

#include "common/raii.h"
#include "failure.h"

namespace codedexposure::app
{

using namespace gst;
namespace fs = std::filesystem;

namespace
{

constexpr const char *kPlugin = "libgstcodedexposure.so";

fs::path
this_program ()
{
  std::error_code ignored;
  return fs::read_symlink ("/proc/self/exe", ignored);
}

/* What holds the folder of this program: the build tree, or a prefix. */
fs::path
tree ()
{
  return this_program ().parent_path ().parent_path ();
}

/* Whether this program is that of a build tree. */
bool
is_built ()
{
  std::error_code ignored;
  return fs::exists (tree () / "gst" / kPlugin, ignored);
}

/* The folder of the plugin beside this program; empty: GStreamer looks there.
 */
fs::path
plugin_folder ()
{
  const fs::path prefix = tree ();
  std::error_code ignored;
  if (is_built ()) {
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
  if (const fs::path folder = plugin_folder (); !folder.empty ()) {
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

/* In a build tree, the package is in the source tree. */
void
become_archive (const std::vector<std::string> &words)
{
  setenv ("CODEDEXPOSURE_PROGRAM", this_program ().c_str (), 1);
  if (is_built ())
    setenv ("PYTHONPATH", SOURCE_PYTHON, 1);
  std::vector<std::string> all{PYTHON, "-m", "codedexposure.archive"};
  all.insert (all.end (), words.begin (), words.end ());
  std::vector<char *> arguments;
  for (std::string &word : all)
    arguments.push_back (word.data ());
  arguments.push_back (nullptr);
  /* An interruption while Python starts would be a fatal error of Python's. It
   * stays pending until main () of the package unblocks it. */
  sigset_t interruption;
  sigemptyset (&interruption);
  sigaddset (&interruption, SIGINT);
  pthread_sigmask (SIG_BLOCK, &interruption, nullptr);
  execvp (arguments[0], arguments.data ());
  fail (std::string (PYTHON) + " cannot be run; install python3");
}

std::string
build_id ()
{
  std::uint64_t id = 0;
  for (const fs::path &path : {this_program (), tree () / "gst" / kPlugin}) {
    std::ifstream file (path, std::ios::binary);
    const std::string content (std::istreambuf_iterator<char> (file), {});
    id = id * 31 + std::hash<std::string>{}(content);
  }
  char text[17];
  std::snprintf (
      text, sizeof text, "%016llx", static_cast<unsigned long long> (id));
  return text;
}

} // namespace codedexposure::app
