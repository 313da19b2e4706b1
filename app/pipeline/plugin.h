/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

namespace codedexposure::app
{

/** Lets the guard that stops a board be this program. */
void name_this_program ();

/** Starts GStreamer with the elements of this program: those of its build tree,
 * or those that were installed with it. Call it before any element is made.
 * Throws Failure if there are none. */
void start_gstreamer ();

} // namespace codedexposure::app
