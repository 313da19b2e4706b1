/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/options.h"

#include <algorithm>
#include <optional>

#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

std::optional<std::vector<int>>
parse_images (std::string_view text)
{
  constexpr int kMaxImage = 255;
  std::vector<int> images;
  for (const std::string_view part : split (text, '/')) {
    const auto image = parse_int (part);
    if (!image || *image < 0 || *image > kMaxImage)
      return std::nullopt;
    images.push_back (*image);
  }
  return images;
}

std::optional<std::chrono::milliseconds>
parse_patience (std::string_view text)
{
  constexpr std::chrono::milliseconds kMin{100};
  const auto time = parse_time (text);
  const std::chrono::milliseconds patience (time ? *time / 1'000'000 : 0);
  return patience >= kMin ? std::optional (patience) : std::nullopt;
}

Result<void>
set_option (std::string_view option, std::span<const DeviceKey> keys)
{
  const std::size_t equals = option.find ('=');
  const auto key =
      std::find_if (keys.begin (), keys.end (), [&] (const DeviceKey &known) {
        return known.name == option.substr (0, equals);
      });
  if (key != keys.end () && equals != option.npos) {
    if (key->set (option.substr (equals + 1)))
      return {};
    return Error{"cannot use " + in_quotes (option) + "; " + key->name +
                 " is " + key->values};
  }
  std::string known;
  for (const DeviceKey &each : keys)
    known += (known.empty () ? "" : ", ") + each.name + "=" + each.values;
  return Error{
      "unknown option " + in_quotes (option) + "; options are " + known};
}

} // namespace

Result<std::string>
parse_device (std::string_view device, std::span<const DeviceKey> keys)
{
  const auto parts = split (device, ',');
  for (std::size_t i = 1; i < parts.size (); i++)
    RETURN_IF_ERROR (with_prefix (
        set_option (parts[i], keys), "DMD " + in_quotes (device) + ": "));
  return std::string (parts.front ().substr (parts.front ().find (':') + 1));
}

Result<DmdOptions>
DmdOptions::parse (std::string_view device)
{
  using dlpc350::Source;
  DmdOptions o;
  const DeviceKey keys[] = {
      choice_key ("master", o.master,
          {{"dmd", Master::dmd}, {"camera", Master::camera}}),
      value_key (
          "layout", "address|lattice|cell", o.placement.layout, parse_layout),
      value_key ("region", "WxH[+X+Y]", o.placement.region, parse_region),
      value_key ("trigger-delay", "TIME", o.trigger_delay, parse_time),
      choice_key (
          "edge", o.falling_edge, {{"rising", false}, {"falling", true}}),
      choice_key ("pulse", o.pulse_low, {{"high", false}, {"low", true}}),
      value_key (
          "patience", "TIME of 100ms or more", o.patience, parse_patience),
      choice_key ("guard", o.guard, {{"on", true}, {"off", false}}),
      value_key ("images", "A[/B...]", o.images, parse_images),
      choice_key ("source", o.source,
          {{"flash", Source::flash}, {"video", Source::video}}),
      choice_key ("polarity-bit", o.polarity_bit, {{"0", 0}, {"1", 1}}),
      choice_key ("odd-rows", o.placement.odd_rows_left,
          {{"right", false}, {"left", true}}),
      value_key ("gap", "TIME", o.gap, parse_time)};
  ASSIGN_OR_RETURN (o.which, parse_device (device, keys));
  const auto parts = split (device, ',');
  for (std::size_t i = 1; i < parts.size (); i++)
    o.keys.emplace_back (parts[i].substr (0, parts[i].find ('=')));
  return o;
}

} // namespace codedexposure
