/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads JSON of unknown origin strictly; for source files of lib/ only.
 *
 * What reads a value throws Error; read_json () turns that into a Result. */
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/geometry.h"
#include "base/result.h"
#include "base/text.h"

namespace codedexposure
{

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

/** The value of @p result. Throws its error. */
template <typename T>
T
or_throw (Result<T> result)
{
  if (!result)
    throw result.error ();
  return *std::move (result);
}

/** "key KEY must be RULE, not VALUE". */
Error expected (
    const std::string &key, const std::string &rule, const Json &value);

/** Takes a value; @p key names it in messages. */
using JsonReader =
    std::function<void (const Json &value, const std::string &key)>;

/** A key of an object. */
struct JsonKey {
  std::string_view name;
  JsonReader read;
  bool needed = false;
};
using JsonKeys = std::vector<JsonKey>;

/** Reads the keys of @p object in the order of @p keys. Throws where it is no
 * object or has a key that is not among them, or where a needed one is missing.
 * @p name   of the object, which stands before its keys in messages; empty: a
 *           whole text.
 * @p needs  what it needs, for the message: "a tile has a period and labels".
 */
void read_keys (const Json &object, const std::string &name,
    const std::string &needs, const JsonKeys &keys);

/** How a versioned text begins. */
struct JsonHead {
  std::string what; ///< "schedule"
  std::string_view format;
  int version;
};
/** read_keys () of a whole text with the keys "format" and "version", which
 * must have the values of @p head. */
void read_versioned (const Json &root, const JsonHead &head,
    const std::string &needs, JsonKeys keys);

/** Integers from 0 to @p highest, written without a fraction, as many as there
 * are in @p to. @p rule describes them: "two integers, x and y". */
JsonReader integers_into (
    std::vector<int *> to, int highest, const std::string &rule);
/** A list of any length. */
JsonReader integers_into (std::vector<int> &to, int highest);
JsonReader integer_into (std::int64_t &to, std::int64_t highest);
JsonReader integer_into (int &to, int highest, int lowest = 0);

/** Finite numbers, as many as there are in @p to. */
JsonReader numbers_into (std::span<double> to);
/** One. @p rule describes it: "a number of pixels". */
JsonReader number_into (double &to, const std::string &rule);

/** A text. */
JsonReader text_into (std::string &to);
JsonReader flag_into (bool &to);
/** Two whole numbers, width and height. */
JsonReader size_into (Extent &to, int highest);

/** A text of its own within another. */
template <typename T>
JsonReader
inner_into (std::optional<T> &to, T (*read) (const Json &))
{
  return [=, &to] (const Json &value, const std::string &key) {
    try {
      to = read (value);
    } catch (const Error &refused) {
      throw refused.with_prefix ("in key '" + key + "': ");
    }
  };
}

/** Parses one JSON text. Also refuses what the parser would accept: a key that
 * an object has twice, because readers disagree on which one is valid; nesting
 * deeper than any text of this project has, because recursive functions read
 * it; and a zero byte. @p what, such as "schedule", is for the message. */
Json parse_strictly (std::string_view text, const std::string &what);

/** @p value on one line; what is no UTF-8 in its texts becomes U+FFFD. Here and
 * in json_value (), so that the writer and the parser are compiled once. */
std::string json_text (const Json &value);
std::string json_text (const OrderedJson &value);

/** The value that json_text () or a to_json () wrote as @p text, as a part of
 * another. */
OrderedJson json_value (std::string_view text);

/** What @p read makes of the JSON text @p text of at most @p limit bytes.
 * @p what, such as "schedule", is for the message. */
template <typename T>
Result<T>
read_json (std::string_view text, const std::string &what, std::size_t limit,
    const std::function<T (Json root)> &read)
try {
  try {
    if (text.size () > limit)
      throw Error{"more than " + std::to_string (limit) + " bytes; no " + what +
                      " is that long",
          ErrorCode::parse};
    return read (parse_strictly (text, what));
  } catch (const Error &refused) {
    return refused.with_prefix (what + " JSON: ");
  }
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

/** What @p read makes of the file @p path of at most @p limit bytes. @p what,
 * such as "mapping file", names a file that cannot be read. */
template <typename T>
Result<T>
load_json (const std::string &path, const std::string &what, std::size_t limit,
    Result<T> (*read) (std::string_view json))
try {
  const auto text = read_file (path, limit);
  auto value = text ? read (*text) : Result<T> (text.error ());
  if (!value)
    return value.error ().with_prefix (
        (text ? "file" : what) + " " + in_quotes (path, 200) + ": ");
  return value;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

} // namespace codedexposure
