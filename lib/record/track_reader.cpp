/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/track_reader.h"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace codedexposure
{

namespace
{

/* Containers round times, Matroska to a millisecond by default. */
constexpr Nanoseconds kRounding = 1'000'000;

Nanoseconds
tolerance (Nanoseconds duration)
{
  return std::clamp<Nanoseconds> (duration / 4, 1, kRounding);
}

} // namespace

Result<void>
TrackReader::add (std::string_view text, Nanoseconds pts, Nanoseconds duration)
{
  auto line = TrackLine::from_json (text);
  if (!line)
    return line.error ();
  if (line->end)
    frames_ = line->end;
  if (!line->frame)
    return {};
  if (pts < 0 || pts > kFarthestTime || duration < 0 ||
      duration > kFarthestTime)
    return Error{"line of the track: it is at " + std::to_string (pts) +
                     " ns for " + std::to_string (duration) +
                     " ns; its container is damaged",
        ErrorCode::parse};
  if (lines_.size () == kMaxLines)
    lines_.pop_front ();
  lines_.push_back ({pts, duration, *std::move (line)});
  return {};
}

void
TrackReader::clear ()
{
  *this = {};
}

/* A decoder may clip the first frame of a segment: its time is then anywhere
 * within that of its line. */
TrackReader::Place
TrackReader::find (Nanoseconds pts, Nanoseconds start)
{
  const auto same = std::ranges::find_if (lines_, [pts] (const Line &line) {
    return std::abs (line.pts - pts) <= tolerance (line.duration);
  });
  if (same != lines_.end () || pts != start)
    return same;
  return std::ranges::find_if (lines_, [pts] (const Line &line) {
    return line.pts <= pts && pts < line.stop ();
  });
}

TrackReader::Match
TrackReader::take_until (Place place, Nanoseconds start)
{
  Match match;
  for (Place line = lines_.begin (); line != place; ++line) {
    if (line->stop () - tolerance (line->duration) <= start)
      continue;
    if (match.skipped++ == 0)
      match.skipped_from = line->pts;
  }
  if (place != lines_.end ()) {
    const FrameRecord &record = *place->line.frame;
    const Nanoseconds offset = place->pts - record.pts.value_or (place->pts);
    const Nanoseconds rounding =
        tolerance (record.duration.value_or (place->duration));
    if (std::abs (offset) > rounding) {
      match.offset = offset;
      match.misplaced =
          std::abs (offset - offset_.value_or (offset)) > 2 * rounding;
      offset_ = offset_.value_or (offset);
    }
    offset_ = offset_.value_or (0);
    match.line = std::move (place->line);
    ++place;
  }
  lines_.erase (lines_.begin (), place);
  return match;
}

std::optional<TrackReader::Match>
TrackReader::take (Nanoseconds pts, Nanoseconds start)
{
  const bool later =
      !lines_.empty () && lines_.back ().pts - tolerance (kRounding * 4) > pts;
  if (find (pts, start) == lines_.end () && !later && !ended_)
    return std::nullopt;
  return take_now (pts, start);
}

/* Without its line, a frame leaves those of others. */
TrackReader::Match
TrackReader::take_now (Nanoseconds pts, Nanoseconds start)
{
  const Place place = find (pts, start);
  return place == lines_.end () ? Match () : take_until (place, start);
}

TrackReader::Match
TrackReader::take_rest (Nanoseconds start)
{
  return take_until (lines_.end (), start);
}

} // namespace codedexposure
