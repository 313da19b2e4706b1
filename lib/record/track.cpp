/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/track.h"

#include <array>
#include <filesystem>
#include <utility>

#include <xxhash.h>

#include "base/text.h"
#include "record/json.h"

namespace codedexposure
{

namespace
{

constexpr std::string_view kCheckKey = ",\"check\":\"";
constexpr int kCheckDigits = 16, kSetupDigits = 16;

std::uint64_t
check_of (std::string_view text)
{
  return XXH3_64bits (text.data (), text.size ());
}

/* Both occur only inside of JSON's texts, where an escape stands for them. */
std::string
without_markup (std::string_view json)
{
  std::string text;
  for (const char c : json) {
    if (c == '<')
      text += "\\u003c";
    else if (c == '&')
      text += "\\u0026";
    else
      text += c;
  }
  return text;
}

/* The text that the check at the end of @line covers. Throws if the check is
 * missing or differs. */
std::string_view
checked_part (std::string_view line)
{
  const std::size_t at = line.rfind (kCheckKey);
  if (at == line.npos)
    throw Error{
        "it has no check at its end, so it may be damaged", ErrorCode::parse};
  const std::string tail =
      std::string (kCheckKey) +
      hex_text (check_of (line.substr (0, at)), kCheckDigits) + "\"}";
  if (line.substr (at) != tail)
    throw Error{
        "its check differs, so it is damaged: " + in_quotes (line.substr (at)) +
            " in place of " + in_quotes (tail),
        ErrorCode::parse};
  return line.substr (0, at);
}

TrackLine
read_line (const Json &root)
{
  TrackLine line;
  if (const auto end = root.find ("end"); end != root.end ()) {
    if (!end->is_number_unsigned ())
      throw expected ("end", "a number of frames", *end);
    line.end = end->get<std::uint64_t> ();
  }
  if (root.contains ("frame"))
    line.frame = read_record (root);
  if (const auto id = root.find ("setup_id"); id != root.end ())
    line.setup_id = read_hex (*id, "setup_id", kSetupDigits);
  if (const auto setup = root.find ("setup"); setup != root.end ())
    line.setup = or_throw (StreamSetup::from_json (json_text (*setup)));
  return line;
}

} // namespace

std::string
TrackLine::to_json () const
{
  OrderedJson line = OrderedJson::object ();
  if (frame)
    line = record_json (*frame);
  if (end)
    line["end"] = *end;
  if (setup_id)
    line["setup_id"] = hex_text (*setup_id, kSetupDigits);
  if (setup)
    line["setup"] = json_value (setup->to_json ());
  std::string text = without_markup (json_text (line));
  text.pop_back ();
  const std::string check = hex_text (check_of (text), kCheckDigits);
  return text + std::string (kCheckKey) + check + "\"}";
}

Result<TrackLine>
TrackLine::from_json (std::string_view text)
{
  while (!text.empty () && (text.back () == '\0' || text.back () == '\n'))
    text.remove_suffix (1);
  try {
    const auto part = checked_part (text);
    return read_json<TrackLine> (
        std::string (part) + "}", "track", kMaxSize, read_line);
  } catch (const Error &refused) {
    return refused.with_prefix ("line of the track: ");
  }
}

std::uint64_t
id_of (const StreamSetup &setup)
{
  StreamSetup named = setup;
  named.track = false;
  return check_of (named.to_json ());
}

std::string
sidecar_of (const std::string &recording)
{
  return std::filesystem::path (recording).replace_extension (".jsonl");
}

std::string
unescape_markup (std::string_view text)
{
  static constexpr std::array<std::pair<std::string_view, char>, 6> kEntities{
      {{"&quot;", '"'}, {"&apos;", '\''}, {"&#39;", '\''}, {"&lt;", '<'},
          {"&gt;", '>'}, {"&amp;", '&'}}};
  std::string plain;
  plain.reserve (text.size ());
  while (!text.empty ()) {
    char next = text.front ();
    std::size_t length = 1;
    if (next == '&')
      for (const auto &[entity, meaning] : kEntities)
        if (text.substr (0, entity.size ()) == entity) {
          next = meaning;
          length = entity.size ();
        }
    plain += next;
    text.remove_prefix (length);
  }
  return plain;
}

} // namespace codedexposure
