/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "mapping/stream_setup.h"

#include "schedule/json_forms.h"

namespace codedexposure
{

Result<StreamSetup>
StreamSetup::from_json (std::string_view json)
try {
  const std::string what = "schedule JSON: ";
  const std::size_t most = Schedule::kMaxJsonSize + Mapping::kMaxJsonSize;
  if (json.size () > most)
    return Error{what + "more than " + std::to_string (most) +
                     " bytes; no schedule with a mapping is that long",
        ErrorCode::parse};
  auto root = parse_strictly (json, "schedule");
  if (!root)
    return root.error ().with_prefix (what);

  std::optional<Mapping> mapping;
  if (root->is_object () && root->contains ("mapping")) {
    auto read = read_mapping ((*root)["mapping"]);
    if (!read)
      return read.error ().with_prefix (what + "in key 'mapping': ");
    mapping = std::move (*read);
    root->erase ("mapping");
  }
  auto schedule = read_schedule (*root);
  if (!schedule)
    return schedule.error ().with_prefix (what);
  return StreamSetup{std::move (*schedule), std::move (mapping)};
} catch (const std::bad_alloc &) {
  return out_of_memory ();
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
