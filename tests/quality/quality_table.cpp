/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Prints the accuracy of subframes for each method. */
#include <algorithm>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include <gst/gst.h>
#include <unistd.h>

#include "figures.h"
#include "footage.h"
#include "region_figures.h"
#include "scene.h"
#include "table.h"

namespace
{

using namespace codedexposure::quality;

struct Options {
  std::string video = "/usr/share/doc/opencv-doc/examples/data/vtest.avi";
  std::string clips;
  int frames = 32;
  bool markdown = false;
  bool json = false;
  bool quiet = false;
  std::string document;
};

constexpr int kLeastFrames = 8; // one coded frame at n = 8, two at n = 4

/** Fills @p options; false, with what is wrong said, where that fails. */
bool
parse (int argc, char **argv, Options &options)
{
  gboolean markdown = FALSE, json = FALSE, quiet = FALSE;
  gchar *video = nullptr, *clips = nullptr, *document = nullptr;
  const GOptionEntry entries[] = {
      {"video", 0, 0, G_OPTION_ARG_FILENAME, &video,
          "video file, a slot a frame [vtest.avi of opencv-doc]", "FILE"},
      {"clips", 0, 0, G_OPTION_ARG_FILENAME, &clips,
          "folder of raw clips with a manifest.json", "DIR"},
      {"frames", 0, 0, G_OPTION_ARG_INT, &options.frames,
          "slots of each scene, at most [32]", "N"},
      {"markdown", 0, 0, G_OPTION_ARG_NONE, &markdown, "tables for a document",
          nullptr},
      {"json", 0, 0, G_OPTION_ARG_NONE, &json, "figures for a program",
          nullptr},
      {"update", 0, 0, G_OPTION_ARG_FILENAME, &document,
          "write the tables to where this document marks places for them",
          "FILE"},
      {"quiet", 0, 0, G_OPTION_ARG_NONE, &quiet, "no progress on the terminal",
          nullptr},
      {}};
  GOptionContext *context = g_option_context_new (
      "- how true subframes are, for each method and schedule");
  g_option_context_add_main_entries (context, entries, nullptr);
  g_option_context_add_group (context, gst_init_get_option_group ());
  GError *error = nullptr;
  const bool ok = g_option_context_parse (context, &argc, &argv, &error);
  g_option_context_free (context);
  if (!ok)
    std::cerr << error->message << '\n';
  g_clear_error (&error);

  options.markdown = markdown;
  options.json = json;
  options.quiet = quiet;
  for (const auto &[given, option] :
      {std::pair (video, &options.video), std::pair (clips, &options.clips),
          std::pair (document, &options.document)}) {
    if (given != nullptr)
      *option = given;
    g_free (given);
  }
  if (!ok)
    return false;
  if (argc > 1) {
    std::cerr << argv[1] << ": only options are understood; see --help\n";
    return false;
  }
  if (options.frames < kLeastFrames) {
    std::cerr << "--frames " << options.frames << ": it must be at least "
              << kLeastFrames << '\n';
    return false;
  }
  return true;
}

struct Scenes {
  std::vector<Scene> all;
  std::vector<Scene> compared; ///< those of the comparison, or none
  bool complete = true;        ///< all that the document shows are there

  void skip (const std::string &what, const std::string &remedy)
  {
    std::cerr << "skipped: " << what << "; " << remedy << '\n';
    complete = false;
  }
};

/* The available scenes, with as many slots as complete coded frames contain. */
Scenes
find_scenes (const Options &options)
{
  Scenes scenes;
  scenes.all.push_back (synthetic_scene (256, 192, options.frames));
  if (auto video = read_video (options.video, options.frames))
    scenes.all.push_back (std::move (*video));
  else
    scenes.skip (video.error ().message,
        "install opencv-doc, or name a video with --video");
  if (options.clips.empty ())
    scenes.skip ("no folder of clips", "name one with --clips");
  else if (auto clips = read_clips (options.clips, options.frames))
    std::ranges::move (*clips, std::back_inserter (scenes.all));
  else
    scenes.skip (clips.error ().message, "name another folder with --clips");

  std::erase_if (scenes.all, [&] (Scene &scene) {
    scene.frames.resize (scene.frames.size () / kLeastFrames * kLeastFrames);
    if (scene.frames.empty ())
      scenes.skip (scene.name, "it has fewer than 8 frames");
    return scene.frames.empty ();
  });
  std::ranges::copy_if (scenes.all, std::back_inserter (scenes.compared),
      [] (const Scene &scene) {
        return scene.name == "traffic48" || scene.name == "runner40";
      });
  if (scenes.compared.size () != 2) {
    scenes.compared.clear ();
    scenes.skip ("the comparison", "it needs the clips traffic48 and runner40");
  }
  return scenes;
}

std::vector<Table>
all_tables (const Scenes &scenes, const Progress &progress)
{
  std::vector<Table> tables = method_tables (scenes.all, progress);
  tables.push_back (mislabelled_table (scenes.all, progress));
  std::ranges::move (
      leak_tables (scenes.all, progress), std::back_inserter (tables));
  std::ranges::move (
      shift_tables (scenes.all, progress), std::back_inserter (tables));
  tables.push_back (regions_table (scenes.all, progress));
  tables.push_back (still_table (scenes.all));
  tables.push_back (light_table ());
  if (!scenes.compared.empty ())
    tables.push_back (comparison_table (scenes.compared));
  return tables;
}

} // namespace

int
main (int argc, char **argv)
{
  Options options;
  if (!parse (argc, argv, options))
    return 2;

  const bool show = !options.quiet && isatty (STDERR_FILENO) != 0;
  const Scenes scenes = find_scenes (options);
  if (!options.document.empty () && !scenes.complete) {
    std::cerr << options.document
              << " is of all scenes, and stays as it is without some\n";
    return 1;
  }
  const auto tables = all_tables (scenes, [show] (const std::string &what) {
    if (show)
      std::cerr << "\r\033[K" << what << std::flush;
  });
  if (show)
    std::cerr << "\r\033[K";

  if (!options.document.empty ())
    return update_document (options.document, tables) ? 0 : 1;
  if (options.json)
    std::cout << to_json (tables);
  for (const Table &table : tables) {
    if (!options.json)
      std::cout << (options.markdown ? to_markdown (table)
                                     : to_text (table) + "\n");
  }
  return 0;
}
