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
  if (line->setup_id && line->setup) {
    know (*line->setup_id, *line->setup);
    line->setup.reset ();
  }
  if (lines_.size () == kMaxLines)
    lines_.pop_front ();
  lines_.push_back ({pts, duration, *std::move (line)});
  return {};
}

void
TrackReader::know (std::uint64_t id, const StreamSetup &setup)
{
  constexpr std::size_t kMostSetups = 256;
  if (setups_.contains (id))
    return;
  if (setups_.size () == kMostSetups)
    setups_.erase (setups_.begin ());
  setups_[id] = std::make_shared<const StreamSetup> (setup);
}

void
TrackReader::clear ()
{
  lines_.clear ();
  frames_.reset ();
  offset_.reset ();
  ended_ = false;
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

void
TrackReader::skip (Match &match, const Line &line, Nanoseconds start) const
{
  if (order_ != Order::all || line.stop () - tolerance (line.duration) <= start)
    return;
  if (match.skipped++ == 0)
    match.skipped_from = line.pts;
}

void
TrackReader::place (Match &match, const Line &line)
{
  const FrameRecord &record = *line.line.frame;
  const Nanoseconds offset = line.pts - record.pts.value_or (line.pts);
  const Nanoseconds rounding =
      tolerance (record.duration.value_or (line.duration));
  if (std::abs (offset) > rounding) {
    match.offset = offset;
    match.misplaced =
        std::abs (offset - offset_.value_or (offset)) > 2 * rounding;
    offset_ = offset_.value_or (offset);
  }
  offset_ = offset_.value_or (0);
  match.line = line.line;
}

void
TrackReader::find_setup (Match &match)
{
  const auto id = match.line ? match.line->setup_id : std::nullopt;
  const auto known = id ? setups_.find (*id) : setups_.end ();
  match.names_unknown_setup = id && known == setups_.end ();
  if (known != setups_.end ())
    match.setup = known->second;
  else if (!id)
    match.setup = last_setup_;
}

/* A line that is skipped may hold the setup of those after it. */
TrackReader::Match
TrackReader::take_until (Place end, Nanoseconds start)
{
  Match match;
  if (order_ == Order::backwards) {
    if (end != lines_.end ()) {
      place (match, *end);
      lines_.erase (end);
    }
    find_setup (match);
    return match;
  }
  const Place after = end == lines_.end () ? end : std::next (end);
  for (Place line = lines_.begin (); line != after; ++line) {
    if (line->line.setup)
      last_setup_ = std::make_shared<const StreamSetup> (*line->line.setup);
    if (line == end)
      place (match, *line);
    else
      skip (match, *line, start);
  }
  find_setup (match);
  lines_.erase (lines_.begin (), after);
  return match;
}

/* A line whose frame comes after that at @pts has come. */
bool
TrackReader::is_past (Nanoseconds pts) const
{
  if (lines_.empty ())
    return false;
  const Nanoseconds apart = lines_.back ().pts - pts;
  return (order_ == Order::backwards ? -apart : apart) >
         tolerance (kRounding * 4);
}

std::optional<TrackReader::Match>
TrackReader::take (Nanoseconds pts, Nanoseconds start)
{
  if (find (pts, start) == lines_.end () && !is_past (pts) && !ended_)
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

std::optional<std::uint64_t>
TrackReader::number_at (Nanoseconds pts) const
{
  const auto after = std::ranges::find_if (
      lines_, [pts] (const Line &line) { return line.pts > pts; });
  if (after == lines_.end ())
    return std::nullopt;
  const FrameRecord &record = *after->line.frame;
  const Nanoseconds period =
      std::max<Nanoseconds> (record.duration.value_or (after->duration), 1);
  const auto frames = std::max<std::uint64_t> (
      std::uint64_t ((after->pts - pts + period / 2) / period), 1);
  return record.frame - std::min (record.frame, frames);
}

TrackReader::Match
TrackReader::take_rest (Nanoseconds start, Nanoseconds until)
{
  std::erase_if (
      lines_, [until] (const Line &line) { return line.pts >= until; });
  return take_until (lines_.end (), start);
}

} // namespace codedexposure
