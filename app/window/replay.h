/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a window shows: the present, or pictures of the last second again. It
 * knows nothing of GStreamer; times are in ns. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <utility>
#include <vector>

namespace codedexposure::app
{

using ViewTime = std::uint64_t;

/** The last pictures of a stream. */
template <typename Picture>
class Recent
{
public:
  /** @p span  time for which pictures are kept; a few are always kept. */
  explicit Recent (ViewTime span) : span_ (span) {}

  /** One that is not later than the last belongs to a new stream. At most @p
   * most are kept. */
  void add (ViewTime time, Picture picture,
      std::size_t most = std::numeric_limits<std::size_t>::max ())
  {
    if (!kept_.empty () && time <= kept_.back ().first)
      kept_.clear ();
    kept_.emplace_back (time, std::move (picture));
    while (kept_.size () > kFew &&
           (kept_.size () > most || kept_.front ().first + span_ < time))
      kept_.pop_front ();
  }

  /** The picture of that time: the last one that is not later, or the first of
   * all. Null: there is none. */
  const Picture *at (ViewTime time) const
  {
    const auto later = std::upper_bound (kept_.begin (), kept_.end (), time,
        [] (ViewTime t, const auto &kept) { return t < kept.first; });
    if (kept_.empty ())
      return nullptr;
    return &(later == kept_.begin () ? later : later - 1)->second;
  }

  /** Of all pictures, ascending. */
  std::vector<ViewTime> times () const
  {
    std::vector<ViewTime> times;
    for (const auto &kept : kept_)
      times.push_back (kept.first);
    return times;
  }

  void clear () { kept_.clear (); }

private:
  static constexpr std::size_t kFew = 3;

  ViewTime span_;
  std::deque<std::pair<ViewTime, Picture>> kept_;
};

/** Which picture is shown. Live, it is the present one. Paused or in a loop, it
 * is one of those that were remembered when live ended. */
class Replay
{
public:
  enum class Mode { kLive, kPaused, kLoop };
  enum class Key { kPause, kLoop, kBack, kForward };
  /** A loop takes this many times as long as the pictures did. */
  static constexpr int kSlowness = 4;

  /** @p now    time at which the key acts.
   * @p times   of the remembered pictures, ascending; only used if live. */
  void press (Key key, ViewTime now, std::vector<ViewTime> times)
  {
    const bool was_live = is_live ();
    if (was_live) {
      if (times.empty ())
        return;
      times_ = std::move (times);
      first_ = index_at (now);
    } else
      first_ = shown (now);
    since_ = now;
    switch (key) {
    case Key::kPause:
      mode_ = mode_ == Mode::kPaused ? Mode::kLive : Mode::kPaused;
      break;
    case Key::kLoop:
      mode_ = mode_ == Mode::kLoop ? Mode::kLive : Mode::kLoop;
      if (was_live)
        first_ = 0;
      break;
    case Key::kBack:
      mode_ = Mode::kPaused;
      first_ -= first_ > 0 ? 1 : 0;
      break;
    case Key::kForward:
      mode_ = Mode::kPaused;
      first_ += first_ + 1 < times_.size () ? 1 : 0;
      break;
    }
  }

  Mode mode () const { return mode_; }
  bool is_live () const { return mode_ == Mode::kLive; }

  /* Unless live: */

  /** Number of pictures that can be shown. */
  std::size_t size () const { return times_.size (); }
  /** Index of the picture that is shown @p now. */
  std::size_t shown (ViewTime now) const
  {
    if (mode_ != Mode::kLoop || now <= since_)
      return first_;
    const ViewTime last = times_.size () - 1;
    const ViewTime step = last > 0 ? times_[last] - times_[last - 1] : 1;
    const ViewTime length = times_[last] - times_[0] + step;
    const ViewTime played =
        times_[first_] - times_[0] + (now - since_) / kSlowness;
    return index_at (times_[0] + played % length);
  }
  /** Time of the last of them. */
  ViewTime last () const { return times_.back (); }
  /** The time of the picture that is shown. */
  ViewTime time (ViewTime now) const { return times_[shown (now)]; }

private:
  std::size_t index_at (ViewTime time) const
  {
    const auto later = std::upper_bound (times_.begin (), times_.end (), time);
    return later == times_.begin () ? 0
                                    : std::size_t (later - times_.begin ()) - 1;
  }

  Mode mode_ = Mode::kLive;
  std::vector<ViewTime> times_;
  std::size_t first_ = 0; // that is shown at since_
  ViewTime since_ = 0;
};

} // namespace codedexposure::app
