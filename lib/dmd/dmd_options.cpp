/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dmd_options.h"

#include <array>

#include "base/text.h"

namespace codedexposure
{

namespace
{

/** Sets @p out to @p first or @p second, whichever is named. */
template <typename T>
bool
choose (std::string_view text, std::string_view first_name, T first,
    std::string_view second_name, T second, T &out)
{
  if (text != first_name && text != second_name)
    return false;
  out = text == first_name ? first : second;
  return true;
}

/** The value of a Result, where it has one. */
template <typename T, typename U>
bool
take (Result<T> result, U &out)
{
  if (result)
    out = *std::move (result);
  return result.ok ();
}

bool
parse_images (std::string_view text, std::vector<int> &images)
{
  constexpr int kMaxImage = 255;
  for (const std::string_view part : split (text, '/')) {
    const auto image = parse_int (part);
    if (!image || *image < 0 || *image > kMaxImage)
      return false;
    images.push_back (*image);
  }
  return true;
}

struct Key {
  std::string_view name;
  std::string_view values;
  bool (*set) (std::string_view value, DmdOptions &options);
};

using Text = std::string_view;
using Options = DmdOptions;

constexpr std::array<Key, 17> kKeys{{
    {"master", "dmd|camera",
        [] (Text v, Options &o) {
          return choose (
              v, "dmd", Master::dmd, "camera", Master::camera, o.master);
        }},
    {"layout", "address|lattice|cell",
        [] (Text v, Options &o) {
          return take (parse_layout (v), o.placement.layout);
        }},
    {"region", "WxH[+X+Y]",
        [] (Text v, Options &o) {
          return take (parse_region (v), o.placement.region);
        }},
    {"trigger-delay", "TIME",
        [] (Text v, Options &o) {
          return take (parse_time (v), o.trigger_delay);
        }},
    {"edge", "rising|falling",
        [] (Text v, Options &o) {
          return choose (v, "rising", false, "falling", true, o.falling_edge);
        }},
    {"pulse", "high|low",
        [] (Text v, Options &o) {
          return choose (v, "high", false, "low", true, o.pulse_low);
        }},
    {"patience", "TIME of 100ms or more",
        [] (Text v, Options &o) {
          Nanoseconds time = 0;
          const bool taken = take (parse_time (v), time);
          o.patience = std::chrono::milliseconds (time / 1'000'000);
          return taken && o.patience >= std::chrono::milliseconds (100);
        }},
    {"guard", "on|off",
        [] (Text v, Options &o) {
          return choose (v, "on", true, "off", false, o.guard);
        }},
    {"images", "A[/B...]",
        [] (Text v, Options &o) { return parse_images (v, o.images); }},
    {"source", "flash|video",
        [] (Text v, Options &o) {
          return choose (v, "flash", dlpc350::Source::flash, "video",
              dlpc350::Source::video, o.source);
        }},
    {"trigger2-bit", "disables|enables",
        [] (Text v, Options &o) {
          return choose (
              v, "disables", true, "enables", false, o.trigger2_bit_disables);
        }},
    {"table", "first|last",
        [] (Text v, Options &o) {
          return choose (v, "first", true, "last", false, o.table_first);
        }},
    {"erle-padding", "on|off",
        [] (Text v, Options &o) {
          return choose (
              v, "on", kErleUnit, "off", std::size_t (1), o.erle_unit);
        }},
    {"polarity-bit", "0|1",
        [] (Text v, Options &o) {
          return choose (v, "0", 0, "1", 1, o.polarity_bit);
        }},
    {"odd-rows", "right|left",
        [] (Text v, Options &o) {
          return choose (
              v, "right", false, "left", true, o.placement.odd_rows_left);
        }},
    {"image-pair", "plain|swapped",
        [] (Text v, Options &o) {
          return choose (v, "plain", false, "swapped", true, o.swap_image_pair);
        }},
    {"gap", "TIME",
        [] (Text v, Options &o) { return take (parse_time (v), o.gap); }},
}};

std::string
known_keys ()
{
  std::string text;
  for (const Key &key : kKeys)
    text += (text.empty () ? "" : ", ") + std::string (key.name) + "=" +
            std::string (key.values);
  return text;
}

Result<void>
set_option (std::string_view option, DmdOptions &options)
{
  const std::size_t equals = option.find ('=');
  const std::string_view name = option.substr (0, equals);
  for (const Key &key : kKeys) {
    if (key.name != name || equals == option.npos)
      continue;
    if (key.set (option.substr (equals + 1), options))
      return {};
    return Error{"cannot use " + in_quotes (option) + "; " +
                 std::string (key.name) + " is " + std::string (key.values)};
  }
  return Error{"no option of a DMD is called " + in_quotes (option) +
               "; options are " + known_keys ()};
}

} // namespace

Result<DmdOptions>
DmdOptions::parse (std::string_view text)
{
  const auto parts = split (text, ',');
  DmdOptions options;
  options.which = std::string (parts.front ());
  for (std::size_t i = 1; i < parts.size (); i++)
    if (const auto set = set_option (parts[i], options); !set)
      return set.error ();
  return options;
}

} // namespace codedexposure
