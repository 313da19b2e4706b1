/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "setup/stream_setup.h"

#include "base/text.h"
#include "mapping/json.h"
#include "schedule/json.h"
#include "setup/json.h"

namespace codedexposure
{

namespace
{

constexpr int kMaxRate = 1'000'000'000;

/** Two positive integers. */
template <typename T>
JsonReader
pair_into (std::optional<T> &to, int T::*first, int T::*second, int highest,
    const std::string &rule)
{
  return [=, &to] (const Json &value, const std::string &key) {
    T &pair = to.emplace ();
    integers_into ({&(pair.*first), &(pair.*second)}, highest, rule) (
        value, key);
    if (pair.*first < 1 || pair.*second < 1)
      throw expected (key, rule, value);
  };
}

JsonReader
frame_size_into (std::optional<Extent> &to)
{
  return pair_into (to, &Extent::width, &Extent::height, Mapping::kMaxSize,
      "two whole numbers, width and height");
}

JsonReader
at_least_zero_into (double &to)
{
  const std::string rule = "a number of 0 or more, and 1e9 at most";
  return [=, &to] (const Json &value, const std::string &key) {
    number_into (to, rule) (value, key);
    if (!(to >= 0.0 && to <= 1e9))
      throw expected (key, rule, value);
  };
}

PartnerSetup
read_partner (const Json &root)
{
  std::optional<Extent> size;
  PartnerSetup partner;
  read_keys (root, "", "a partner has a size",
      {{"size", frame_size_into (size), true},
          {"mapping", inner_into (partner.mapping, read_mapping)},
          {"black", integer_into (partner.black, 65535)},
          {"electrons", at_least_zero_into (partner.electrons)},
          {"read_noise", at_least_zero_into (partner.read_noise)},
          {"light_ratio", at_least_zero_into (partner.light_ratio)}});
  partner.size = *size;
  return partner;
}

JsonReader
beam_into (bool &off)
{
  return [&off] (const Json &value, const std::string &key) {
    std::string beam;
    text_into (beam) (value, key);
    if (beam != "off")
      throw expected (key, "\"off\"", value);
    off = true;
  };
}

StreamSetup
read_setup (const Json &root)
{
  StreamSetup setup;
  setup.schedule = read_schedule (root,
      {{"mapping", inner_into (setup.mapping, read_mapping)},
          {"bench", inner_into (setup.bench, read_bench_profile)},
          {"size", frame_size_into (setup.size)},
          {"rate",
              pair_into (setup.rate, &FrameRate::num, &FrameRate::den, kMaxRate,
                  "two whole numbers, frames in so many seconds")},
          {"bits", integer_into (setup.bits, 16)},
          {"track", flag_into (setup.track)},
          {"simulated", flag_into (setup.simulated)},
          {"beam", beam_into (setup.off_beam)},
          {"partner", inner_into (setup.partner, read_partner)}});
  return setup;
}

} // namespace

Result<StreamSetup>
StreamSetup::from_json (std::string_view json)
{
  return read_json<StreamSetup> (json, "schedule", kMaxJsonSize, read_setup);
}

std::string
StreamSetup::to_json () const
{
  std::string text = schedule.to_json ();
  text.pop_back ();
  const auto add_pair = [&text] (const char *key, int first, int second) {
    text += std::string (",\"") + key + "\":[" + std::to_string (first) + "," +
            std::to_string (second) + "]";
  };
  if (size)
    add_pair ("size", size->width, size->height);
  if (rate)
    add_pair ("rate", rate->num, rate->den);
  if (bits > 0)
    text += ",\"bits\":" + std::to_string (bits);
  if (track)
    text += ",\"track\":true";
  if (simulated)
    text += ",\"simulated\":true";
  if (mapping)
    text += ",\"mapping\":" + mapping->to_json ();
  if (bench)
    text += ",\"bench\":" + bench->to_json ();
  if (off_beam)
    text += ",\"beam\":\"off\"";
  if (partner) {
    text += ",\"partner\":{\"size\":[" + std::to_string (partner->size.width) +
            "," + std::to_string (partner->size.height) + "]";
    if (partner->mapping)
      text += ",\"mapping\":" + partner->mapping->to_json ();
    if (partner->black > 0)
      text += ",\"black\":" + std::to_string (partner->black);
    for (const auto &[name, value] :
        {std::pair ("electrons", partner->electrons),
            {"read_noise", partner->read_noise},
            {"light_ratio", partner->light_ratio}})
      if (value > 0.0)
        text += std::string (",\"") + name + "\":" + real_text (value);
    text += "}";
  }
  return text + "}";
}

PartnerSetup
StreamSetup::as_partner (Extent frames) const
{
  PartnerSetup made{frames, known_mapping ()};
  if (!bench)
    return made;
  made.black = bench->black ();
  made.electrons = bench->electrons_per_number ().value_or (0.0);
  made.read_noise = value_or (bench->read_noise, 0.0);
  made.light_ratio = value_or (bench->light_ratio, 0.0);
  return made;
}

} // namespace codedexposure
