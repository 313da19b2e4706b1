/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/fuser.h"

#include <algorithm>

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
  std::unique_ptr<fuse::Engine> engine;
  float largest;
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
  const int largest = (1 << (options.bits ? options.bits : kBits)) - 1;
  auto engine = fuse::Engine::make (schedule, width, height, options, largest);
  if (!engine)
    return engine.error ();
  return Fuser (std::make_unique<State> (std::move (*engine), float (largest)));
}

template <typename Pixel>
int
Fuser<Pixel>::slots () const
{
  return state_->engine->slots ();
}

template <typename Pixel>
Extent
Fuser<Pixel>::size () const
{
  return {state_->engine->width (), state_->engine->height ()};
}

template <typename Pixel>
void
Fuser<Pixel>::take (ImageView<const Pixel> coded)
{
  fuse::Engine &engine = *state_->engine;
  Field &light = engine.next ();
  const float scale = kWhite / state_->largest;
  for (int y = 0; y < engine.height (); y++) {
    const Pixel *from = coded.row (y);
    float *to = light.row (y);
    for (int x = 0; x < engine.width (); x++)
      to[x] = float (from[x]) * scale;
    if (const float *gain = engine.gain (y))
      for (int x = 0; x < engine.width (); x++)
        to[x] *= gain[x];
  }
  engine.take ();
}

template <typename Pixel>
int
Fuser<Pixel>::pending () const
{
  return state_->engine->pending ();
}

template <typename Pixel>
void
Fuser<Pixel>::fuse (std::span<const ImageView<Pixel>> frames)
{
  const float scale = state_->largest / kWhite;
  const int width = state_->engine->width ();
  state_->engine->fuse ([&] (int y, const float *const *slots) {
    for (std::size_t k = 0; k < frames.size (); k++)
      write_row (slots[k], scale, state_->largest, width, frames[k].row (y));
  });
}

template <typename Pixel>
void
Fuser<Pixel>::forget ()
{
  state_->engine->forget ();
}

template class Fuser<std::uint8_t>;
template class Fuser<std::uint16_t>;

} // namespace cexp
