/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/fuser.h"

#include <algorithm>
#include <array>

#include "base/pixels.h"
#include "base/text.h"
#include "base/try.h"
#include "base/view_check.h"
#include "fuse/beyond_white.h"
#include "fuse/clipped.h"
#include "fuse/covers.h"
#include "fuse/engine.h"
#include "fuse/light_ratio.h"
#include "fuse/overlap.h"

namespace codedexposure
{

namespace
{

constexpr std::string_view kQualityNames[] = {
    "fast", "balanced", "best", "learned"};
constexpr float kWhite = 255.0f;

Error
stopped ()
{
  return {"stopped", ErrorCode::cancelled};
}

/** A part of the frame that is fused separately. */
struct Piece {
  Rect rect;
  int held; ///< slots of the exposure per slot of the part
  std::unique_ptr<fuse::Engine> engine;
  std::unique_ptr<fuse::Overlap> overlap; ///< none: see unoverlapped
};

/* A part of a schedule, or of its complement; -1: the background. */
Schedule
part_of (const Schedule &schedule, int region)
{
  return region < 0 ? schedule.background () : schedule.region (region);
}

/* All parts overlap or none does, so that one word is true of the frame. */
std::string
why_no_overlap (const Schedule &schedule, const FuseOptions &options)
{
  std::string why_not;
  for (int i = -1; i < int (schedule.regions ().size ()) && why_not.empty ();
       i++)
    why_not = fuse::Overlap::why_not (part_of (schedule, i), options);
  return why_not;
}

Result<std::vector<Piece>>
make_pieces (const Schedule &schedule, int width, int height,
    const FuseOptions &options, double largest, std::stop_token stop)
{
  std::optional<Schedule> complement;
  if (options.partner) {
    ASSIGN_OR_RETURN (complement, schedule.complement ());
  }
  std::vector<Piece> pieces;
  for (int i = -1; i < int (schedule.regions ().size ()); i++) {
    const Schedule part = part_of (schedule, i);
    std::optional<Schedule> partner;
    if (complement)
      partner = part_of (*complement, i);
    const Rect rect = i < 0 ? Rect{0, 0, width, height}
                            : schedule.regions ()[std::size_t (i)].rect;
    ASSIGN_OR_RETURN (
        auto engine, fuse::Engine::make (part, partner ? &*partner : nullptr,
                         rect.width, rect.height, options, largest, stop));
    Piece &piece = pieces.emplace_back (
        Piece{rect, schedule.slots () / part.slots (), std::move (engine), {}});
    if (options.overlap == 1)
      continue;
    ASSIGN_OR_RETURN (piece.overlap, fuse::Overlap::make (part, rect.width,
                                         rect.height, options, largest, stop));
  }
  return pieces;
}

/** Writes what @p camera saw above @p black, times @p scale, to @p light. */
template <typename Pixel>
void
set_light (Field &light, const fuse::CodedCamera &camera,
    ImageView<const Pixel> seen, float scale, float black = 0.0f)
{
  for (int y = 0; y < light.height (); y++) {
    const Pixel *from = seen.row (y);
    float *to = light.row (y);
    for (int x = 0; x < light.width (); x++)
      to[x] = (float (from[x]) - black) * scale;
    if (const float *gain = camera.gain (y))
      for (int x = 0; x < light.width (); x++)
        to[x] *= gain[x];
  }
}

/** Of light, from those of pixels. */
Field
squared_errors (
    const fuse::CodedCamera &camera, ImageView<const float> errors, float scale)
{
  Field squares (errors.width, errors.height);
  for (int y = 0; y < errors.height; y++) {
    const float *from = errors.row (y), *gain = camera.gain (y);
    for (int x = 0; x < errors.width; x++) {
      const float error = from[x] * scale * (gain ? gain[x] : 1.0f);
      squares.row (y)[x] = error * error;
    }
  }
  return squares;
}

} // namespace

std::string_view
quality_name (FuseQuality quality)
{
  return kQualityNames[int (quality)];
}

std::vector<std::string_view>
fuse_targets ()
{
  std::vector<std::string_view> names;
  for (const fuse::Kernels &kernels : fuse::supported_kernels ())
    names.push_back (kernels.name);
  return names;
}

const std::string &
refinement_hash ()
{
  return fuse::RefineNetwork::trained ().hash ();
}

template <typename Pixel>
struct Fuser<Pixel>::State {
  /** The background, or the whole frame, and the regions. */
  std::vector<Piece> pieces;
  std::vector<fuse::Cover> covers;
  int slots;
  int history;
  std::string unoverlapped;
  float largest;
  bool has_partners;
  float partner_black;
  int range;
  std::optional<fuse::BeyondWhite<Pixel>>
      beyond; ///< with a range of more than 1
  std::unique_ptr<Workers> workers;

  Result<void> take (ImageView<const Pixel> coded,
      const std::optional<ImageView<const Pixel>> &partner,
      const CodedErrors &errors)
  {
    const float scale = kWhite / largest;
    const fuse::LightRatio ratio =
        partner ? light_of (coded, *partner) : fuse::LightRatio ();
    const float partner_scale = scale * float (ratio.value ());
    /* Light that cannot be compared with that of the first camera tells
     * nothing. */
    const bool both = partner && ratio.known ();
    const Extent size = pieces.front ().engine->size ();
    const bool saturated =
        both && beyond &&
        fuse::has_clipped (coded.rows (0, size.height), Pixel (largest));
    if (saturated)
      RETURN_IF_ERROR (beyond->take (*partner));
    for (Piece &piece : pieces) {
      const auto &[x, y, width, height] = piece.rect;
      fuse::CodedStream &stream = piece.engine->stream ();
      fuse::CodedFrame &frame = stream.next ();
      frame.has_partner = both;
      set_light (frame.light, stream.camera (),
          coded.block (x, y, width, height), scale);
      if (both)
        set_light (frame.partner.light, *stream.partner_camera (),
            partner->block (x, y, width, height), partner_scale, partner_black);
      if (errors.coded)
        frame.errors = squared_errors (
            stream.camera (), errors.coded->block (x, y, width, height), scale);
      if (both && errors.partner)
        frame.partner.errors = squared_errors (*stream.partner_camera (),
            errors.partner->block (x, y, width, height), partner_scale);
      frame.clipped = both ? clipped_near (piece, coded, *partner, frame)
                           : std::vector<std::uint8_t> ();
      if (saturated)
        go_beyond (piece, coded, partner_scale, frame);
      if (&piece == &pieces.front ())
        for (const auto &[at, from] : covers) {
          frame.light.row (at.y)[at.x] = frame.light.row (from.y)[from.x];
          if (both)
            frame.partner.light.row (at.y)[at.x] =
                frame.partner.light.row (from.y)[from.x];
        }
      stream.take ();
    }
    return {};
  }

  /* By the background, or the whole. Where the first camera often is saturated,
   * parts that the second one sees nearly as bright are left out: in some other
   * slot, the first was saturated. */
  fuse::LightRatio light_of (
      ImageView<const Pixel> coded, ImageView<const Pixel> partner) const
  {
    constexpr float kBelow = 0.9f; // white
    const Piece &piece = pieces.front ();
    const auto [width, height] = piece.engine->size ();
    const auto a = coded.block (piece.rect.x, piece.rect.y, width, height);
    const auto b = partner.block (piece.rect.x, piece.rect.y, width, height);
    const fuse::CodedStream &stream = piece.engine->stream ();
    fuse::LightLimits limits{largest, largest, partner_black};
    if (!beyond)
      return fuse::light_ratio (stream, a, b, limits, {13, 32});
    constexpr fuse::LightParts kSmall{5, 8};
    const auto ratio = fuse::light_ratio (stream, a, b, limits, kSmall);
    limits.first *= kBelow;
    limits.second = std::min (
        largest, limits.first / float (ratio.value ()) + partner_black);
    return ratio.known () ? fuse::light_ratio (stream, a, b, limits, kSmall)
                          : ratio;
  }

  /* Near pixels of which the partner does not tell, because it is saturated, or
   * what it tells is far beyond white of fused frames and saturates the first
   * camera. Empty: there are none. */
  std::vector<std::uint8_t> clipped_near (const Piece &piece,
      ImageView<const Pixel> coded, ImageView<const Pixel> partner,
      const fuse::CodedFrame &frame) const
  {
    const auto white = Pixel (largest);
    const float beyond_all = 1.1f * kWhite * float (range);
    const auto [width, height] = piece.engine->size ();
    const auto first = coded.block (piece.rect.x, piece.rect.y, width, height);
    const auto seen = partner.block (piece.rect.x, piece.rect.y, width, height);
    if (!fuse::has_clipped (seen, white) && !fuse::has_clipped (first, white))
      return {};
    std::vector<std::uint8_t> marks;
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        marks.push_back (seen.at (x, y) >= white ||
                         (first.at (x, y) >= white &&
                             frame.partner.light.row (y)[x] > beyond_all));
    if (&piece == &pieces.front ())
      for (const auto &[at, from] : covers)
        marks[std::size_t (at.y) * std::size_t (width) + std::size_t (at.x)] =
            marks[std::size_t (from.y) * std::size_t (width) +
                  std::size_t (from.x)];
    if (std::ranges::find (marks, 1) == marks.end ())
      return {};
    return fuse::near_marks (std::move (marks), width, height);
  }

  /* Light of saturated pixels, which is white at least, where the partner tells
   * of it. It is as wrong, about, as the slot differs from the others, of which
   * the partner saw the mean. */
  void go_beyond (const Piece &piece, ImageView<const Pixel> coded,
      float partner_scale, fuse::CodedFrame &frame) const
  {
    const auto [width, height] = piece.engine->size ();
    if (frame.errors.empty ())
      frame.errors = Field (width, height);
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++) {
        const int left = piece.rect.x + x, top = piece.rect.y + y;
        const auto at = std::size_t (y) * std::size_t (width) + std::size_t (x);
        if (coded.at (left, top) < largest ||
            (!frame.clipped.empty () && frame.clipped[at]))
          continue;
        float &light = frame.light.row (y)[x];
        light = std::max (
            light, (beyond->at (left, top) - partner_black) * partner_scale);
        const float apart = light - frame.partner.light.row (y)[x];
        frame.errors.row (y)[x] = apart * apart;
      }
  }

  Result<void> check (std::span<const ImageView<Pixel>> frames,
      std::span<const ImageView<std::uint16_t>> uncertainty, Extent size) const
  {
    if (pieces.front ().engine->stream ().pending () == 0)
      return Error{"no coded frame is pending; take () one first"};
    for (const std::size_t views : {frames.size (),
             uncertainty.empty () ? frames.size () : uncertainty.size ()})
      if (int (views) != slots)
        return Error{std::to_string (views) + " views instead of " +
                     std::to_string (slots) + ", one for each slot"};
    /* Without memory of the heap: an error leaves the coded frame pending. */
    std::array<ViewBytes, 2 * Schedule::kMaxSlots> room;
    std::size_t count = 0;
    for (const auto &frame : frames)
      room[count++] = ViewBytes::of (frame);
    for (const auto &frame : uncertainty)
      room[count++] = ViewBytes::of (frame);
    const auto outputs = std::span<const ViewBytes> (room).first (count);
    for (const ViewBytes &output : outputs)
      RETURN_IF_ERROR (
          check_view (output, "fused frame", size.width, size.height));
    return check_apart (outputs);
  }

  void fuse (std::span<const ImageView<Pixel>> frames, std::stop_token stop,
      std::span<const ImageView<std::uint16_t>> uncertainty)
  {
    const float scale = largest / (kWhite * float (range));
    const fuse::Task task{*workers, std::move (stop)};
    for (Piece &piece : pieces) {
      const auto &[left, top, width, height] = piece.rect;
      const std::size_t held = std::size_t (piece.held);
      const auto of_slot = [&] (std::size_t slot, int y,
                               const float *const *rows) {
        return piece.overlap ? piece.overlap->mix (int (slot), y, rows[slot],
                                   piece.engine->is_static ().row (y))
                             : rows[slot];
      };
      const auto write = [&] (int y, const float *const *rows) {
        const auto row = [&] (std::size_t k) {
          return frames[k].row (top + y) + left;
        };
        const fuse::Kernels &kernels = piece.engine->kernels ();
        for (std::size_t k = 0; k < frames.size (); k++)
          if (k % held != 0)
            std::copy_n (row (k - 1), width, row (k));
          else if constexpr (sizeof (Pixel) == 1)
            kernels.to_bytes (
                of_slot (k / held, y, rows), scale, largest, width, row (k));
          else
            kernels.to_words (
                of_slot (k / held, y, rows), scale, largest, width, row (k));
      };
      const fuse::Uncertainty::Sink write_deviation =
          [&] (const fuse::Uncertainty::Row &row) {
            const float *deviations =
                piece.overlap ? piece.overlap->mix_deviations (row.slot, row.y,
                                    row.deviations,
                                    piece.engine->is_static ().row (row.y))
                              : row.deviations;
            for (std::size_t k = std::size_t (row.slot) * held;
                 k < std::size_t (row.slot + 1) * held; k++)
              piece.engine->kernels ().to_words (deviations,
                  float (kUncertaintyWhite) / (kWhite * float (range)),
                  65535.0f, width, uncertainty[k].row (top + row.y) + left);
          };
      if (piece.overlap)
        piece.overlap->run (
            piece.engine->stream ().frames (), !uncertainty.empty (), task);
      piece.engine->fuse (write, task,
          uncertainty.empty () ? fuse::Uncertainty::Sink () : write_deviation);
    }
  }

  void forget ()
  {
    for (Piece &piece : pieces) {
      piece.engine->forget ();
      if (piece.overlap)
        piece.overlap->forget ();
    }
  }

  /** What @p function returns; when that is an error, the pieces may have
   * gone different ways, and all forget. */
  template <typename Function>
  Result<void> or_forget (const Function &function)
  {
    try {
      Result<void> done = function ();
      if (!done)
        forget ();
      return done;
    } catch (const fuse::Stopped &) {
      forget ();
      return stopped ();
    } catch (const std::bad_alloc &) {
      forget ();
      return out_of_memory ();
    }
  }
};

template <typename Pixel>
Result<Fuser<Pixel>>
Fuser<Pixel>::make (const Schedule &schedule, int width, int height,
    const FuseOptions &wanted, std::stop_token stop)
try {
  FuseOptions options = wanted;
  if (wanted.quality == FuseQuality::kLearned) {
    options.quality = FuseQuality::kBest;
    options.refine = true;
  }
  constexpr int kBits = 8 * int (sizeof (Pixel));
  if (options.bits < 0 || options.bits > kBits)
    return Error{"bits " + std::to_string (options.bits) +
                 ": pixels have 1 to " + std::to_string (kBits) +
                 ", and 0 stands for all of them"};
  if (options.threads < 0 || options.threads > Workers::kMost)
    return Error{"threads " + std::to_string (options.threads) +
                 ": they must be 1 to " + std::to_string (Workers::kMost) +
                 ", and 0 stands for one for each processor"};
  if (!(options.partner_black >= 0.0 && options.partner_black <= 65535.0))
    return Error{"a partner's black level of " +
                 real_text (options.partner_black) +
                 " DN: it must be 0 to 65535"};
  const int largest = largest_pixel_of<Pixel> (options.bits);
  RETURN_IF_ERROR (schedule.check_size (width, height));
  std::string unoverlapped;
  if (options.overlap > 1)
    unoverlapped = why_no_overlap (schedule, options);
  if (!unoverlapped.empty ())
    options.overlap = 1;
  ASSIGN_OR_RETURN (auto pieces,
      make_pieces (schedule, width, height, options, largest, stop));
  int history = options.noise.full_well > 0.0 ? fuse::StaticPixels::kMemory : 1;
  if (options.overlap > 1)
    history += fuse::Overlap::kHistory;
  static_assert (
      fuse::StaticPixels::kMemory + fuse::Overlap::kHistory == kMaxHistory);
  std::optional<fuse::BeyondWhite<Pixel>> beyond;
  if (options.partner && options.range > 1) {
    ASSIGN_OR_RETURN (beyond, fuse::BeyondWhite<Pixel>::make (schedule,
                                  {width, height}, options, std::move (stop)));
  }
  auto state = std::make_shared<State> (State{std::move (pieces),
      fuse::find_covers (schedule, {width, height - schedule.pilot_rows ()}),
      schedule.slots (), history, std::move (unoverlapped), float (largest),
      wanted.partner, float (wanted.partner_black), wanted.range,
      std::move (beyond),
      std::make_unique<Workers> (
          options.threads == 0 && options.quality == FuseQuality::kFast &&
                  !options.refine
              ? 1
              : options.threads)});
  return Fuser (std::move (state));
} catch (const fuse::Stopped &) {
  return stopped ();
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

template <typename Pixel>
int
Fuser<Pixel>::slots () const
{
  return state_->slots;
}

template <typename Pixel>
int
Fuser<Pixel>::history () const
{
  return state_->history;
}

template <typename Pixel>
std::string
Fuser<Pixel>::unoverlapped () const
{
  return state_->unoverlapped;
}

template <typename Pixel>
std::string
Fuser<Pixel>::unrefined () const
{
  for (const Piece &piece : state_->pieces)
    if (!piece.engine->unrefined ().empty ())
      return piece.engine->unrefined ();
  return {};
}

template <typename Pixel>
Extent
Fuser<Pixel>::size () const
{
  return state_->pieces.front ().engine->size ();
}

template <typename Pixel>
Result<void>
Fuser<Pixel>::take (ImageView<const Pixel> coded,
    const std::optional<ImageView<const Pixel>> &partner,
    const CodedErrors &errors)
{
  const Rect &whole = state_->pieces.front ().rect;
  RETURN_IF_ERROR (check_view (
      ViewBytes::of (coded), "coded frame", whole.width, whole.height));
  if (partner && !state_->has_partners)
    return Error{"a partner was not expected; set FuseOptions::partner"};
  if (partner)
    RETURN_IF_ERROR (check_view (ViewBytes::of (*partner),
        "partner of the coded frame", whole.width, whole.height));
  for (const auto &[known, name] :
      {std::pair (errors.coded, "errors of the coded frame"),
          std::pair (errors.partner, "errors of its partner")})
    if (known)
      RETURN_IF_ERROR (
          check_view (ViewBytes::of (*known), name, whole.width, whole.height));
  return state_->or_forget (
      [&] { return state_->take (coded, partner, errors); });
}

template <typename Pixel>
int
Fuser<Pixel>::pending () const
{
  return state_->pieces.front ().engine->stream ().pending ();
}

template <typename Pixel>
Result<void>
Fuser<Pixel>::fuse (std::span<const ImageView<Pixel>> frames,
    std::stop_token stop, std::span<const ImageView<std::uint16_t>> uncertainty)
{
  RETURN_IF_ERROR (state_->check (frames, uncertainty, size ()));
  return state_->or_forget ([&] () -> Result<void> {
    state_->fuse (frames, std::move (stop), uncertainty);
    return {};
  });
}

template <typename Pixel>
Result<void>
Fuser<Pixel>::pass ()
{
  if (pending () == 0)
    return Error{"no coded frame is pending; take () one first"};
  return state_->or_forget ([&] () -> Result<void> {
    for (Piece &piece : state_->pieces) {
      if (piece.overlap)
        piece.overlap->pass (
            piece.engine->stream ().frames (), *state_->workers);
      piece.engine->pass (*state_->workers);
    }
    return {};
  });
}

template <typename Pixel>
void
Fuser<Pixel>::forget ()
{
  state_->forget ();
}

template class Fuser<std::uint8_t>;
template class Fuser<std::uint16_t>;

} // namespace codedexposure
