/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/extractor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "base/pixels.h"
#include "base/targets.h"
#include "base/text.h"
#include "base/try.h"
#include "base/view_check.h"
#include "extract/covered_cells.h"
#include "extract/fast_path.h"
#include "extract/reference.h"

namespace codedexposure
{

/* Plain x86-64 cannot permute bytes: the reference is as fast there. */
CODEDEXPOSURE_SUPPORTED (supported_targets, extract, Target, sse4)

namespace
{

constexpr std::string_view kScalar = "scalar";
constexpr std::array<std::string_view, 4> kMethodNames = {
    "auto", "rank", "select", "decode"};

Method
method_for (const Schedule &schedule)
{
  if (schedule.code ().one_hot () && schedule.leak () == 0.0 &&
      schedule.white_slots () == 1.0)
    return Method::kSelect;
  return schedule.code ().inverse (schedule.leak ()) ? Method::kDecode
                                                     : Method::kRank;
}

/** Element of each subframe: the one that is on in the slot of a one-hot
 * code, else the element of that number. */
std::vector<int>
elements_by_slot (const Code &code)
{
  const bool one_hot = code.one_hot ();
  std::vector<int> elements (std::size_t (code.slots ()));
  for (int s = 0; s < code.slots (); s++) {
    int &element = elements[std::size_t (s)] = s;
    if (one_hot)
      for (element = 0; !code.on (element, s); element++) {
      }
  }
  return elements;
}

Result<void>
check_options (const ExtractOptions &options, int type_bits)
{
  if (options.bits < 0 || options.bits > type_bits)
    return Error{"bits " + std::to_string (options.bits) +
                 " of pixels that have " + std::to_string (type_bits) +
                 ": give 1 to " + std::to_string (type_bits) +
                 ", or 0 for all of them"};
  if (!(options.gain >= 0.0 && options.gain <= ExtractOptions::kMaxGain))
    return Error{"gain " + real_text (options.gain) +
                 " is not a factor on light: give a positive number up to " +
                 real_text (ExtractOptions::kMaxGain) +
                 ", or 0 for the gain that keeps white white"};
  const auto targets = extract_targets ();
  if (!options.target.empty () &&
      std::ranges::find (targets, options.target) == targets.end ())
    return Error{"extraction for " + in_quotes (options.target) +
                 " does not exist on this machine; 'scalar' always does"};
  return {};
}

/** The named target and the narrower ones, for narrower frames. */
std::span<const Target>
targets_from (std::string_view name)
{
  auto targets = supported_targets ();
  while (!name.empty () && targets.front ().name != name)
    targets = targets.subspan (1);
  return targets;
}

Error
no_cell (const Schedule &schedule, int width, int height)
{
  const Extent cell = schedule.cell ();
  std::string text = "frame of " + size_text ({width, height}) +
                     " pixels holds no cell of " + size_text (cell);
  if (schedule.pilot_rows () > 0)
    text += " above the pilot's " + std::to_string (schedule.pilot_rows ()) +
            " rows";
  return Error{text + "; take larger frames or a smaller tile"};
}

} // namespace

std::string_view
method_name (Method method)
{
  return kMethodNames[std::size_t (method)];
}

std::vector<std::string_view>
extract_targets ()
{
  std::vector<std::string_view> names;
  for (const Target &target : supported_targets ())
    names.push_back (target.name);
  names.push_back (kScalar);
  return names;
}

template <typename Pixel>
struct Extractor<Pixel>::Plan : ExtractPlan {
  CoveredCells covered;
  Extent frame; ///< coded
  /** Empty: the reference does it. */
  std::optional<FastPath<Pixel>> fast = {};

  Result<void> check (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const
  {
    std::array<ViewBytes, Tile::kMaxElements> outputs;
    if (int (subframes.size ()) != grid.elements ())
      return Error{std::to_string (subframes.size ()) +
                   " views of subframes instead of " +
                   std::to_string (grid.elements ())};
    const ViewBytes input = ViewBytes::of (coded);
    RETURN_IF_ERROR (
        check_view (input, "coded frame", frame.width, frame.height));
    for (std::size_t k = 0; k < subframes.size (); k++) {
      outputs[k] = ViewBytes::of (subframes[k]);
      RETURN_IF_ERROR (
          check_view (outputs[k], "subframe", size.width, size.height));
    }
    return check_apart (std::span (outputs).first (subframes.size ()), &input);
  }

  ExtractReport run (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const
  {
    if (fast)
      return fast->run (coded, subframes);
    switch (this->method) {
    case Method::kDecode:
      for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++)
          reference_decode (coded, grid, *decoder, linear->linear (), covered,
              {i, j}, subframes);
      break;
    case Method::kSelect:
      reference_select<Pixel> (coded, grid, elements, subframes);
      break;
    default:
      reference_rank (coded, grid, subframes);
    }
    return {reference_saturated (coded, grid, largest, size.height)};
  }

  void leave_out_regions (ImageView<const Pixel> coded,
      std::span<const ImageView<Pixel>> subframes) const
  {
    if (decoder && decoder->interpolates ())
      for (const Offset cell : covered.neighbours ())
        reference_decode (
            coded, grid, *decoder, linear->linear (), covered, cell, subframes);
    for (const ImageView<Pixel> &subframe : subframes)
      covered.blacken (subframe);
  }
};

template <typename Pixel>
Result<Extractor<Pixel>>
Extractor<Pixel>::make (
    const Schedule &whole, int width, int height, const ExtractOptions &options)
try {
  constexpr int kTypeBits = std::numeric_limits<Pixel>::digits;
  RETURN_IF_ERROR (check_options (options, kTypeBits));

  const Schedule schedule = whole.background ();
  const SampleGrid grid (schedule);
  const Extent size = grid.subframe_size (width, height);
  if (size.width < 1 || size.height < 1)
    return no_cell (schedule, width, height);

  const Method method =
      options.method == Method::kAuto ? method_for (schedule) : options.method;
  auto plan = std::make_shared<Plan> (
      Plan{{method, grid, size, largest_pixel_of<Pixel> (options.bits),
               elements_by_slot (schedule.code ())},
          CoveredCells (whole, size), {width, height}});
  if (method == Method::kDecode) {
    ASSIGN_OR_RETURN (plan->decoder,
        Decoder::make (schedule, options.gain, options.interpolate));
    plan->linear.emplace (
        *plan->decoder, largest_pixel_of<Pixel> (0), plan->largest);
  }
  if (options.target != kScalar)
    plan->fast = FastPath<Pixel>::make (*plan, targets_from (options.target));
  return Extractor (std::move (plan));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

template <typename Pixel>
Method
Extractor<Pixel>::method () const
{
  return plan_->method;
}

template <typename Pixel>
double
Extractor<Pixel>::gain () const
{
  return plan_->decoder ? plan_->decoder->gain () : 1.0;
}

template <typename Pixel>
int
Extractor<Pixel>::subframes () const
{
  return plan_->grid.elements ();
}

template <typename Pixel>
Extent
Extractor<Pixel>::subframe_size () const
{
  return plan_->size;
}

template <typename Pixel>
Result<ExtractReport>
Extractor<Pixel>::run (ImageView<const Pixel> coded,
    std::span<const ImageView<Pixel>> subframes) const
{
  RETURN_IF_ERROR (plan_->check (coded, subframes));
  const ExtractReport report = plan_->run (coded, subframes);
  if (plan_->covered.any ())
    plan_->leave_out_regions (coded, subframes);
  return report;
}

template class Extractor<std::uint8_t>;
template class Extractor<std::uint16_t>;

} // namespace codedexposure
