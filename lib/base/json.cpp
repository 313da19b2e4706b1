/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/json.h"

#include <algorithm>
#include <set>

#include "base/text.h"

namespace codedexposure
{

std::string
shown (const Json &value)
{
  return printable (value.dump ());
}

Error
expected (const std::string &key, const std::string &rule, const Json &value)
{
  return {"key '" + key + "' must be " + rule + ", not " + shown (value),
      ErrorCode::parse};
}

Result<void>
check_head (const Json &root, std::string_view format, int version,
    const std::string &what)
{
  const std::string head =
      "; a " + what + " begins with {\"format\":\"" + std::string (format) +
      "\",\"version\":" + std::to_string (version) + ",...";
  if (!root.is_object ())
    return Error{
        "it must be an object, not " + shown (root) + head, ErrorCode::parse};
  for (const char *key : {"format", "version"})
    if (!root.contains (key))
      return Error{"key '" + std::string (key) + "' is missing" + head,
          ErrorCode::parse};
  if (root["format"] != format)
    return Error{"format " + shown (root["format"]) + " is not known" + head,
        ErrorCode::parse};
  if (!root["version"].is_number_integer () || root["version"] != version)
    return Error{"version " + shown (root["version"]) +
                     " is not known; this program reads version " +
                     std::to_string (version),
        ErrorCode::parse};
  return {};
}

Result<void>
check_keys (const Json &object, const std::string &where,
    std::initializer_list<std::string_view> known)
{
  for (const auto &item : object.items ()) {
    if (std::find (known.begin (), known.end (), item.key ()) != known.end ())
      continue;
    std::string names;
    for (const std::string_view name : known)
      names += (names.empty () ? "" : ", ") + std::string (name);
    return Error{"there is no key " + in_quotes (item.key ()) + where +
                     "; the keys are " + names,
        ErrorCode::parse};
  }
  return {};
}

namespace
{

std::optional<std::int64_t>
as_integer (const Json &value, std::int64_t highest)
{
  const bool fits =
      value.is_number_unsigned ()
          ? value.get<std::uint64_t> () <= std::uint64_t (highest)
          : value.is_number_integer () && value.get<std::int64_t> () == 0;
  if (!fits)
    return std::nullopt;
  return value.get<std::int64_t> ();
}

std::string
integer_rule (std::int64_t highest)
{
  return "a whole number from 0 to " + std::to_string (highest);
}

/* Refuses, while the parser runs, what it would accept: see parse_strictly ().
 */
class Watch
{
public:
  explicit Watch (const std::string &what) : what_ (&what) {}

  bool operator() (int depth, Json::parse_event_t event, Json &parsed)
  {
    using Event = Json::parse_event_t;
    if (event == Event::object_start || event == Event::array_start) {
      if (depth >= kMaxDepth)
        throw Error{"brackets nest deeper than " + std::to_string (kMaxDepth) +
                        " levels; no " + *what_ + " does",
            ErrorCode::parse};
      keys_.resize (std::size_t (depth) + 1);
      keys_.back ().clear ();
    } else if (event == Event::key) {
      const auto &key = parsed.get_ref<const std::string &> ();
      if (!keys_[std::size_t (depth) - 1].insert (key).second)
        throw Error{"key " + in_quotes (key) + " stands twice; leave one out",
            ErrorCode::parse};
    }
    return true;
  }

private:
  static constexpr int kMaxDepth = 8;
  const std::string *what_;
  /** Keys of each object around the current place. */
  std::vector<std::set<std::string>> keys_;
};

} // namespace

Result<std::int64_t>
read_integer (const Json &value, const std::string &key, std::int64_t highest)
{
  if (const auto number = as_integer (value, highest))
    return *number;
  return expected (key, integer_rule (highest), value);
}

Result<std::vector<int>>
read_integers (const Json &value, const std::string &key, int highest)
{
  if (!value.is_array ())
    return expected (key, "a list of whole numbers", value);
  std::vector<int> numbers;
  numbers.reserve (value.size ());
  for (const Json &entry : value) {
    const auto number = as_integer (entry, highest);
    if (!number)
      return expected (key + "[" + std::to_string (numbers.size ()) + "]",
          integer_rule (highest), entry);
    numbers.push_back (int (*number));
  }
  return numbers;
}

Result<std::vector<double>>
read_reals (const Json &value, const std::string &key, std::size_t count)
{
  const std::string rule = std::to_string (count) + " numbers in a list";
  if (!value.is_array () || value.size () != count)
    return expected (key, rule, value);
  std::vector<double> numbers;
  numbers.reserve (count);
  for (const Json &entry : value) {
    if (!entry.is_number ())
      return expected (key + "[" + std::to_string (numbers.size ()) + "]",
          "a number", entry);
    numbers.push_back (entry.get<double> ());
  }
  return numbers;
}

Result<Json>
parse_strictly (std::string_view text, const std::string &what)
{
  /* The parser takes a zero byte for the end and ignores what follows. */
  if (const std::size_t zero = text.find ('\0'); zero != text.npos)
    return Error{"it is no valid JSON: a zero byte at " +
                     std::to_string (zero) + "; remove it and what follows",
        ErrorCode::parse};
  try {
    return Json::parse (text, Watch (what));
  } catch (const Error &refused) {
    return refused;
  } catch (const Json::exception &failure) {
    std::string_view why = failure.what ();
    why.remove_prefix (std::min (why.find ("] ") + 2, why.size ()));
    return Error{
        "it is no valid JSON: " + printable (why, 200), ErrorCode::parse};
  }
}

} // namespace codedexposure
