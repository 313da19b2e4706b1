/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A DMD in this process, for the optical bench in software. */
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "dmd/dmd.h"

namespace codedexposure
{

/**
 * The mirrors of a simulated DMD, shared by name between the driver that
 * programs them and the bench that images them. Thread-safe.
 *
 * Its clock is the bench's exposure clock: the bench counts slots from its
 * first frame, and asks in order which mask is shown in each. Exposures start
 * at whole multiples of the schedule's slots.
 */
class SimulatedMirrors
{
public:
  /** The mirrors of that name in this process, which exist as long as somebody
   * holds them. */
  static std::shared_ptr<SimulatedMirrors> find (const std::string &name);

  /** For a driver, which alone programs them until it releases them; false:
   * another one has them. */
  bool claim ()
  {
    const std::lock_guard guard (lock_);
    return !std::exchange (is_claimed_, true);
  }
  void release ();

  /** Parks the mirrors and takes the masks of @p schedule. */
  void program (const Schedule &schedule);
  /** Takes one static mask, until the next program (). @p slots  of an
   * exposure. */
  void hold (StillMask mask, int slots);
  void start ();
  void stop ();
  bool running () const
  {
    const std::lock_guard guard (lock_);
    return motion_ != Motion::parked;
  }

  /** What the device says of its mirrors. */
  struct Shape {
    /** Mirrors that the bench must not go beyond; none: as many as it needs. */
    std::optional<Extent> size = {};
    /** Layout of the tile on a diamond array; none: an orthogonal array. */
    std::optional<MirrorLayout> diamond = {};
  };
  void set_shape (const Shape &shape)
  {
    const std::lock_guard guard (lock_);
    shape_ = shape;
  }
  Shape shape () const
  {
    const std::lock_guard guard (lock_);
    return shape_;
  }

  /** The last programmed one; none before the first upload. */
  std::optional<Schedule> schedule () const
  {
    const std::lock_guard guard (lock_);
    return schedule_;
  }

  /**
   * Index of the mask (MaskRenderer) in slot @p slot, counted from the bench's
   * first exposure; none while the mirrors are parked. They step from the first
   * exposure after start () on, which shows mask 0 or, with a pilot, the mask
   * of that frame's parity; but not before one whole exposure has passed since
   * stop (). A mask that is held is kStillMask in its slots, kOffMask in the
   * others.
   */
  std::optional<int> mask_in_slot (std::int64_t slot);

  /** One of two benches, in both beams, which count the same slots. */
  class View
  {
  public:
    /** @p leads: in the beam of the mirrors that are on. */
    View (std::shared_ptr<SimulatedMirrors> mirrors, bool leads);
    ~View ();
    View (const View &) = delete;
    View &operator= (const View &) = delete;

    /** SimulatedMirrors::mask_in_slot (). What the leading view saw is kept for
     * the other one, which waits for it: the driver of the mirrors expects that
     * no exposure begins before the leading view has begun it. */
    std::optional<int> mask_in_slot (std::int64_t slot);
    /** The mask that is held in the exposure of that slot; null if the
     * schedule's masks are shown. */
    const std::shared_ptr<const StillMask> &held () const { return held_; }

  private:
    const std::shared_ptr<SimulatedMirrors> mirrors_;
    const bool leads_;
    std::int64_t last_ = -1; // slot that it asked for
    std::shared_ptr<const StillMask> held_;
  };

  struct Slip {
    std::int64_t slot;
    int by;
  };
  /** From slot @p slot on, the masks come @p by slots late (> 0) or early
   * (< 0): a missed or a spurious trigger. Slips add up, in the order of their
   * slots; start () ends those before it. */
  void slip_at (std::int64_t slot, int by)
  {
    const std::lock_guard guard (lock_);
    slips_.push_back ({slot, by});
  }

private:
  enum class Motion { parked, armed, stepping };
  struct Seen {
    std::optional<int> mask;
    std::shared_ptr<const StillMask> held;
  };

  void begin_exposure ();
  std::optional<int> decide (std::int64_t slot);

  mutable std::mutex lock_; // covers everything below; a leaf lock
  bool is_claimed_ = false;
  std::optional<Schedule> schedule_;
  int slots_ = 0; // of an exposure; 0: there are no masks
  Shape shape_;
  std::shared_ptr<const StillMask> hold_, held_; // from now on; since it began
  Motion motion_ = Motion::parked;
  bool owes_dark_exposure_ = false;
  std::deque<Slip> slips_;
  std::int64_t offset_ = 0;
  std::map<std::int64_t, Seen> seen_; // of slots, for the other view
  int leading_ = 0;                   // views
  std::condition_variable moved_;     // seen_ or leading_
};

/**
 * Opens "sim:NAME[,key=value...]", whose mirrors are SimulatedMirrors::find
 * (NAME), unless another driver has them.
 *
 * The keys say what the device can do and how it fails:
 *   size=WxH            mirrors, default 1024x768; a bench with more pixels
 *                       refuses a size that is given
 *   layout=address|lattice|cell  of the tile on a diamond array; default: an
 *                       orthogonal array
 *   masks=N             masks it holds, default 512
 *   min-active=TIME     default 0
 *   min-switching=TIME  default 0
 *   mask-time=TIME      time to send one mask, default 0
 *   still=yes|no        whether it shows patterns on request, default yes
 *   triggers=yes|no     whether it triggers the camera, default no
 *   slip-at=SLOT[:BY]   slips by BY slots (default 1: late) in slot SLOT of the
 *                       bench; may be given again, for a later slot
 *   fail=open|upload|start|restart  what fails
 */
Result<std::unique_ptr<Dmd>> open_simulated_dmd (std::string_view device);
inline constexpr DmdScheme kSimulatedDmds{
    "sim:", "sim:NAME (a simulated DMD)", open_simulated_dmd};

} // namespace codedexposure
