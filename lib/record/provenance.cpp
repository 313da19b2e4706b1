/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/provenance.h"

#include <limits>

#include "base/json.h"
#include "base/text.h"

namespace codedexposure
{

namespace
{

const JsonHead kHead{"provenance", "coded-exposure-decoded", 1};

Provenance
read_provenance (const Json &root)
{
  Provenance read;
  std::int64_t frame = 0;
  read_versioned (root, kHead,
      "a provenance needs format, version, setup, method, frame and slot",
      {{"setup",
           [&] (const Json &value, const std::string &) {
             read.setup = or_throw (StreamSetup::from_json (json_text (value)));
           },
           true},
          {"method", text_into (read.method), true},
          {"frame",
              integer_into (frame, std::numeric_limits<std::int64_t>::max ()),
              true},
          {"slot", integer_into (read.first_slot, 255), true}});
  read.first_frame = std::uint64_t (frame);
  return read;
}

} // namespace

std::string
Provenance::to_json () const
{
  OrderedJson root;
  root["format"] = kHead.format;
  root["version"] = kHead.version;
  root["method"] = method;
  root["frame"] = first_frame;
  root["slot"] = first_slot;
  root["setup"] = json_value (setup.to_json ());
  return json_text (root);
}

Result<Provenance>
Provenance::from_json (std::string_view json)
{
  return read_json<Provenance> (
      json, kHead.what, StreamSetup::kMaxJsonSize + 4096, read_provenance);
}

std::string
Provenance::text () const
{
  return setup.schedule.text () + " by " + printable (method);
}

} // namespace codedexposure
