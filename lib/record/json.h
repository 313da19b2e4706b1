/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The JSON form of frame records; for source files of lib/ only. */
#pragma once

#include <string>

#include "base/json.h"
#include "record/frame_record.h"

namespace codedexposure
{

OrderedJson record_json (const FrameRecord &record);
/** Skips keys that it does not know. Throws Error. */
FrameRecord read_record (const Json &object);

/** @p value as @p digits hexadecimal digits, and back. */
std::string hex_text (std::uint64_t value, int digits);
/** Throws Error unless @p value is a text of exactly @p digits digits. */
std::uint64_t read_hex (const Json &value, const std::string &key, int digits);

} // namespace codedexposure
