/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/fault_plan.h"

#include <algorithm>
#include <iterator>

#include "base/text.h"

namespace codedexposure
{

namespace
{

constexpr int kMaxFrames = 1'000'000;

struct Named {
  const char *name;
  Fault::Kind kind;
  bool counts; // MORE is a number of frames
};

constexpr Named kKinds[] = {
    {"lose", Fault::Kind::lose, true},
    {"incomplete", Fault::Kind::incomplete, true},
    {"delay", Fault::Kind::delay, false},
    {"duplicate", Fault::Kind::duplicate, false},
    {"late", Fault::Kind::late, false},
    {"stop", Fault::Kind::stop, false},
};

Error
bad_word (std::string_view word)
{
  return Error{"fault " + in_quotes (word) +
               " is not KIND@FRAME[:MORE], such as lose@10:3, incomplete@10, "
               "delay@10:5ms, duplicate@10, late@10 or stop@now"};
}

/* A word: the fault and its frames. */
struct Word {
  Fault fault;
  std::uint64_t first = 0;
  int frames = 1;
};

Result<Word>
parse_word (std::string_view text, std::uint64_t now)
{
  const auto at = text.find ('@');
  const auto colon = text.find (':', at == text.npos ? 0 : at);
  if (at == text.npos)
    return bad_word (text);
  const std::string_view frame = text.substr (at + 1, colon - at - 1);
  const bool more = colon != text.npos;
  const std::string_view rest = more ? text.substr (colon + 1) : "";

  for (const Named &kind : kKinds) {
    if (text.substr (0, at) != kind.name)
      continue;
    Word word;
    word.fault.kind = kind.kind;
    const auto number = parse_int (frame);
    if (frame != "now" && (!number || *number < 0))
      return bad_word (text);
    word.first = frame == "now" ? now : std::uint64_t (*number);
    if (kind.kind == Fault::Kind::delay) {
      const Result<Nanoseconds> time = parse_time (rest);
      if (!time)
        return bad_word (text);
      word.fault.delay = *time;
    } else if (more) {
      const auto frames = parse_int (rest);
      if (!kind.counts || !frames || *frames < 1 || *frames > kMaxFrames)
        return bad_word (text);
      word.frames = *frames;
    }
    return word;
  }
  return bad_word (text);
}

} // namespace

const char *
fault_text (Fault::Kind kind)
{
  const auto *named = std::ranges::find (kKinds, kind, &Named::kind);
  return named == std::end (kKinds) ? "sent" : named->name;
}

Result<void>
FaultPlan::add (std::string_view text, std::uint64_t now)
{
  std::map<std::uint64_t, Fault> faults;
  for (const std::string_view piece : split (text, ' ')) {
    if (piece.empty ())
      continue;
    const Result<Word> word = parse_word (piece, now);
    if (!word)
      return word.error ();
    for (int k = 0; k < word->frames; k++)
      if (!faults.emplace (word->first + std::uint64_t (k), word->fault).second)
        return Error{"fault " + in_quotes (piece) +
                     " befalls a frame that already has one; choose other "
                     "frames, or leave one of them out"};
  }
  faults.merge (faults_);
  faults_ = std::move (faults);
  return {};
}

Fault
FaultPlan::at (std::uint64_t frame) const
{
  const auto found = faults_.find (frame);
  return found == faults_.end () ? Fault{} : found->second;
}

} // namespace codedexposure
