/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/json.h"

#include <algorithm>
#include <optional>
#include <set>

namespace codedexposure
{

namespace
{

std::string
shown (const Json &value)
{
  return printable (value.dump ());
}

[[noreturn]] void
refuse (const std::string &message)
{
  throw Error{message, ErrorCode::parse};
}

/* Before the keys are checked: the message for a text of another kind names its
 * kind and not its first unknown key. */
void
check_head (const Json &root, const JsonHead &head)
{
  const std::string form = "; a " + head.what + " begins with {\"format\":\"" +
                           std::string (head.format) +
                           "\",\"version\":" + std::to_string (head.version) +
                           ",...";
  if (!root.is_object ())
    refuse ("it must be an object, not " + shown (root) + form);
  for (const char *key : {"format", "version"})
    if (!root.contains (key))
      refuse ("key '" + std::string (key) + "' is missing" + form);
  if (root["format"] != head.format)
    refuse ("format " + shown (root["format"]) + " is not known" + form);
  if (!root["version"].is_number_integer () || root["version"] != head.version)
    refuse ("version " + shown (root["version"]) +
            " is not known; this program reads version " +
            std::to_string (head.version));
}

std::int64_t
integer (const Json &value, const std::string &key, std::int64_t highest,
    int lowest = 0)
{
  const bool fits =
      value.is_number_unsigned ()
          ? value.get<std::uint64_t> () >= std::uint64_t (lowest) &&
                value.get<std::uint64_t> () <= std::uint64_t (highest)
          : value.is_number_integer () && value.get<std::int64_t> () == 0 &&
                lowest == 0;
  if (!fits)
    throw expected (key,
        "a whole number from " + std::to_string (lowest) + " to " +
            std::to_string (highest),
        value);
  return value.get<std::int64_t> ();
}

std::string
entry_of (const std::string &key, std::size_t i)
{
  return key + "[" + std::to_string (i) + "]";
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
        refuse ("brackets nest deeper than " + std::to_string (kMaxDepth) +
                " levels; no " + *what_ + " does");
      keys_.resize (std::size_t (depth) + 1);
      keys_.back ().clear ();
    } else if (event == Event::key) {
      const auto &key = parsed.get_ref<const std::string &> ();
      if (!keys_[std::size_t (depth) - 1].insert (key).second)
        refuse ("key " + in_quotes (key) + " stands twice; leave one out");
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

Error
expected (const std::string &key, const std::string &rule, const Json &value)
{
  return {"key '" + key + "' must be " + rule + ", not " + shown (value),
      ErrorCode::parse};
}

void
read_keys (const Json &object, const std::string &name,
    const std::string &needs, const JsonKeys &keys)
{
  if (!object.is_object ()) {
    if (name.empty ())
      refuse ("it must be an object, not " + shown (object) + "; " + needs);
    throw expected (name, "an object", object);
  }
  for (const auto &item : object.items ()) {
    if (std::ranges::find (keys, item.key (), &JsonKey::name) != keys.end ())
      continue;
    std::string names;
    for (const JsonKey &key : keys)
      names += (names.empty () ? "" : ", ") + std::string (key.name);
    refuse ("there is no key " + in_quotes (item.key ()) +
            (name.empty () ? "" : " in " + name) + "; the keys are " + names);
  }
  const std::string prefix = name.empty () ? "" : name + ".";
  for (const JsonKey &key : keys)
    if (key.needed && !object.contains (key.name))
      refuse (
          "key '" + prefix + std::string (key.name) + "' is missing; " + needs);
  for (const auto &[key, read, needed] : keys)
    if (const auto at = object.find (key); read && at != object.end ())
      read (*at, prefix + std::string (key));
}

void
read_versioned (const Json &root, const JsonHead &head,
    const std::string &needs, JsonKeys keys)
{
  check_head (root, head);
  keys.insert (keys.begin (), {{"format", {}}, {"version", {}}});
  read_keys (root, "", needs, keys);
}

JsonReader
integers_into (std::vector<int *> to, int highest, const std::string &rule)
{
  return [=] (const Json &value, const std::string &key) {
    std::vector<int> numbers;
    integers_into (numbers, highest) (value, key);
    if (numbers.size () != to.size ())
      throw expected (key, rule, value);
    for (std::size_t i = 0; i < to.size (); i++)
      *to[i] = numbers[i];
  };
}

JsonReader
integers_into (std::vector<int> &to, int highest)
{
  return [&to, highest] (const Json &value, const std::string &key) {
    if (!value.is_array ())
      throw expected (key, "a list of whole numbers", value);
    to.clear ();
    for (const Json &entry : value)
      to.push_back (int (integer (entry, entry_of (key, to.size ()), highest)));
  };
}

JsonReader
integer_into (std::int64_t &to, std::int64_t highest)
{
  return [&to, highest] (const Json &value, const std::string &key) {
    to = integer (value, key, highest);
  };
}

JsonReader
integer_into (int &to, int highest, int lowest)
{
  return [&to, highest, lowest] (const Json &value, const std::string &key) {
    to = int (integer (value, key, highest, lowest));
  };
}

JsonReader
numbers_into (std::span<double> to)
{
  return [to] (const Json &value, const std::string &key) {
    if (!value.is_array () || value.size () != to.size ())
      throw expected (
          key, std::to_string (to.size ()) + " numbers in a list", value);
    for (std::size_t i = 0; i < to.size (); i++)
      number_into (to[i], "a number") (value[i], entry_of (key, i));
  };
}

JsonReader
number_into (double &to, const std::string &rule)
{
  return [&to, rule] (const Json &value, const std::string &key) {
    if (!value.is_number ())
      throw expected (key, rule, value);
    to = value.get<double> ();
  };
}

JsonReader
text_into (std::string &to)
{
  return [&to] (const Json &value, const std::string &key) {
    if (!value.is_string ())
      throw expected (key, "a text", value);
    to = value.get<std::string> ();
  };
}

JsonReader
flag_into (bool &to)
{
  return [&to] (const Json &value, const std::string &key) {
    if (!value.is_boolean ())
      throw expected (key, "true or false", value);
    to = value.get<bool> ();
  };
}

JsonReader
size_into (Extent &to, int highest)
{
  return integers_into (
      {&to.width, &to.height}, highest, "two whole numbers, width and height");
}

std::string
json_text (const Json &value)
{
  return value.dump (-1, ' ', false, Json::error_handler_t::replace);
}

std::string
json_text (const OrderedJson &value)
{
  return value.dump (-1, ' ', false, OrderedJson::error_handler_t::replace);
}

OrderedJson
json_value (std::string_view text)
{
  return OrderedJson::parse (text);
}

Json
parse_strictly (std::string_view text, const std::string &what)
{
  if (text.find_first_not_of (" \t\r\n") == text.npos)
    refuse ("it is empty");
  /* The parser takes a zero byte for the end and ignores what follows. */
  if (const std::size_t zero = text.find ('\0'); zero != text.npos)
    refuse ("it is no valid JSON: a zero byte at " + std::to_string (zero) +
            "; remove it and what follows");
  try {
    return Json::parse (text, Watch (what));
  } catch (const Json::exception &failure) {
    std::string_view why = failure.what ();
    why.remove_prefix (std::min (why.find ("] ") + 2, why.size ()));
    refuse ("it is no valid JSON: " + printable (why, 200));
  }
}

} // namespace codedexposure
