/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* JSON of unknown origin, read strictly; for the sources of lib/ only. */
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.h"

namespace cexp
{

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

/** @p value as text for a message. */
std::string shown (const Json &value);

/** That key @p key must be @p rule, and is @p value. */
Error expected (
    const std::string &key, const std::string &rule, const Json &value);

/** Error unless @p root begins a text of this format and version. They are
 * looked at first, so that a text of another kind is named as such and not by
 * the first key that is strange here. @p what, such as "schedule", is for the
 * message. */
Result<void> check_head (const Json &root, std::string_view format, int version,
    const std::string &what);

/** Error for a key of @p object that is not @p known; @p where, such as " in
 * tile", is for the message. */
Result<void> check_keys (const Json &object, const std::string &where,
    std::initializer_list<std::string_view> known);

/** A whole number from 0 to @p highest, written without a fraction. */
Result<std::int64_t> read_integer (
    const Json &value, const std::string &key, std::int64_t highest);
Result<std::vector<int>> read_integers (
    const Json &value, const std::string &key, int highest);

/** Finite numbers, @p count of them. */
Result<std::vector<double>> read_reals (
    const Json &value, const std::string &key, std::size_t count);

/**
 * One JSON text. Refused is what the parser would let pass: a key that stands
 * twice in one object, because readers disagree on which one counts; deeper
 * nesting than any text of this project has, because it is walked recursively
 * later; and a zero byte. @p what, such as "schedule", is for the message.
 */
Result<Json> parse_strictly (std::string_view text, const std::string &what);

} // namespace cexp
