/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "excerpt.h"

#include <algorithm>
#include <deque>
#include <map>
#include <mutex>

namespace codedexposure::gst
{

namespace
{

/* Frames follow each other if they are up to one and a half periods apart. One
 * more is for a frame that the end of upstream's segment cuts. */
GstClockTime
span_of (int frames, GstClockTime period)
{
  return GstClockTime (frames + (frames + 1) / 2 + 1) * period;
}

/* None if it is not known. */
std::optional<GstClockTime>
position (GstSeekType type, gint64 value, GstPad *sink)
{
  if (type == GST_SEEK_TYPE_SET)
    return GstClockTime (value);
  gint64 duration = 0;
  if (type != GST_SEEK_TYPE_END ||
      !gst_pad_peer_query_duration (sink, GST_FORMAT_TIME, &duration))
    return std::nullopt;
  return GstClockTime (std::max<gint64> (duration + value, 0));
}

struct Book {
  struct Note {
    const void *by;
    guint32 seqnum;
    SeekRequest request;
  };
  struct Reader {
    std::string stream;
    Reach reach;
  };
  std::mutex lock;
  std::deque<Note> notes; ///< the last ones
  std::map<const void *, Reader> readers;
};
Book book;

} // namespace

std::optional<SeekRequest>
SeekRequest::parse (GstEvent *seek, GstPad *sink, GstClockTime stop_before)
{
  SeekRequest request;
  GstFormat format;
  GstSeekType start_type, stop_type;
  gint64 start, stop;
  gst_event_parse_seek (seek, &request.rate, &format, &request.flags,
      &start_type, &start, &stop_type, &stop);
  if (format != GST_FORMAT_TIME)
    return std::nullopt;
  const auto from = position (start_type, start, sink);
  const auto until = stop_type == GST_SEEK_TYPE_NONE
                         ? std::optional (stop_before)
                         : position (stop_type, stop, sink);
  if (!from || !until)
    return std::nullopt;
  request.start = GST_CLOCK_TIME_IS_VALID (*from) ? *from : 0;
  request.stop = *until;
  return request;
}

/* A segment that begins with a unit begins with a frame that is not cut, and
 * has its recorded time. */
EventPtr
SeekRequest::widen (GstEvent *seek, Reach reach, GstClockTime period) const
{
  GstSeekType stop_type;
  gst_event_parse_seek (
      seek, nullptr, nullptr, nullptr, nullptr, nullptr, &stop_type, nullptr);
  const GstClockTime before = std::min (start, span_of (reach.history, period));
  const bool ends = GST_CLOCK_TIME_IS_VALID (stop);
  constexpr int kWhere = GST_SEEK_FLAG_ACCURATE | GST_SEEK_FLAG_KEY_UNIT |
                         GST_SEEK_FLAG_SNAP_NEAREST;
  const int where = rate > 0
                        ? GST_SEEK_FLAG_KEY_UNIT | GST_SEEK_FLAG_SNAP_BEFORE
                        : GST_SEEK_FLAG_ACCURATE;
  const auto wide = GstSeekFlags ((flags & ~kWhere) | where);
  EventPtr wider (gst_event_new_seek (rate, GST_FORMAT_TIME, wide,
      GST_SEEK_TYPE_SET, gint64 (start - before),
      stop_type == GST_SEEK_TYPE_NONE ? stop_type : GST_SEEK_TYPE_SET,
      ends ? gint64 (stop + span_of (reach.lookahead, period)) : -1));
  gst_event_set_seqnum (wider.get (), gst_event_get_seqnum (seek));
  GstClockTime interval = 0;
  gst_event_parse_seek_trickmode_interval (seek, &interval);
  gst_event_set_seek_trickmode_interval (wider.get (), interval);
  return wider;
}

void
SeekBook::note (const void *by, guint32 seqnum, const SeekRequest &request)
{
  constexpr std::size_t kKept = 64;
  const std::lock_guard lock (book.lock);
  book.notes.push_back ({by, seqnum, request});
  if (book.notes.size () > kKept)
    book.notes.pop_front ();
}

std::optional<SeekRequest>
SeekBook::find (const void *by, guint32 seqnum)
{
  const std::lock_guard lock (book.lock);
  const Book::Note *found = nullptr;
  for (const Book::Note &note : book.notes)
    if (note.seqnum == seqnum && (!found || note.by == by))
      found = &note;
  return found ? std::optional (found->request) : std::nullopt;
}

void
SeekBook::read (const void *by, const std::string &stream, Reach reach)
{
  const std::lock_guard lock (book.lock);
  book.readers.insert_or_assign (by, Book::Reader{stream, reach});
}

void
SeekBook::forget (const void *by)
{
  const std::lock_guard lock (book.lock);
  book.readers.erase (by);
  std::erase_if (
      book.notes, [by] (const Book::Note &note) { return note.by == by; });
}

Reach
SeekBook::reach (const void *by)
{
  const std::lock_guard lock (book.lock);
  Reach most;
  const auto own = book.readers.find (by);
  for (const auto &[element, reader] : book.readers)
    if (own != book.readers.end () && reader.stream == own->second.stream)
      most = {std::max (most.history, reader.reach.history),
          std::max (most.lookahead, reader.reach.lookahead)};
  return most;
}

Excerpt::Excerpt (const SeekRequest &request, GstSegment &segment)
    : request_ (request)
{
  const bool has_time = GST_CLOCK_TIME_IS_VALID (segment.time);
  const auto to_buffers = [&] (GstClockTime time) {
    const gint64 shift =
        has_time ? gint64 (segment.start) - gint64 (segment.time) : 0;
    return GST_CLOCK_TIME_IS_VALID (time)
               ? GstClockTime (std::max<gint64> (gint64 (time) + shift, 0))
               : time;
  };
  request_.start = to_buffers (request.start);
  request_.stop = to_buffers (request.stop);
  /* No stop is the largest time. */
  const GstClockTime start = std::min (request_.start, segment.stop);
  if (has_time)
    segment.time += start - segment.start;
  segment.start = start;
  segment.stop = std::min (request_.stop, segment.stop);
  segment.position = segment.rate > 0 ? segment.start : segment.stop;
}

/* A seek to a unit, a coded frame, begins with that which was exposed at its
 * start, unless it asks for another. */
GstClockTime
Excerpt::early_by (GstClockTime period) const
{
  const auto snap = request_.flags & GST_SEEK_FLAG_SNAP_NEAREST;
  if (!(request_.flags & GST_SEEK_FLAG_KEY_UNIT) ||
      snap == GST_SEEK_FLAG_SNAP_AFTER)
    return kRounding;
  return snap == GST_SEEK_FLAG_SNAP_NEAREST ? period / 2 : period - kRounding;
}

Place
Excerpt::place (GstClockTime pts, GstClockTime period) const
{
  const bool before = pts + early_by (period) < request_.start;
  const bool after = GST_CLOCK_TIME_IS_VALID (request_.stop) &&
                     pts + kRounding >= request_.stop;
  if (!before && !after)
    return Place::inside;
  return before == (request_.rate > 0) ? Place::early : Place::past;
}

/* Running times count from the end where playback begins, which no longer moves
 * when the segment went downstream. */
bool
Excerpt::include (
    GstSegment &segment, GstClockTime pts, GstClockTime period) const
{
  const GstSegment before = segment;
  const bool forwards = segment.rate > 0;
  if (pts < segment.start && !(begun && forwards)) {
    if (GST_CLOCK_TIME_IS_VALID (segment.time))
      segment.time -= std::min (segment.time, segment.start - pts);
    segment.start = pts;
  }
  if (GST_CLOCK_TIME_IS_VALID (segment.stop) && (forwards || !begun))
    segment.stop = std::max (segment.stop, pts + period);
  segment.position = forwards ? pts + period : pts;
  return segment.start != before.start || segment.stop != before.stop;
}

} // namespace codedexposure::gst
