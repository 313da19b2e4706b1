/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "schedule/stream_setup.h"

#include "schedule/json_forms.h"

namespace cexp
{

Result<StreamSetup>
StreamSetup::from_json (std::string_view json)
{
  const std::string what = "schedule JSON: ";
  const std::size_t most = Schedule::kMaxJsonSize + Mapping::kMaxJsonSize;
  if (json.size () > most)
    return Error{what + "more than " + std::to_string (most) +
                 " bytes; no schedule with a mapping is that long"};
  auto root = parse_strictly (json, "schedule");
  if (!root)
    return Error{what + root.error ().message};

  std::optional<Mapping> mapping;
  if (root->is_object () && root->contains ("mapping")) {
    auto read = read_mapping ((*root)["mapping"]);
    if (!read)
      return Error{what + "in key 'mapping': " + read.error ().message};
    mapping = std::move (*read);
    root->erase ("mapping");
  }
  auto schedule = read_schedule (*root);
  if (!schedule)
    return Error{what + schedule.error ().message};
  return StreamSetup{std::move (*schedule), std::move (mapping)};
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

} // namespace cexp
