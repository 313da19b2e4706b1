/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/checks.h"

#include <algorithm>
#include <set>

#include "base/text.h"

namespace codedexposure
{

StillMask
lit (int first, int count)
{
  return {.name = "light",
      .on = [] (int, int) { return true; },
      .slots = count,
      .first = first};
}

StillMask
no_light ()
{
  return {.name = "no light", .on = [] (int, int) { return false; }};
}

Result<StillMask>
Rig::mask_for_second (const StillMask &mask, int slots)
{
  if (slots != 1)
    return Error{"a second camera cannot see a mask in one of " +
                 std::to_string (slots) +
                 " slots, as it gets light in the others; show it for the "
                 "whole frame period"};
  return mask.complement ();
}

Result<std::vector<SeenFrame>>
look (Examination &examination, const StillMask &mask, int slots, int frames)
{
  RETURN_IF_ERROR (examination.rig.show (mask, slots));
  RETURN_IF_ERROR (examination.rig.watch (examination.lag));
  return examination.rig.watch (frames);
}

Result<int>
watch_each (Rig &rig, int frames, const std::function<void (SeenFrame &)> &take)
{
  constexpr double kAtOnce = 32e6; // pixels
  const Extent size = rig.parts ().camera.size;
  const int most = std::max (1, int (kAtOnce / size.width / size.height));
  int came = 0;
  while (came < frames) {
    ASSIGN_OR_RETURN (auto some, rig.watch (std::min (most, frames - came)));
    if (some.empty ())
      break;
    came += int (some.size ());
    for (SeenFrame &frame : some)
      take (frame);
  }
  return came;
}

const std::vector<Check> &
all_checks ()
{
  static const std::vector<Check> checks = {
      {"parts", "Parts", {}, check_parts},
      {"trigger", "Trigger and exposure", {"parts"}, check_trigger},
      {"light", "Light", {"trigger"}, check_light},
      {"sensor", "Sensor", {"trigger", "light"}, check_sensor},
      {"mirrors", "Mirrors", {"trigger", "light"}, check_mirrors},
      {"optics", "Optics", {"trigger", "light"}, check_optics},
      {"second", "Second camera", {"trigger", "light", "optics"}, check_second,
          true},
      {"whole", "Recording", {"trigger"}, check_whole},
  };
  return checks;
}

namespace
{

const Check *
find_check (std::string_view name)
{
  const auto found = std::ranges::find (all_checks (), name, &Check::name);
  return found == all_checks ().end () ? nullptr : &*found;
}

void
choose (const Check &check, std::set<std::string> &chosen)
{
  chosen.insert (check.name);
  for (const std::string &needed : check.needs)
    choose (*find_check (needed), chosen);
}

bool
has_failed (const std::string &name, const std::vector<Finding> &findings)
{
  return std::ranges::any_of (findings, [&name] (const Finding &finding) {
    return finding.check == name &&
           (finding.skipped || finding.verdict () == Verdict::fail);
  });
}

} // namespace

Result<std::vector<Check>>
choose_checks (std::string_view only, bool two)
{
  std::set<std::string> chosen;
  if (only.empty ())
    for (const Check &check : all_checks ())
      if (two || !check.of_two)
        chosen.insert (check.name);
  for (const std::string_view name :
      only.empty () ? std::vector<std::string_view> () : split (only, ',')) {
    const Check *check = find_check (name);
    if (!check) {
      std::string known;
      for (const Check &each : all_checks ())
        known += (known.empty () ? "" : ", ") + each.name;
      return Error{in_quotes (name) + " is no check; choose from " + known};
    }
    if (check->of_two && !two)
      return Error{in_quotes (name) +
                   " is a check of a second camera, and there is none; set "
                   "--second, or leave it out"};
    choose (*check, chosen);
  }
  std::vector<Check> checks;
  for (const Check &check : all_checks ())
    if (chosen.contains (check.name))
      checks.push_back (check);
  return checks;
}

Result<Finding>
run_check (const Check &check, Examination &examination,
    const std::vector<Finding> &before)
{
  const auto failed = [&before] (const std::string &name) {
    return has_failed (name, before);
  };
  if (std::ranges::any_of (check.needs, failed))
    return Finding{.check = check.name, .shown = {}, .skipped = true};
  const Nanoseconds begin = examination.rig.now ();
  auto finding = check.run (examination);
  if (finding)
    finding->seconds = 1e-9 * double (examination.rig.now () - begin);
  return finding;
}

} // namespace codedexposure
