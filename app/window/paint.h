/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Draws the parts of the window of live and receive with cairo. */
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <cairo.h>

#include "base/free_with.h"
#include "window/layout.h"

namespace codedexposure::app
{

using Surface =
    std::unique_ptr<cairo_surface_t, FreeWith<cairo_surface_destroy>>;

/** How a coded frame is exposed. */
struct Exposure {
  std::vector<std::uint64_t> histogram; ///< of all levels
  double saturated = 0;                 ///< part of the pixels, 0 to 1
};

struct PanelLine {
  std::string text;
  bool alarm = false;
};

/** The captions of the panes, in a picture as wide as the window. */
Surface paint_captions (
    const WindowLayout &layout, const std::vector<std::string> &captions);
/** The panel: @p lines, the histogram (null: none) and
 * @p keys, a line. */
Surface paint_panel (const WindowLayout &layout,
    const std::vector<PanelLine> &lines, const Exposure *exposure,
    const char *keys);
/** Whether pixels of a picture become blocks of the same size, if it is @p
 * shown at that size; otherwise, it has to be interpolated. */
inline bool
are_blocks (Extent picture, Extent shown)
{
  return shown.width % picture.width == 0 && shown.height % picture.height == 0;
}

/** A transparent sheet of @p text, no larger than @p most. */
Surface paint_sheet (const std::string &text, Extent most);
/** Paints @p sheet over the panes. */
void paint_over (cairo_t *window, cairo_surface_t *sheet);
/** Paints a part of the window as it is, at that height. */
void paint_strip (cairo_t *window, cairo_surface_t *strip, int top);
/** A copy of @p window without its line of keys. */
Surface copy_window (cairo_t *window, const WindowLayout &layout);

} // namespace codedexposure::app
