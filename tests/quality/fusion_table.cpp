/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Prints the tables of docs/fusion-method.md or docs/two-cameras.md, or writes
 * them into it. */
#include <algorithm>
#include <iostream>
#include <iterator>

#include <glib.h>
#include <unistd.h>

#include "footage.h"
#include "fusion_figures.h"
#include "partner_figures.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::quality;

/* Two coded frames of 4 slots, one of 8. */
constexpr int kLeastFrames = 8;

struct Options {
  char *clips = nullptr, *document = nullptr;
  int frames = kLeastFrames;
  gboolean two_cameras = FALSE, json = FALSE, quiet = FALSE;
};

bool
parse (int &argc, char **&argv, Options &options)
{
  const GOptionEntry entries[] = {
      {"clips", 0, 0, G_OPTION_ARG_FILENAME, &options.clips,
          "folder of raw clips with a manifest.json", "DIR"},
      {"frames", 0, 0, G_OPTION_ARG_INT, &options.frames,
          "of each clip, at most [8]", "N"},
      {"two-cameras", 0, 0, G_OPTION_ARG_NONE, &options.two_cameras,
          "the tables of docs/two-cameras.md", nullptr},
      {"json", 0, 0, G_OPTION_ARG_NONE, &options.json, "figures for a program",
          nullptr},
      {"update", 0, 0, G_OPTION_ARG_FILENAME, &options.document,
          "write the tables to where this document marks places for them",
          "FILE"},
      {"quiet", 0, 0, G_OPTION_ARG_NONE, &options.quiet,
          "no progress on the terminal", nullptr},
      {}};
  GOptionContext *context =
      g_option_context_new ("- how true fused frames are");
  g_option_context_add_main_entries (context, entries, nullptr);
  GError *error = nullptr;
  const bool ok = g_option_context_parse (context, &argc, &argv, &error);
  g_option_context_free (context);
  if (!ok)
    std::cerr << error->message << '\n';
  g_clear_error (&error);
  if (ok && argc > 1)
    std::cerr << argv[1] << ": only options are understood; see --help\n";
  if (options.frames < kLeastFrames)
    std::cerr << "--frames " << options.frames << ": it must be at least "
              << kLeastFrames << '\n';
  return ok && argc == 1 && options.frames >= kLeastFrames;
}

/* The clips, or a drawn scene if there are none. */
std::vector<Scene>
find_scenes (const Options &options)
{
  const int frames = std::max (options.frames, kSequenceFrames + kFramesAfter);
  auto clips = read_clips (options.clips ? options.clips : "", frames);
  if (clips)
    std::erase_if (*clips, [] (const Scene &scene) {
      return scene.frames.size () < std::size_t (kLeastFrames);
    });
  if (clips && !clips->empty ())
    return std::move (*clips);
  std::cerr << "no clips"
            << (clips ? std::string () : ": " + clips.error ().message)
            << "; name a folder with --clips. Drawing a scene instead\n";
  return {synthetic_scene (256, 192, frames)};
}

std::vector<Table>
tables_of_fusion (const std::vector<Scene> &scenes, const Options &options,
    const Progress &progress)
{
  std::vector<Table> tables = fusion_tables (scenes, options.frames, progress);
  tables.push_back (still_fusion_table (scenes, progress));
  std::ranges::move (
      sequence_tables (scenes, progress), std::back_inserter (tables));
  std::ranges::move (
      refinement_tables (scenes, progress), std::back_inserter (tables));
  tables.push_back (leakage_table (scenes, progress));
  tables.push_back (blur_table (scenes, progress));
  return tables;
}

std::vector<Table>
tables_of_two_cameras (
    const std::vector<Scene> &scenes, const Progress &progress)
{
  std::vector<Table> tables = partner_tables (scenes, progress);
  tables.push_back (partner_error_table (scenes, progress));
  tables.push_back (partner_view_table (scenes, progress));
  tables.push_back (partner_range_table (scenes, progress));
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
  const Progress progress = [show] (const std::string &what) {
    if (show)
      std::cerr << "\r\033[K" << what << std::flush;
  };
  const std::vector<Scene> scenes = find_scenes (options);
  const std::vector<Table> tables =
      options.two_cameras ? tables_of_two_cameras (scenes, progress)
                          : tables_of_fusion (scenes, options, progress);
  progress ("");

  if (options.document)
    return update_document (options.document, tables) ? 0 : 1;
  if (options.json)
    std::cout << to_json (tables);
  else
    for (const Table &table : tables)
      std::cout << to_text (table) << '\n';
  return 0;
}
