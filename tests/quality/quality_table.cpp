/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Prints how true subframes are, method by method. */
#include <algorithm>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include <gst/gst.h>
#include <unistd.h>

#include "figures.h"
#include "footage.h"
#include "scene.h"
#include "table.h"

namespace
{

using namespace cexp::quality;

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

void
skip (const std::string &what, const std::string &remedy)
{
  std::cerr << "skipped: " << what << "; " << remedy << '\n';
}

/* Every scene there is, with as many slots as make whole coded frames. */
std::vector<Scene>
all_scenes (const Options &options)
{
  std::vector<Scene> scenes = {synthetic_scene (256, 192, options.frames)};
  if (auto video = read_video (options.video, options.frames))
    scenes.push_back (std::move (*video));
  else
    skip (video.error ().message,
        "install opencv-doc, or name a video with --video");
  if (options.clips.empty ())
    skip ("no folder of clips", "name one with --clips");
  else if (auto clips = read_clips (options.clips, options.frames))
    std::ranges::move (*clips, std::back_inserter (scenes));
  else
    skip (clips.error ().message, "name another folder with --clips");
  std::erase_if (scenes, [] (Scene &scene) {
    scene.frames.resize (scene.frames.size () / kLeastFrames * kLeastFrames);
    if (scene.frames.empty ())
      skip (scene.name, "it has less than 8 frames");
    return scene.frames.empty ();
  });
  return scenes;
}

/* The two clips of the comparison; empty unless both are there. */
std::vector<Scene>
compared_scenes (const std::vector<Scene> &scenes)
{
  std::vector<Scene> both;
  for (const Scene &scene : scenes) {
    if (scene.name == "traffic48" || scene.name == "runner40")
      both.push_back (scene);
  }
  return both.size () == 2 ? both : std::vector<Scene>{};
}

std::vector<Table>
all_tables (const std::vector<Scene> &scenes, const Progress &progress)
{
  std::vector<Table> tables = method_tables (scenes, progress);
  tables.push_back (mislabelled_table (scenes, progress));
  std::ranges::move (
      leak_tables (scenes, progress), std::back_inserter (tables));
  std::ranges::move (
      shift_tables (scenes, progress), std::back_inserter (tables));
  tables.push_back (still_table (scenes));
  tables.push_back (light_table ());
  if (const auto compared = compared_scenes (scenes); !compared.empty ())
    tables.push_back (comparison_table (compared));
  else
    skip ("the comparison", "it needs the clips traffic48 and runner40");
  return tables;
}

int
update (const std::string &path, const std::vector<Table> &tables)
{
  std::ifstream in (path);
  const std::string document (std::istreambuf_iterator<char> (in), {});
  const auto updated = with_tables (document, tables);
  if (!updated) {
    std::cerr << path << ": " << updated.error ().message << '\n';
    return 1;
  }
  std::ofstream (path) << *updated;
  return 0;
}

} // namespace

int
main (int argc, char **argv)
{
  Options options;
  if (!parse (argc, argv, options))
    return 2;

  const bool show = !options.quiet && isatty (STDERR_FILENO) != 0;
  const auto scenes = all_scenes (options);
  const auto tables = all_tables (scenes, [show] (const std::string &what) {
    if (show)
      std::cerr << "\r\033[K" << what << std::flush;
  });
  if (show)
    std::cerr << "\r\033[K";

  if (!options.document.empty ())
    return update (options.document, tables);
  if (options.json)
    std::cout << to_json (tables);
  for (const Table &table : tables) {
    if (!options.json)
      std::cout << (options.markdown ? to_markdown (table)
                                     : to_text (table) + "\n");
  }
  return 0;
}
