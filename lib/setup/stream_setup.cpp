/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "setup/stream_setup.h"

#include <utility>

#include "mapping/json.h"
#include "schedule/json.h"
#include "setup/json.h"

namespace codedexposure
{

namespace
{

constexpr int kMaxRate = 1'000'000'000;

/* A pair of positive integers, which is taken out of @root. */
std::optional<std::pair<int, int>>
take_pair (Json &root, const char *key, int highest, const std::string &rule)
{
  const auto found = root.find (key);
  if (found == root.end ())
    return std::nullopt;
  int first = 0, second = 0;
  integers_into ({&first, &second}, highest, rule) (*found, key);
  if (first < 1 || second < 1)
    throw expected (key, rule, *found);
  root.erase (found);
  return std::pair (first, second);
}

/* An object of its own, which is taken out of @root. */
template <typename T>
std::optional<T>
take_inner (Json &root, const char *key, T (*read) (const Json &))
{
  const auto found = root.find (key);
  if (found == root.end ())
    return std::nullopt;
  try {
    T inner = read (*found);
    root.erase (found);
    return inner;
  } catch (const Error &refused) {
    throw refused.with_prefix ("in key '" + std::string (key) + "': ");
  }
}

/* Taken out of @root; false if it is left out. */
bool
take_bool (Json &root, const char *key)
{
  const auto found = root.find (key);
  if (found == root.end ())
    return false;
  if (!found->is_boolean ())
    throw expected (key, "true or false", *found);
  const bool value = found->get<bool> ();
  root.erase (found);
  return value;
}

StreamSetup
read_setup (Json root)
{
  StreamSetup setup;
  if (root.is_object ()) {
    setup.mapping = take_inner (root, "mapping", read_mapping);
    setup.bench = take_inner (root, "bench", read_bench_profile);
    if (const auto size = take_pair (root, "size", Mapping::kMaxSize,
            "two whole numbers, width and height"))
      setup.size = Extent{size->first, size->second};
    if (const auto rate = take_pair (root, "rate", kMaxRate,
            "two whole numbers, frames in so many seconds"))
      setup.rate = FrameRate{rate->first, rate->second};
    setup.track = take_bool (root, "track");
    setup.simulated = take_bool (root, "simulated");
  }
  setup.schedule = read_schedule (root);
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
  if (track)
    text += ",\"track\":true";
  if (simulated)
    text += ",\"simulated\":true";
  if (mapping)
    text += ",\"mapping\":" + mapping->to_json ();
  if (bench)
    text += ",\"bench\":" + bench->to_json ();
  return text + "}";
}

} // namespace codedexposure
