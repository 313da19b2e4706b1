/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The versioned JSON form of bench profiles: docs/formats.md. */
#include "setup/json.h"

#include <cstdio>

#include "mapping/json.h"

namespace codedexposure
{

namespace
{

const JsonHead kHead{"bench profile", "coded-exposure-bench", 1};

/** A UTC time as in ISO 8601, to the second. */
JsonReader
time_into (std::chrono::sys_seconds &to)
{
  return [&to] (const Json &value, const std::string &key) {
    using namespace std::chrono;
    constexpr std::string_view form = "2026-03-14T09:26:53Z";
    const std::string text =
        value.is_string () ? value.get<std::string> () : "";
    bool good = text.size () == form.size ();
    for (std::size_t i = 0; good && i < form.size (); i++) {
      const auto digit = [] (char c) { return c >= '0' && c <= '9'; };
      good = digit (form[i]) ? digit (text[i]) : form[i] == text[i];
    }
    const auto number = [&] (std::size_t at, std::size_t digits) {
      return parse_int (text.substr (at, digits)).value_or (0);
    };
    if (good) {
      const year_month_day day{year (number (0, 4)), month (number (5, 2)),
          std::chrono::day (number (8, 2))};
      const int h = number (11, 2), m = number (14, 2), s = number (17, 2);
      good = day.ok () && h < 24 && m < 60 && s < 60;
      if (good)
        to = sys_days (day) + hours (h) + minutes (m) + seconds (s);
    }
    if (!good)
      throw expected (
          key, "a UTC time such as \"" + std::string (form) + "\"", value);
  };
}

std::string
time_text (std::chrono::sys_seconds time)
{
  using namespace std::chrono;
  const auto midnight = floor<days> (time);
  const year_month_day day (midnight);
  const hh_mm_ss clock (time - midnight);
  char text[64];
  std::snprintf (text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02dZ",
      int (day.year ()), unsigned (day.month ()), unsigned (day.day ()),
      int (clock.hours ().count ()), int (clock.minutes ().count ()),
      int (clock.seconds ().count ()));
  return text;
}

JsonReader
device_into (BenchProfile::Device &to)
{
  return [&to] (const Json &value, const std::string &key) {
    read_keys (value, key, "a device has a size, [width, height]",
        {{"vendor", text_into (to.vendor)}, {"model", text_into (to.model)},
            {"serial", text_into (to.serial)},
            {"size", size_into (to.size, Mapping::kMaxSize), true}});
  };
}

OrderedJson
device_json (const BenchProfile::Device &device)
{
  OrderedJson json;
  if (!device.vendor.empty ())
    json["vendor"] = device.vendor;
  if (!device.model.empty ())
    json["model"] = device.model;
  if (!device.serial.empty ())
    json["serial"] = device.serial;
  json["size"] = {device.size.width, device.size.height};
  return json;
}

Measured
read_measured (const Json &value, const std::string &key)
{
  Measured measured;
  read_keys (value, key, "a measured number has a value and a sigma",
      {{"value", number_into (measured.value, "a number"), true},
          {"sigma", number_into (measured.sigma, "a number"), true}});
  return measured;
}

} // namespace

BenchProfile
read_bench_profile (const Json &root)
{
  BenchProfile profile;
  JsonKeys keys = {
      {"measured", time_into (profile.measured), true},
      {"camera", device_into (profile.camera), true},
      {"dmd",
          [&profile] (const Json &value, const std::string &key) {
            profile.dmd = BenchProfile::Device{};
            device_into (*profile.dmd) (value, key);
          }},
      {"pixel_format", text_into (profile.pixel_format)},
      {"bits", integer_into (profile.bits, 16, 1), true},
  };
  for (const BenchQuantity &quantity : bench_quantities ())
    keys.push_back ({quantity.key,
        [&number = profile.*quantity.member] (const Json &value,
            const std::string &key) { number = read_measured (value, key); }});
  keys.push_back ({"mapping", inner_into (profile.mapping, read_mapping)});
  keys.push_back (
      {"second", [&profile] (const Json &value, const std::string &key) {
         if (value.is_object () && value.contains ("second"))
           throw Error{"in key '" + key +
                           "': the second camera of a profile has no second "
                           "one itself; leave it out",
               ErrorCode::parse};
         std::optional<BenchProfile> one;
         inner_into (one, read_bench_profile) (value, key);
         profile.second = {*std::move (one)};
       }});
  read_versioned (root, kHead,
      "a bench profile needs at least format, version, measured, camera and "
      "bits",
      keys);
  if (const auto good = profile.check (); !good)
    throw Error{good.error ().message, ErrorCode::parse};
  return profile;
}

Result<BenchProfile>
BenchProfile::parse (std::string_view json_or_path)
{
  return json_or_path.starts_with ('{')
             ? from_json (json_or_path)
             : load_json (std::string (json_or_path), kHead.what, kMaxJsonSize,
                   from_json);
}

Result<BenchProfile>
BenchProfile::from_json (std::string_view json)
{
  return read_json<BenchProfile> (
      json, kHead.what, kMaxJsonSize, read_bench_profile);
}

std::string
BenchProfile::to_json () const
{
  OrderedJson root;
  root["format"] = kHead.format;
  root["version"] = kHead.version;
  root["measured"] = time_text (measured);
  root["camera"] = device_json (camera);
  if (dmd)
    root["dmd"] = device_json (*dmd);
  if (!pixel_format.empty ())
    root["pixel_format"] = pixel_format;
  root["bits"] = bits;
  for (const BenchQuantity &quantity : bench_quantities ())
    if (const auto &number = this->*quantity.member)
      root[quantity.key] = {{"value", number->value}, {"sigma", number->sigma}};
  if (mapping)
    root["mapping"] = json_value (mapping->to_json ());
  for (const BenchProfile &other : second)
    root["second"] = json_value (other.to_json ());
  return json_text (root);
}

} // namespace codedexposure
