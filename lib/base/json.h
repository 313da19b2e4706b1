/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Reads JSON of unknown origin strictly; for source files of lib/ only. */
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.h"

namespace codedexposure
{

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

/** @p value as text for a message. */
std::string shown (const Json &value);

/** "key KEY must be RULE, not VALUE". */
Error expected (
    const std::string &key, const std::string &rule, const Json &value);

/** Error unless @p root has this format and version. Call it before check_keys
 * (), so that the message for a text of another kind names its kind and not its
 * first unknown key. @p what, such as "schedule", is for the message. */
Result<void> check_head (const Json &root, std::string_view format, int version,
    const std::string &what);

/** Error for the first key of @p object that is not @p known; @p where, such as
 * " in tile", is for the message. */
Result<void> check_keys (const Json &object, const std::string &where,
    std::initializer_list<std::string_view> known);

/** Integers from 0 to @p highest, written without a fraction. */
Result<std::int64_t> read_integer (
    const Json &value, const std::string &key, std::int64_t highest);
Result<std::vector<int>> read_integers (
    const Json &value, const std::string &key, int highest);

/** Finite numbers, @p count of them. */
Result<std::vector<double>> read_reals (
    const Json &value, const std::string &key, std::size_t count);

/**
 * Parses one JSON text. Also refuses what the parser would accept: a key that
 * an object has twice, because readers disagree on which one counts; nesting
 * deeper than any text of this project has, because recursive functions read
 * it; and a zero byte. @p what, such as "schedule", is for the message.
 */
Result<Json> parse_strictly (std::string_view text, const std::string &what);

} // namespace codedexposure
