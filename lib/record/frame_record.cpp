/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/frame_record.h"

#include <charconv>
#include <cstdio>
#include <limits>

#include "record/json.h"

namespace codedexposure
{

namespace
{

constexpr int kHashDigits = 16;
constexpr int kMaxBits = 16;

template <typename T>
void
set_known (OrderedJson &line, const char *key, const std::optional<T> &value)
{
  if (value)
    line[key] = *value;
}

/* Calls @read with the value of @key, if the object has it. */
template <typename Read>
void
with_key (const Json &object, const char *key, Read read)
{
  if (const auto found = object.find (key); found != object.end ())
    read (*found);
}

/* A whole number that a @T holds. */
template <typename T>
void
read_whole (const Json &object, const char *key, T &to)
{
  with_key (object, key, [&] (const Json &value) {
    if (value.is_number_unsigned () &&
        value.get<std::uint64_t> () <=
            std::uint64_t (std::numeric_limits<T>::max ()))
      to = T (value.get<std::uint64_t> ());
    else if (std::is_signed_v<T> && value.is_number_integer () &&
             value.get<std::int64_t> () < 0 &&
             value.get<std::int64_t> () >=
                 std::int64_t (std::numeric_limits<T>::min ()))
      to = T (value.get<std::int64_t> ());
    else
      throw expected (key, "a whole number", value);
  });
}

template <typename T>
void
read_known (const Json &object, const char *key, std::optional<T> &to)
{
  T value{};
  if (object.contains (key)) {
    read_whole (object, key, value);
    to = value;
  }
}

bool
is_too_far (const std::optional<Nanoseconds> &time)
{
  return time && (*time < -kFarthestTime || *time > kFarthestTime);
}

void
read_time (const Json &object, const char *key, std::optional<Nanoseconds> &to)
{
  read_known (object, key, to);
  if (is_too_far (to))
    throw expected (key, "a time within 73 years", object[key]);
}

std::string
read_text (const Json &value, const char *key)
{
  if (!value.is_string ())
    throw expected (key, "a text", value);
  return value.get<std::string> ();
}

} // namespace

std::string
hex_text (std::uint64_t value, int digits)
{
  char text[17];
  std::snprintf (text, sizeof text, "%0*llx", digits,
      static_cast<unsigned long long> (value));
  return text;
}

std::uint64_t
read_hex (const Json &value, const std::string &key, int digits)
{
  std::uint64_t number = 0;
  const std::string text =
      value.is_string () ? value.get<std::string> () : std::string ();
  const char *end = text.data () + text.size ();
  const auto [last, error] = std::from_chars (text.data (), end, number, 16);
  if (text.size () != std::size_t (digits) || last != end ||
      error != std::errc ())
    throw expected (
        key, std::to_string (digits) + " hexadecimal digits", value);
  return number;
}

OrderedJson
record_json (const FrameRecord &record)
{
  OrderedJson line;
  line["frame"] = record.frame;
  set_known (line, "slot", record.slot);
  set_known (line, "pts_ns", record.pts);
  set_known (line, "duration_ns", record.duration);
  set_known (line, "exposure_start_ns", record.exposure_start);
  set_known (line, "exposure_duration_ns", record.exposure_duration);
  set_known (line, "time_uncertainty_ns", record.time_uncertainty);
  line["locked"] = nullptr;
  set_known (line, "locked", record.locked);
  set_known (line, "slip", record.slip);
  set_known (line, "lost_before", record.lost_before);
  set_known (line, "saturated", record.saturated);
  if (!record.pattern.empty ())
    line["pattern"] = record.pattern;
  if (record.bits > 0)
    line["bits"] = record.bits;
  line["flags"] = record.flags;
  if (record.hash)
    line["hash"] = hex_text (*record.hash, kHashDigits);
  return line;
}

FrameRecord
read_record (const Json &object)
{
  FrameRecord record;
  read_whole (object, "frame", record.frame);
  read_known (object, "slot", record.slot);
  read_time (object, "pts_ns", record.pts);
  read_time (object, "duration_ns", record.duration);
  read_time (object, "exposure_start_ns", record.exposure_start);
  read_time (object, "exposure_duration_ns", record.exposure_duration);
  read_time (object, "time_uncertainty_ns", record.time_uncertainty);
  with_key (object, "locked", [&] (const Json &value) {
    if (!value.is_boolean () && !value.is_null ())
      throw expected ("locked", "true, false or null", value);
    if (value.is_boolean ())
      record.locked = value.get<bool> ();
  });
  read_known (object, "slip", record.slip);
  read_known (object, "lost_before", record.lost_before);
  read_known (object, "saturated", record.saturated);
  with_key (object, "pattern", [&] (const Json &value) {
    record.pattern = read_text (value, "pattern");
  });
  with_key (object, "bits", [&] (const Json &value) {
    integer_into (record.bits, kMaxBits) (value, "bits");
  });
  with_key (object, "flags", [&] (const Json &list) {
    if (!list.is_array ())
      throw expected ("flags", "a list of texts", list);
    for (const Json &flag : list)
      record.flags.push_back (read_text (flag, "flags"));
  });
  with_key (object, "hash", [&] (const Json &value) {
    record.hash = read_hex (value, "hash", kHashDigits);
  });
  return record;
}

std::optional<Nanoseconds>
FrameRecord::too_far () const
{
  for (const auto &time :
      {pts, duration, exposure_start, exposure_duration, time_uncertainty})
    if (is_too_far (time))
      return time;
  return std::nullopt;
}

std::string
FrameRecord::to_json () const
{
  return json_text (record_json (*this));
}

} // namespace codedexposure
