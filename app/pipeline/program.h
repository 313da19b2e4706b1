/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* This program, and what belongs to it: its plugin and its Python package. */
#pragma once

#include <string>
#include <vector>

namespace codedexposure::app
{

/** Lets the guard that stops a board be this program. */
void name_this_program ();

/** Starts GStreamer with the elements of this program: those of its build tree,
 * or those that were installed with it. Call it before any element is made.
 * Throws Failure if there are none. */
void start_gstreamer ();

/** Becomes the Python program that drives archives, which runs this program
 * again by the path in CODEDEXPOSURE_PROGRAM. Throws Failure. */
[[noreturn]] void become_archive (const std::vector<std::string> &words);

/** "--version --build": a number that another build of this program, or of its
 * plugin, does not have. */
std::string build_id ();

} // namespace codedexposure::app
