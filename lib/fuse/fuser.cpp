/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/fuser.h"

#include <algorithm>
#include <cstdlib>

#include "base/text.h"
#include "fuse/engine.h"

namespace cexp
{

namespace
{

constexpr std::string_view kQualityNames[] = {"fast", "balanced", "best"};
constexpr float kWhite = 255.0f;

template <typename Pixel>
void
write_row (const float *light, float scale, float largest, int width, Pixel *to)
{
  for (int x = 0; x < width; x++) {
    const float value = light[x] * scale + 0.5f;
    to[x] = Pixel (value < 0.0f ? 0.0f : value > largest ? largest : value);
  }
}

/** A part of the frame that is fused by itself. */
struct Piece {
  Rect rect;
  int held; ///< slots of the exposure that are one of its own
  std::unique_ptr<fuse::Engine> engine;
};

/** A pixel of the background that a region covers, and the one of the same
 * element that stands for it. */
struct Cover {
  Offset at, from;
};

/** Steps of @p period from @p at that leave [from, to): to the left, or to the
 * right where @p right. */
int
way_out (int at, int from, int to, int period, bool right)
{
  return right ? ((to - 1 - at) / period + 1) * period
               : -((at - from) / period + 1) * period;
}

/** The nearest pixel of the same element, whole periods of the tile to one
 * side, that no region covers; the pixel itself where there is none. */
Offset
uncovered_pixel (const Schedule &schedule, Extent size, Offset at)
{
  const Tile &tile = schedule.tile ();
  const Rect frame{0, 0, size.width, size.height};
  Offset best = at;
  int least = size.width + size.height;
  for (const bool across : {true, false}) {
    for (const bool forward : {true, false}) {
      Offset place = at;
      while (frame.holds (place.x, place.y)) {
        const int i = schedule.region_at (place.x, place.y);
        const int away = std::abs (place.x - at.x) + std::abs (place.y - at.y);
        if (i < 0 && away < least) {
          least = away;
          best = place;
        }
        if (i < 0)
          break;
        const Rect &rect = schedule.regions ()[std::size_t (i)].rect;
        if (across)
          place.x += way_out (
              place.x, rect.x, rect.right (), tile.period_x (), forward);
        else
          place.y += way_out (
              place.y, rect.y, rect.bottom (), tile.period_y (), forward);
      }
    }
  }
  return best;
}

std::vector<Cover>
find_covers (const Schedule &schedule, Extent size)
{
  std::vector<Cover> covers;
  for (const Region &region : schedule.regions ())
    for (int y = region.rect.y; y < region.rect.bottom (); y++)
      for (int x = region.rect.x; x < region.rect.right (); x++)
        covers.push_back ({{x, y}, uncovered_pixel (schedule, size, {x, y})});
  return covers;
}

Result<std::vector<Piece>>
make_pieces (const Schedule &schedule, int width, int height,
    const FuseOptions &options, double largest)
{
  std::vector<Piece> pieces;
  for (int i = -1; i < int (schedule.regions ().size ()); i++) {
    const Schedule part = i < 0 ? schedule.background () : schedule.region (i);
    const Rect rect = i < 0 ? Rect{0, 0, width, height}
                            : schedule.regions ()[std::size_t (i)].rect;
    auto engine =
        fuse::Engine::make (part, rect.width, rect.height, options, largest);
    if (!engine)
      return engine.error ();
    pieces.push_back (
        {rect, schedule.slots () / part.slots (), std::move (*engine)});
  }
  return pieces;
}

/** @p coded, where @p engine takes it. */
template <typename Pixel>
Field &
light_of (fuse::Engine &engine, ImageView<const Pixel> coded, float scale)
{
  Field &light = engine.next ();
  for (int y = 0; y < engine.height (); y++) {
    const Pixel *from = coded.row (y);
    float *to = light.row (y);
    for (int x = 0; x < engine.width (); x++)
      to[x] = float (from[x]) * scale;
    if (const float *gain = engine.gain (y))
      for (int x = 0; x < engine.width (); x++)
        to[x] *= gain[x];
  }
  return light;
}

} // namespace

std::string_view
quality_name (FuseQuality quality)
{
  return kQualityNames[int (quality)];
}

Result<FuseQuality>
parse_quality (std::string_view name)
{
  for (int i = 0; i < int (std::size (kQualityNames)); i++)
    if (kQualityNames[i] == name)
      return FuseQuality (i);
  return Error{
      "quality " + in_quotes (name) + ": it must be fast, balanced or best"};
}

std::vector<std::string_view>
fuse_targets ()
{
  std::vector<std::string_view> names;
  for (const fuse::Kernels &kernels : fuse::supported_kernels ())
    names.push_back (kernels.name);
  return names;
}

template <typename Pixel>
struct Fuser<Pixel>::State {
  /** The background, or all there is, and the regions that cover it. */
  std::vector<Piece> pieces;
  std::vector<Cover> covers;
  int slots;
  float largest;
  std::unique_ptr<Workers> workers;
};

template <typename Pixel>
Fuser<Pixel>::Fuser (std::unique_ptr<State> state) : state_ (std::move (state))
{
}
template <typename Pixel>
Fuser<Pixel>::Fuser (Fuser &&) noexcept = default;
template <typename Pixel>
Fuser<Pixel> &Fuser<Pixel>::operator= (Fuser &&) noexcept = default;
template <typename Pixel>
Fuser<Pixel>::~Fuser () = default;

template <typename Pixel>
Result<Fuser<Pixel>>
Fuser<Pixel>::make (
    const Schedule &schedule, int width, int height, const FuseOptions &options)
{
  constexpr int kBits = 8 * int (sizeof (Pixel));
  if (options.bits < 0 || options.bits > kBits)
    return Error{"bits " + std::to_string (options.bits) +
                 ": pixels have 1 to " + std::to_string (kBits) +
                 ", and 0 stands for all of them"};
  if (options.threads < 0 || options.threads > Workers::kMost)
    return Error{"threads " + std::to_string (options.threads) +
                 ": they must be 1 to " + std::to_string (Workers::kMost) +
                 ", and 0 stands for one for each processor"};
  const int largest = (1 << (options.bits ? options.bits : kBits)) - 1;
  if (const auto within = schedule.check_size (width, height); !within)
    return within.error ();
  auto pieces = make_pieces (schedule, width, height, options, largest);
  if (!pieces)
    return pieces.error ();
  auto state = std::make_unique<State> (State{std::move (*pieces),
      find_covers (schedule, {width, height - schedule.pilot_rows ()}),
      schedule.slots (), float (largest),
      std::make_unique<Workers> (
          options.quality == FuseQuality::kFast ? 1 : options.threads)});
  return Fuser (std::move (state));
}

template <typename Pixel>
int
Fuser<Pixel>::slots () const
{
  return state_->slots;
}

template <typename Pixel>
Extent
Fuser<Pixel>::size () const
{
  const fuse::Engine &all = *state_->pieces.front ().engine;
  return {all.width (), all.height ()};
}

template <typename Pixel>
void
Fuser<Pixel>::take (ImageView<const Pixel> coded)
{
  const float scale = kWhite / state_->largest;
  for (Piece &piece : state_->pieces) {
    const auto &[x, y, width, height] = piece.rect;
    Field &light =
        light_of (*piece.engine, coded.block (x, y, width, height), scale);
    if (&piece == &state_->pieces.front ())
      for (const auto &[at, from] : state_->covers)
        light.row (at.y)[at.x] = light.row (from.y)[from.x];
    piece.engine->take ();
  }
}

template <typename Pixel>
int
Fuser<Pixel>::pending () const
{
  return state_->pieces.front ().engine->pending ();
}

template <typename Pixel>
bool
Fuser<Pixel>::fuse (
    std::span<const ImageView<Pixel>> frames, std::stop_token stop)
{
  const float scale = state_->largest / kWhite;
  bool done = true;
  for (Piece &piece : state_->pieces) {
    const auto &[left, top, width, height] = piece.rect;
    const std::size_t held = std::size_t (piece.held);
    const auto write = [&] (int y, const float *const *slots) {
      const auto row = [&] (std::size_t k) {
        return frames[k].row (top + y) + left;
      };
      for (std::size_t k = 0; k < frames.size (); k++)
        if (k % held == 0)
          write_row (slots[k / held], scale, state_->largest, width, row (k));
        else
          std::copy_n (row (k - 1), width, row (k));
    };
    done &= piece.engine->fuse (write, *state_->workers, stop);
  }
  return done;
}

template <typename Pixel>
void
Fuser<Pixel>::forget ()
{
  for (Piece &piece : state_->pieces)
    piece.engine->forget ();
}

template class Fuser<std::uint8_t>;
template class Fuser<std::uint16_t>;

} // namespace cexp
