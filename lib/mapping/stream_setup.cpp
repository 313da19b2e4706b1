/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "mapping/stream_setup.h"

#include "mapping/json.h"
#include "schedule/json.h"

namespace codedexposure
{

namespace
{

StreamSetup
read_setup (Json root)
{
  std::optional<Mapping> mapping;
  if (root.is_object () && root.contains ("mapping")) {
    try {
      mapping = read_mapping (root["mapping"]);
    } catch (const Error &refused) {
      throw refused.with_prefix ("in key 'mapping': ");
    }
    root.erase ("mapping");
  }
  return {read_schedule (root), std::move (mapping)};
}

} // namespace

Result<StreamSetup>
StreamSetup::from_json (std::string_view json)
{
  return read_json<StreamSetup> (json, "schedule",
      Schedule::kMaxJsonSize + Mapping::kMaxJsonSize, read_setup);
}

std::string
StreamSetup::to_json () const
{
  std::string text = schedule.to_json ();
  if (mapping)
    text.replace (
        text.size () - 1, 1, ",\"mapping\":" + mapping->to_json () + "}");
  return text;
}

} // namespace codedexposure
