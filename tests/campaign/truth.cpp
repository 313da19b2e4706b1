/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "truth.h"

#include <algorithm>
#include <cstdlib>
#include <unordered_map>

#include "common/meta.h"

namespace codedexposure::campaign
{

using namespace codedexposure::gst;

namespace
{

constexpr int kBitsX = 8, kBitsY = 4;
constexpr int kBitWidth = kWidth / kBitsX, kBitHeight = kScene / kBitsY;

std::uint32_t
mix (std::uint64_t value)
{
  value = (value ^ (value >> 31)) * 0x9E3779B97F4A7C15;
  value = (value ^ (value >> 29)) * 0xBF58476D1CE4E5B9;
  return std::uint32_t (value >> 32);
}

std::uint32_t
code_of (std::int64_t slot)
{
  return mix (std::uint64_t (slot) + 1);
}

/* White fits the sum of all slots of any code. */
int
pixel_of (std::int64_t slot, int x, int y)
{
  if (y >= kScene)
    return 200;
  const int bit = y / kBitHeight * kBitsX + x / kBitWidth;
  const bool one = code_of (slot) >> bit & 1;
  return (one ? 160 : 20) +
         int (mix (std::uint64_t (slot) << 16 ^ unsigned (x << 8 ^ y)) & 31);
}

/* The mean of the inner pixels of a block, where no neighbour has a part. */
double
level_of (ImageView<const std::uint8_t> picture, int bit)
{
  const int width = kBitWidth / 2, height = kBitHeight / 2;
  const int left = bit % kBitsX * width, top = bit / kBitsX * height;
  int sum = 0, count = 0;
  for (int y = top + 1; y < top + height - 1; y++, count++)
    sum += picture.at (left + 1, y);
  return double (sum) / count;
}

std::uint32_t
read_bits (ImageView<const std::uint8_t> picture)
{
  std::uint32_t bits = 0;
  for (int bit = 0; bit < kBitsX * kBitsY; bit++)
    bits |= std::uint32_t (level_of (picture, bit) > 100) << bit;
  return bits;
}

bool
shows_exactly (ImageView<const std::uint8_t> picture, std::int64_t slot)
{
  const int element = int (slot % kSlots);
  for (int y = 0; y < kScene / 2; y++)
    for (int x = 0; x < picture.width; x++)
      if (std::abs (picture.at (x, y) - pixel_of (slot, 2 * x + element % 2,
                                            2 * y + element / 2)) > 1)
        return false;
  return true;
}

bool
has_size (const GstVideoInfo &info)
{
  return info.width == kWidth / 2 && info.height >= kScene / 2 &&
         GST_VIDEO_INFO_FORMAT (&info) == GST_VIDEO_FORMAT_GRAY8;
}

} // namespace

void
draw_slot (std::int64_t slot, ImageView<std::uint8_t> out)
{
  for (int y = 0; y < out.height; y++)
    for (int x = 0; x < out.width; x++)
      out.at (x, y) = std::uint8_t (pixel_of (slot, x, y));
}

int
coded_pixel (std::int64_t slot, int x, int y)
{
  return pixel_of (slot + x % 2 + y % 2 * 2, x, y);
}

bool
shows (const GstVideoInfo &info, GstBuffer *subframe, std::int64_t slot,
    Reading reading)
{
  if (!has_size (info))
    return false;
  MappedFrame mapped (info, subframe, GST_MAP_READ);
  if (!mapped)
    return false;
  const auto picture = view_of<std::uint8_t> (mapped);
  return read_bits (picture) == code_of (slot) &&
         (reading == Reading::bits || shows_exactly (picture, slot));
}

std::optional<std::int64_t>
slot_of (const GstVideoInfo &info, GstBuffer *subframe)
{
  static const auto slots = [] {
    std::unordered_map<std::uint32_t, std::int64_t> map;
    for (std::int64_t slot = 0; slot < 100'000; slot++)
      map.emplace (code_of (slot), slot);
    return map;
  }();
  MappedFrame mapped (info, subframe, GST_MAP_READ);
  if (!has_size (info) || !mapped)
    return std::nullopt;
  const auto found = slots.find (read_bits (view_of<std::uint8_t> (mapped)));
  return found == slots.end () ? std::nullopt : std::optional (found->second);
}

Tally &
Tally::operator+= (const Tally &other)
{
  delivered += other.delivered;
  wrong += other.wrong;
  flagged += other.flagged;
  as_good += other.as_good;
  unjudged += other.unjudged;
  false_alarm += other.false_alarm;
  missing += other.missing;
  untold += other.untold;
  return *this;
}

void
Judge::watch (GstPad *pad)
{
  gst_pad_add_probe (pad,
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
      pass, this, nullptr);
}

GstPadProbeReturn
Judge::pass (GstPad *pad, GstPadProbeInfo *info, gpointer data)
{
  auto *self = static_cast<Judge *> (data);
  if (GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_BUFFER) {
    self->judge (pad, GST_PAD_PROBE_INFO_BUFFER (info));
  } else if (GST_EVENT_TYPE (GST_PAD_PROBE_INFO_EVENT (info)) ==
             GST_EVENT_GAP) {
    const std::lock_guard guard (self->lock_);
    self->gap_ = true;
  }
  return GST_PAD_PROBE_OK;
}

/* By the number of its frame, which counts lost frames. */
std::vector<std::int64_t>
Judge::numbered (GstBuffer *buffer, const GstVideoInfo &info)
{
  const auto meta = get_frame_meta (buffer);
  if (!meta)
    return {};
  const std::int64_t number =
      std::int64_t (meta->frame) * kSlots + meta->subframe;
  if (meta->lost_before >= options_.gone)
    anchor_.reset ();
  if (!anchor_) {
    const auto seen = slot_of (info, buffer);
    if (!seen)
      return {};
    if (tally_.delivered == 0)
      next_ = *seen;
    /* Numbers go on as if the camera had run all the time; the emulated camera
     * may be late on a busy machine. */
    constexpr std::int64_t kLate = 25 * kSlots;
    anchor_ = *seen - number;
    if (std::abs (*anchor_ - origin_.value_or (*anchor_)) > kLate)
      return {};
    origin_ = anchor_;
  }
  return {*anchor_ + number};
}

/* The slots of a subframe by its time. */
std::vector<std::int64_t>
Judge::expected (GstBuffer *buffer, const GstVideoInfo &info)
{
  const GstClockTime pts = GST_BUFFER_PTS (buffer);
  if (options_.by_number)
    return numbered (buffer, info);
  if (options_.slots_at)
    return options_.slots_at (pts);
  const GstClockTime rest = pts % kSlotTime;
  if (rest > 2 * GST_USECOND && rest < kSlotTime - 2 * GST_USECOND)
    return {};
  return {std::int64_t ((pts + kSlotTime / 2) / kSlotTime)};
}

void
Judge::note (const std::string &text)
{
  if (evidence_.size () < 400)
    evidence_ += (evidence_.empty () ? "" : "; ") + text;
}

void
Judge::note_missing (std::int64_t slot, bool told)
{
  if (slot <= next_)
    return;
  tally_.missing += std::uint64_t (slot - next_);
  if (told)
    return;
  tally_.untold += std::uint64_t (slot - next_);
  note ("slots " + std::to_string (next_) + " to " + std::to_string (slot - 1) +
        " missing");
}

void
Judge::judge (GstPad *pad, GstBuffer *buffer)
{
  const CapsPtr caps (gst_pad_get_current_caps (pad));
  GstVideoInfo info;
  const bool known = caps && gst_video_info_from_caps (&info, caps.get ());
  const auto meta = get_frame_meta (buffer);

  const std::lock_guard guard (lock_);
  const auto slots =
      known ? expected (buffer, info) : std::vector<std::int64_t> ();
  const auto shown = std::ranges::find_if (slots, [&] (std::int64_t slot) {
    return shows (info, buffer, slot, options_.reading);
  });
  const bool right = shown != slots.end ();
  const std::optional<std::int64_t> slot = right ? *shown
                                           : slots.empty ()
                                               ? std::nullopt
                                               : std::optional (slots[0]);
  const bool flagged =
      GST_BUFFER_FLAG_IS_SET (buffer, GST_BUFFER_FLAG_CORRUPTED) ||
      GST_BUFFER_FLAG_IS_SET (buffer, GST_BUFFER_FLAG_GAP) ||
      (meta && meta->locked == false);
  tally_.delivered++;
  tally_.wrong += !right;
  tally_.flagged += flagged;
  tally_.false_alarm += flagged && right;
  const bool excused = meta && !meta->locked && slot &&
                       (options_.slips || options_.unknown_slots.count (*slot));
  if (!right && !flagged && excused) {
    tally_.unjudged++;
    unjudged_.insert (*slot);
  } else if (!right && !flagged) {
    tally_.as_good++;
    const auto seen = known ? slot_of (info, buffer) : std::nullopt;
    note ("slot " + (slot ? std::to_string (*slot) : "?") + " at " +
          std::to_string (GST_BUFFER_PTS (buffer) / 1000) + " us shows " +
          (seen ? std::to_string (*seen) : "none"));
  }
  if (!slot || (!right && flagged && *slot > next_ + 1000)) {
    gap_ |= flagged;
    return;
  }
  if (options_.any_order) {
    seen_.insert (*slot);
    return;
  }
  note_missing (*slot, std::exchange (gap_, false) ||
                           GST_BUFFER_IS_DISCONT (buffer) ||
                           (meta && meta->lost_before > 0));
  next_ = std::max (next_, *slot + 1);
}

void
Judge::end (std::int64_t slots, bool told)
{
  const std::lock_guard guard (lock_);
  for (; options_.any_order && next_ < slots; next_++)
    if (!seen_.contains (next_))
      note_missing (next_ + 1, told);
  note_missing (slots, told || gap_);
}

Tally
Judge::tally () const
{
  const std::lock_guard guard (lock_);
  return tally_;
}

std::set<std::int64_t>
Judge::unjudged_slots () const
{
  const std::lock_guard guard (lock_);
  return unjudged_;
}

std::string
Judge::evidence () const
{
  const std::lock_guard guard (lock_);
  return evidence_;
}

} // namespace codedexposure::campaign
