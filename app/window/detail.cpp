/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "detail.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace codedexposure::app
{

using namespace gst;

namespace
{

constexpr std::uint32_t kRed = 0xff2020;

/* The pixels of which at least a part is seen. */
Rect
part_of (Extent picture, const DetailPlace &place, const Look &look)
{
  const auto from_to = [&] (double from, double to, int pane, int shown,
                           int pixels) {
    const double scale = double (pane) / shown * pixels;
    const int first = std::clamp (int (std::floor (from * scale)), 0, pixels);
    const int last =
        std::clamp (int (std::ceil (to * scale - 1e-9)), first, pixels);
    return Offset{first, last - first};
  };
  const Position from = look.whole ({0, 0}), to = look.whole ({1, 1});
  const Offset x =
      from_to (from.x, to.x, place.pane.width, place.size.width, picture.width);
  const Offset y = from_to (
      from.y, to.y, place.pane.height, place.size.height, picture.height);
  return {x.x, y.x, x.y, y.y};
}

/* Of each value: 0 to black, white and more to 255. */
std::vector<std::uint8_t>
levels_of (Tones tones, int largest)
{
  std::vector<std::uint8_t> levels (std::size_t (largest) + 1);
  const double scale = 255.0 / (tones.white - tones.black);
  for (int value = 0; value <= largest; value++)
    levels[std::size_t (value)] = std::uint8_t (std::clamp (
        std::floor ((value - tones.black) * scale + 0.5), 0.0, 255.0));
  return levels;
}

/* Blocks of @reduction pixels become their mean, or red if one of them is
 * saturated and those are marked. */
template <typename Pixel>
void
render_part (ImageView<const Pixel> from, Rect part, int reduction,
    const Look &look, int largest, cairo_surface_t *surface)
{
  const auto levels = levels_of (look.tones (largest), largest);
  const int stride = cairo_image_surface_get_stride (surface);
  const int width = cairo_image_surface_get_width (surface);
  const int height = cairo_image_surface_get_height (surface);
  unsigned char *const rows = cairo_image_surface_get_data (surface);
  for (int y = 0; rows && y < height; y++) {
    auto *to = reinterpret_cast<std::uint32_t *> (rows + y * stride);
    const int top = part.y + y * reduction;
    const int bottom = std::min (top + reduction, part.bottom ());
    for (int x = 0; x < width; x++) {
      const int left = part.x + x * reduction;
      const int right = std::min (left + reduction, part.right ());
      std::uint64_t sum = 0;
      int brightest = 0;
      for (int v = top; v < bottom; v++)
        for (int u = left; u < right; u++) {
          const int value = std::min<int> (from.at (u, v), largest);
          sum += std::uint64_t (value);
          brightest = std::max (brightest, value);
        }
      const auto count =
          std::uint64_t (right - left) * std::uint64_t (bottom - top);
      const std::uint8_t level = levels[(sum + count / 2) / count];
      to[x] = look.marks () && brightest == largest ? kRed : 0x010101u * level;
    }
  }
  cairo_surface_mark_dirty (surface);
}

} // namespace

std::optional<Offset>
DetailPlace::pixel (const Look &look, Position seen, Extent of) const
{
  const Position at = look.whole (seen);
  const Offset pixel{
      int (std::floor (at.x * pane.width / size.width * of.width)),
      int (std::floor (at.y * pane.height / size.height * of.height))};
  if (!Rect{0, 0, of.width, of.height}.holds (pixel.x, pixel.y))
    return std::nullopt;
  return pixel;
}

void
Detail::render (const DetailPlace &place, const Look &look)
{
  place_ = place;
  look_ = look;
  surface_.reset ();
  part_ = part_of (picture_->size (), place, look);
  if (part_.width < 1 || part_.height < 1)
    return;
  reduction_ = std::max (
      {1, part_.width / place.pane.width, part_.height / place.pane.height});
  const auto reduced = [this] (int length) {
    return (length + reduction_ - 1) / reduction_;
  };
  surface_.reset (cairo_image_surface_create (
      CAIRO_FORMAT_RGB24, reduced (part_.width), reduced (part_.height)));
  MappedFrame mapped (picture_->info, picture_->frame.get (), GST_MAP_READ);
  if (mapped)
    read_pixels (mapped, [&] (auto pixels) {
      render_part (pixels, part_, reduction_, look, picture_->largest (),
          surface_.get ());
    });
}

void
Detail::paint (cairo_t *window,
    const std::shared_ptr<const FullPicture> &picture, const DetailPlace &place,
    const Look &look)
{
  const bool is_same =
      surface_ && picture_ == picture && place_ == place && look_ == look;
  picture_ = picture;
  if (picture && !is_same)
    render (place, look);
  cairo_save (window);
  cairo_rectangle (window, place.corner.x, place.corner.y, place.pane.width,
      place.pane.height);
  cairo_clip (window);
  cairo_set_source_rgb (window, 0, 0, 0);
  cairo_paint (window);
  if (picture && surface_) {
    const Position corner = look.whole ({0, 0});
    const double across =
        double (look.zoom ()) * place.size.width / picture->info.width;
    const double down =
        double (look.zoom ()) * place.size.height / picture->info.height;
    cairo_translate (window,
        place.corner.x - corner.x * look.zoom () * place.pane.width +
            part_.x * across,
        place.corner.y - corner.y * look.zoom () * place.pane.height +
            part_.y * down);
    cairo_scale (window, across * reduction_, down * reduction_);
    cairo_set_source_surface (window, surface_.get (), 0, 0);
    cairo_pattern_set_filter (cairo_get_source (window),
        look.zoom () > 1 || are_blocks (picture->size (), place.size)
            ? CAIRO_FILTER_NEAREST
            : CAIRO_FILTER_BILINEAR);
    cairo_paint (window);
  }
  cairo_restore (window);
}

std::optional<int>
value_of (const FullPicture &picture, Offset pixel)
{
  MappedFrame mapped (picture.info, picture.frame.get (), GST_MAP_READ);
  if (!mapped)
    return std::nullopt;
  return read_pixels (
      mapped, [&] (auto pixels) { return int (pixels.at (pixel.x, pixel.y)); });
}

std::optional<Tones>
tones_of (
    const FullPicture &picture, const DetailPlace &place, const Look &look)
{
  constexpr double kOutside = 0.002; // part of the pixels on either side
  const Rect part = part_of (picture.size (), place, look);
  const int largest = picture.largest ();
  MappedFrame mapped (picture.info, picture.frame.get (), GST_MAP_READ);
  if (!mapped || part.width < 1 || part.height < 1)
    return std::nullopt;
  std::vector<std::uint64_t> counts (std::size_t (largest) + 1);
  read_pixels (mapped, [&] (auto pixels) {
    for (int y = part.y; y < part.bottom (); y++)
      for (int x = part.x; x < part.right (); x++)
        counts[std::size_t (std::min<int> (pixels.at (x, y), largest))]++;
  });
  const auto most =
      std::uint64_t (kOutside * part.width * double (part.height));
  const auto end_of = [most] (auto begin, auto end) {
    std::uint64_t passed = 0;
    auto at = begin;
    while (at + 1 != end && (passed += *at) <= most)
      ++at;
    return int (at - begin);
  };
  const int black = end_of (counts.begin (), counts.end ());
  const int white = largest - end_of (counts.rbegin (), counts.rend ());
  return Tones{std::min (black, largest - 1), std::max (white, black + 1)};
}

} // namespace codedexposure::app
