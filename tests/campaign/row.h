/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A line of the campaign's table. */
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "truth.h"

namespace codedexposure::campaign
{

/** Messages and how often they came. */
using Told = std::map<std::string, int>;

struct Row {
  std::string name;
  int runs = 0;
  Tally tally = {};
  int refused = 0; ///< runs that ended with an error
  int hung = 0;    ///< runs that did not end: must be 0
  int mute = 0;    ///< runs in which something that must be told was not
  Told told = {};
  std::string evidence = {}; ///< of the first failures
  std::string skipped = {};  ///< why it could not run here

  bool passed () const
  {
    return tally.as_good == 0 && tally.untold == 0 && hung == 0 && mute == 0;
  }
  void add (const Row &other)
  {
    runs += other.runs;
    tally += other.tally;
    refused += other.refused;
    hung += other.hung;
    mute += other.mute;
    for (const auto &[text, count] : other.told)
      told[text] += count;
    evidence += evidence.size () < 1500 ? other.evidence : "";
  }
  void note (const std::string &text)
  {
    if (!text.empty () && evidence.size () < 1500)
      evidence += "    " + text.substr (0, 240) + "\n";
  }
};

/** How much of it. */
enum class Scale { brief, full };

struct Case {
  std::string name;
  std::function<std::vector<Row> (Scale)> run;
};

/** All cases of a file. */
std::vector<Case> stream_cases ();
std::vector<Case> file_cases ();
std::vector<Case> pair_cases ();
std::vector<Case> process_cases ();
std::vector<Case> camera_cases ();
/** The camera of camera_cases () in a process of its own. */
int run_camera (const std::vector<std::string> &words);

/** Runs another process of this program: the parts of process_cases () and
 * camera_cases () that are killed or stopped. */
int run_child (const std::string &part, const std::vector<std::string> &words);

/** A folder that is removed at the end; for all files of the campaign. */
std::string work_folder ();
/** Whether the process has a network and mounts of its own. */
bool is_isolated ();

} // namespace codedexposure::campaign
