/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pictures that say which slot they were exposed in, and a judge that reads
 * them again from what a pipeline delivers. */
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "base/image.h"
#include "common/raii.h"

namespace codedexposure::campaign
{

inline constexpr int kSlots = 4;   ///< of a frame; all tiles are 2x2
inline constexpr int kWidth = 48;  ///< pixels
inline constexpr int kScene = 32;  ///< rows that encode the slot
inline constexpr int kHeight = 40; ///< with the rows of the pilot
inline constexpr GstClockTime kSlotTime = 10 * GST_MSECOND;
inline constexpr GstClockTime kPeriod = kSlots * kSlotTime;

/** Draws the light of slot @p slot: 32 bits of a hash of it, a block of pixels
 * each, with a texture that differs in every pixel and slot. */
void draw_slot (std::int64_t slot, ImageView<std::uint8_t> out);
/** A pixel of a coded frame whose first slot is @p slot, by `sequential:2x2`.
 */
int coded_pixel (std::int64_t slot, int x, int y);

/** How a subframe's pixels are compared. */
enum class Reading {
  exact, ///< every pixel, for one-hot codes without noise
  bits,  ///< the 32 bits, for codes that have to be solved
};

/** What came of some subframes. */
struct Tally {
  std::uint64_t delivered = 0;
  std::uint64_t wrong = 0;       ///< not the light of their slot
  std::uint64_t flagged = 0;     ///< CORRUPTED, GAP or known not synchronised
  std::uint64_t as_good = 0;     ///< wrong, and not flagged: must be 0
  std::uint64_t unjudged = 0;    ///< wrong by a slip, synchronisation unknown
  std::uint64_t false_alarm = 0; ///< flagged, and right
  std::uint64_t missing = 0;
  std::uint64_t untold = 0; ///< missing, without a sign of it: must be 0

  Tally &operator+= (const Tally &other);
};

/** Compares every subframe that passes a pad with the light of its slot. */
class Judge
{
public:
  /** The slots of which the light of a subframe at that time may be: more than
   * one if a camera gave a time to several frames, none if to no frame. */
  using SlotsAt = std::function<std::vector<std::int64_t> (GstClockTime)>;

  struct Options {
    Reading reading = Reading::exact;
    /** By default, slot k is exposed at k kSlotTime. */
    SlotsAt slots_at = {};
    /** A slip may be unknown: such subframes are not as_good. */
    bool slips = false;
    /** Or may only be unknown in these slots. */
    std::set<std::int64_t> unknown_slots = {};
    /** The slot follows from the number of the frame, not from its time, but
     * not across so many lost frames or more, when the camera was gone. */
    bool by_number = false;
    guint64 gone = 20;
    /** Subframes come in any order, and the same one may come again. */
    bool any_order = false;
  };

  explicit Judge (Options options) : options_ (std::move (options)) {}
  Judge () = default;

  /** From now on, until the pad is gone. */
  void watch (GstPad *pad);
  /** No subframe follows. @p slots: how many were exposed; @p told: the user
   * was told that the stream ended too early. */
  void end (std::int64_t slots, bool told);

  Tally tally () const;
  std::set<std::int64_t> unjudged_slots () const;
  /** The slots of the first few that are as_good or untold. */
  std::string evidence () const;

private:
  static GstPadProbeReturn pass (GstPad *, GstPadProbeInfo *, gpointer self);
  void judge (GstPad *pad, GstBuffer *buffer);
  std::vector<std::int64_t> expected (GstBuffer *, const GstVideoInfo &);
  std::vector<std::int64_t> numbered (GstBuffer *, const GstVideoInfo &);
  void note_missing (std::int64_t slot, bool told);
  void note (const std::string &text);

  Options options_;
  mutable std::mutex lock_;
  Tally tally_;
  std::set<std::int64_t> unjudged_;
  std::string evidence_;
  std::int64_t next_ = 0; ///< slot
  std::set<std::int64_t> seen_; ///< slots, in any_order
  bool gap_ = false;      ///< a GAP event came since the last subframe
  std::optional<std::int64_t> anchor_; ///< slot of number 0, in by_number
  std::optional<std::int64_t> origin_; ///< the anchor before
};

/** Whether @p subframe shows the light of @p slot. */
bool shows (const GstVideoInfo &info, GstBuffer *subframe, std::int64_t slot,
    Reading reading);
/** The slot whose light @p subframe shows, among the first 100,000. */
std::optional<std::int64_t> slot_of (
    const GstVideoInfo &info, GstBuffer *subframe);

} // namespace codedexposure::campaign
