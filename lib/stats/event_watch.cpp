/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "stats/event_watch.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "base/text.h"

namespace codedexposure
{

namespace
{

constexpr std::size_t kUsual = 25; // pictures
constexpr std::size_t kFewest = 5; // after which an event can be told

} // namespace

std::optional<EventRule>
parse_event_rule (std::string_view text)
{
  EventRule rule;
  const auto colon = text.find (':'), at = text.find ('@');
  if (colon == std::string_view::npos)
    return std::nullopt;
  const std::string_view kind = text.substr (0, colon);
  const auto percent = parse_real (
      text.substr (colon + 1, at == text.npos ? at : at - colon - 1));
  if ((kind != "mean" && kind != "motion") || !percent ||
      !(*percent > 0 && *percent <= 100))
    return std::nullopt;
  rule.kind = kind == "mean" ? EventRule::Kind::mean : EventRule::Kind::motion;
  rule.part = *percent / 100;
  if (at == text.npos)
    return rule;
  rule.region = parse_rect (text.substr (at + 1));
  const bool is_region = rule.region && rule.region->x >= 0 &&
                         rule.region->y >= 0 && rule.region->width > 0 &&
                         rule.region->height > 0;
  return is_region ? std::optional (rule) : std::nullopt;
}

template <typename Pixel>
std::optional<double>
EventWatch::add_pixels (ImageView<const Pixel> picture, int largest)
{
  const Rect whole{0, 0, picture.width, picture.height};
  const Rect region = rule_.region.value_or (whole);
  if (!fits ({picture.width, picture.height}))
    return std::nullopt;
  const auto width = std::size_t (region.width);
  const auto pixels = width * std::size_t (region.height);
  const bool moves = rule_.kind == EventRule::Kind::motion;
  const bool is_first = before_.size () != pixels;
  if (moves)
    before_.resize (pixels);
  std::uint64_t sum = 0;
  for (int y = 0; y < region.height; y++) {
    const Pixel *row = picture.row (region.y + y) + region.x;
    if (!moves) {
      sum = std::accumulate (row, row + width, sum);
      continue;
    }
    std::uint16_t *before = before_.data () + std::size_t (y) * width;
    for (std::size_t x = 0; x < width; x++) {
      sum += std::uint64_t (std::abs (int (row[x]) - int (before[x])));
      before[x] = row[x];
    }
  }
  if (moves && is_first)
    return std::nullopt;
  return judge (double (sum) / double (pixels) / largest);
}

template std::optional<double> EventWatch::add_pixels (
    ImageView<const std::uint8_t>, int);
template std::optional<double> EventWatch::add_pixels (
    ImageView<const std::uint16_t>, int);

/* What follows an event becomes usual. */
std::optional<double>
EventWatch::judge (double value)
{
  const double usual = std::accumulate (usual_.begin (), usual_.end (), 0.0) /
                       double (std::max<std::size_t> (1, usual_.size ()));
  const double jump = value - usual;
  const bool is_event =
      usual_.size () >= kFewest &&
      (rule_.kind == EventRule::Kind::motion ? jump : std::abs (jump)) >
          rule_.part;
  if (is_event)
    usual_.clear ();
  usual_.push_back (value);
  if (usual_.size () > kUsual)
    usual_.pop_front ();
  return is_event ? std::optional (jump) : std::nullopt;
}

} // namespace codedexposure
