/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The campaign: what is delivered under faults, compared with the truth.
 * docs/reliability.md */
#include <sched.h>
#include <sys/mount.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>

#include <gst/gst.h>

#include "emulation/own_network.h"
#include "row.h"

namespace codedexposure::campaign
{

namespace
{

std::filesystem::path folder;
bool isolated = false;

/** A network and mounts of its own, for cameras and full disks. */
bool
isolate ()
{
  return leave_network (2).ok () && unshare (CLONE_NEWNS) == 0 &&
         mount (nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

/** The table of docs/reliability.md, in Markdown. */
void
print (const Row &row)
{
  if (!row.skipped.empty ()) {
    std::printf (
        "| %s | skipped: %s |\n", row.name.c_str (), row.skipped.c_str ());
    return;
  }
  const Tally &tally = row.tally;
  std::printf ("| %s | %d | %llu | %llu | %llu | **%llu** | %llu | %llu | "
               "**%llu** | %d | ",
      row.name.c_str (), row.runs, (unsigned long long)tally.delivered,
      (unsigned long long)tally.wrong, (unsigned long long)tally.flagged,
      (unsigned long long)tally.as_good, (unsigned long long)tally.unjudged,
      (unsigned long long)tally.missing, (unsigned long long)tally.untold,
      row.refused);
  bool first = true;
  for (const auto &[text, count] : row.told) {
    std::printf (
        "%s%s (%d)", first ? "" : ", ", text.substr (0, 90).c_str (), count);
    first = false;
  }
  std::printf (" |\n");
  if (row.hung > 0)
    std::printf ("    %d runs never ended\n", row.hung);
  if (row.mute > 0)
    std::printf ("    %d runs did not tell\n", row.mute);
  std::fputs (row.evidence.c_str (), stdout);
}

int
run (Scale scale, const std::vector<std::string> &names)
{
  std::vector<Case> cases;
  for (const auto &list : {stream_cases (), pair_cases (), file_cases (),
           process_cases (), camera_cases ()})
    cases.insert (cases.end (), list.begin (), list.end ());
  const auto known = [&] (const std::string &name) {
    return std::ranges::any_of (
        cases, [&] (const Case &one) { return one.name == name; });
  };
  for (const std::string &name : names)
    if (!known (name)) {
      std::fprintf (stderr, "There is no case \"%s\".", name.c_str ());
      for (const Case &one : cases)
        std::fprintf (stderr, " %s", one.name.c_str ());
      std::fputc ('\n', stderr);
      return 2;
    }
  std::puts ("| fault | runs | subframes | wrong | flagged | wrong as good | "
             "not judged | lost | lost untold | ended with an error | told |\n"
             "|---|---|---|---|---|---|---|---|---|---|---|");
  int failed = 0;
  for (const Case &one : cases) {
    if (!names.empty () && std::ranges::find (names, one.name) == names.end ())
      continue;
    for (const Row &row : one.run (scale)) {
      print (row);
      std::fflush (stdout);
      failed += !row.passed ();
    }
  }
  std::printf ("%d lines failed\n", failed);
  return failed > 0;
}

} // namespace

std::string
work_folder ()
{
  return folder.string ();
}

bool
is_isolated ()
{
  return isolated;
}

} // namespace codedexposure::campaign

int
main (int argc, char **argv)
{
  using namespace codedexposure::campaign;
  std::vector<std::string> words (argv + 1, argv + argc);
  gst_registry_fork_set_enabled (FALSE);
  if (words.size () >= 2 && words[0] == "--child") {
    gst_init (nullptr, nullptr);
    return run_child (words[1], {words.begin () + 2, words.end ()});
  }
  Scale scale = Scale::brief;
  std::vector<std::string> names;
  for (const std::string &word : words) {
    if (word == "--long")
      scale = Scale::full;
    else if (word == "--short")
      scale = Scale::brief;
    else
      names.push_back (word);
  }
  isolated = isolate ();
  gst_init (nullptr, nullptr);
  char pattern[] = "/tmp/campaign-XXXXXX";
  folder = mkdtemp (pattern);
  const int status = run (scale, names);
  std::filesystem::remove_all (folder);
  return status;
}
