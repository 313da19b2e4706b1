/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Finds the line of each frame in a track. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "record/track.h"
#include "schedule/timing.h"

namespace codedexposure
{

/** The lines of a track that no frame has taken yet. Lines come in the order of
 * their times; so do frames. */
class TrackReader
{
public:
  /** Lines that wait for their frames; the oldest are dropped. */
  static constexpr std::size_t kMaxLines = 1 << 16;

  /** A text of the track with the container's times.
   * @return an error if it cannot be read; its frame will have no line. */
  Result<void> add (
      std::string_view text, Nanoseconds pts, Nanoseconds duration);
  /** Lines may name @p setup, although none of them holds it. */
  void know (const StreamSetup &setup) { know (id_of (setup), setup); }
  /** No line follows. */
  void end () { ended_ = true; }
  /** Forgets the lines, but no setup. */
  void clear ();

  /** In what order frames and lines come. */
  enum class Order {
    all,       ///< each after those before it
    some,      ///< frames are left out on purpose
    backwards, ///< from the last to the first
  };
  /** Another recording may follow, with another offset. */
  void next_segment (Order order = Order::all)
  {
    offset_.reset ();
    order_ = order;
  }

  struct Match {
    /** Null: the track has no line for this frame. */
    std::optional<TrackLine> line;
    /** Of the frame; null: not known, or there is none. */
    std::shared_ptr<const StreamSetup> setup;
    bool names_unknown_setup = false;
    /** To add to the times of the record. */
    Nanoseconds offset = 0;
    /** The offset is neither 0 nor that of the frames before: the container's
     * time of this frame is wrong. */
    bool misplaced = false;
    /** Frames of the track between the one before and this one. */
    std::uint64_t skipped = 0;
    Nanoseconds skipped_from = 0; ///< PTS of the first of them
  };
  /**
   * The line of the frame at @p pts, which is taken out together with those
   * before it.
   * @p start  of the segment: a frame there may be the rest of one that began
   *           earlier, and lines that end before it are not counted as skipped.
   * @return none if the line may still come.
   */
  std::optional<Match> take (Nanoseconds pts, Nanoseconds start);
  /** The same when no line will be waited for. */
  Match take_now (Nanoseconds pts, Nanoseconds start);
  /** Frames of the track that did not come, of those before @p until. */
  Match take_rest (Nanoseconds start,
      Nanoseconds until = std::numeric_limits<Nanoseconds>::max ());

  /** Of a frame without a line: counted back from the line after @p pts by the
   * time between them; none: no such line has come. */
  std::optional<std::uint64_t> number_at (Nanoseconds pts) const;
  /** How many frames the last line says the stream has. */
  std::optional<std::uint64_t> frames () const { return frames_; }

private:
  struct Line {
    Nanoseconds pts, duration;
    TrackLine line;
    Nanoseconds stop () const { return pts + duration; }
  };
  using Place = std::deque<Line>::iterator;

  void know (std::uint64_t id, const StreamSetup &setup);
  Place find (Nanoseconds pts, Nanoseconds start);
  bool is_past (Nanoseconds pts) const;
  Match take_until (Place place, Nanoseconds start);
  void skip (Match &match, const Line &line, Nanoseconds start) const;
  void place (Match &match, const Line &line);
  void find_setup (Match &match);

  std::deque<Line> lines_;
  std::map<std::uint64_t, std::shared_ptr<const StreamSetup>> setups_;
  /** In force, by lines that name none. */
  std::shared_ptr<const StreamSetup> last_setup_;
  Order order_ = Order::all;
  std::optional<std::uint64_t> frames_;
  std::optional<Nanoseconds> offset_; // of the first frame
  bool ended_ = false;
};

} // namespace codedexposure
