/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure doctor: examines a bench, one check after the other. */
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>

#include <malloc.h>
#include <poll.h>
#include <unistd.h>

#include "base/file.h"
#include "bench/simulated_rig.h"
#include "command.h"
#include "doctor/checks.h"
#include "options/board.h"
#include "options/common.h"
#include "options/source.h"
#include "pages/doctor_page.h"
#include "pages/folder.h"
#include "pipeline/codec_choice.h"
#include "pipeline/messages.h"
#include "pipeline/program.h"
#include "rig/camera_rig.h"

namespace codedexposure::app
{

namespace
{

class Doctor
{
public:
  void declare (Options &options)
  {
    options.heading ("");
    options.value ("--output", output_, "FOLDER",
        "folder of the page and the profile [bench]", any_text ());
    options.value ("--seconds", seconds_, "S",
        "duration of the recording in the last check [60]", seconds (true));
    options.value ("--only", only_, "CHECKS",
        "only these, separated by commas, and those that they need: parts, "
        "trigger, light, sensor, mirrors, optics, second, whole");
    options.value ("--faults", faults_, "\"...\"",
        "faults of the simulated bench, such as \"leak=0.02 "
        "flicker=100:0.05\"; --faults help lists them");
    options.flag ("--second", second_,
        "also a camera in the beam of the mirrors that are off");
    options.value ("--second-camera", beside_.camera, "NAME",
        "that camera, beside --camera");
    options.flag ("--yes", yes_,
        "ask nothing: every question is answered with Enter, and a failed "
        "check is not repeated");
    source_.declare (options, SourceOptions::Kind::examined);
    run_.declare_result (options);
    options.exclude ({"--faults"}, "--camera");
    options.need ({"--second-camera"}, "--second");
    options.need ({"--second-camera"}, "--camera");
  }

  Exit run ()
  {
    if (faults_ == "help") {
      std::printf (
          "Faults of the simulated bench:\n%s", fault_help ().c_str ());
      return Exit::done;
    }
    /* Pictures go back to the system: in the heap, holes between large ones
     * stay for the whole run. */
    mallopt (M_MMAP_THRESHOLD, 1 << 20);
    stop_ = stop_at_signals ();
    if (second_)
      beside_.check (source_);
    auto checks = choose_checks (only_.value_or (""), second_);
    if (!checks)
      usage_error ("--only " + checks.error ().message);
    checks_ = *std::move (checks);
    if (seconds_ && std::ranges::none_of (checks_, [] (const Check &check) {
          return check.name == "whole";
        }))
      usage_error ("--seconds is for the check whole, which --only leaves out; "
                   "leave one of them out");
    start_gstreamer ();
    plan_ = SourcePlan::make (source_);
    folder_.emplace (output_, run_.force);
    examine ();
    write ();
    folder_.reset ();
    return result ();
  }

private:
  /* -------------------------------------------------------- the dialogue -- */

  bool asks () const
  {
    return !yes_ && !source_.is_simulated () && isatty (STDIN_FILENO) != 0;
  }

  /* For people; standard output may be for JSON. */
  void say (const std::string &line) const
  {
    std::FILE *to = run_.json ? stderr : stdout;
    std::fprintf (to, "%s\n", line.c_str ());
    std::fflush (to);
  }

  /* The first character of the answer, in lower case; 0: Enter. */
  char ask (const std::string &question) const
  {
    std::fprintf (stderr, "%s ", question.c_str ());
    std::string answer;
    pollfd input{STDIN_FILENO, POLLIN, 0};
    while (!stop_.stop_requested ())
      if (poll (&input, 1, 50) > 0) {
        if (!std::getline (std::cin, answer))
          return 'q';
        return answer.empty () ? '\0' : g_ascii_tolower (answer[0]);
      }
    return 'q';
  }

  void check_stop (bool stop) const
  {
    if (stop || stop_.stop_requested ())
      fail ("stopped; the mirrors are parked", Exit::interrupted);
  }

  void tell (const Finding &finding) const
  {
    const auto check = std::ranges::find (checks_, finding.check, &Check::name);
    const std::string line = format ("%d. %-22s ",
        int (check - checks_.begin ()) + 1, title_of (finding.check).c_str ());
    if (finding.skipped)
      return say (line + "SKIPPED: a check before it failed");
    say (line + verdict_text (finding.verdict ()) +
         format (" (%.0f s)", finding.seconds));
    say ("   shown: " + finding.shown);
    for (const auto &[name, text] : finding.notes)
      say ("   " + name + ": " + text);
    for (const Reading &reading : finding.readings)
      say ("   " + reading.name + ": " + reading_text (reading) +
           (reading.rule.empty () ? "" : " (" + reading.rule + ")"));
    for (const Diagnosis &diagnosis : finding.diagnoses) {
      say (format ("   %s %s: ", verdict_text (diagnosis.severity),
               diagnosis.id.c_str ()) +
           diagnosis.cause + ".");
      say ("        try next: " + diagnosis.remedy + ".");
    }
  }

  /* ---------------------------------------------------------- the checks -- */

  /* Without a value, @missing is what was found instead. */
  Result<std::unique_ptr<Rig>> open_bench (Finding &missing)
  {
    if (source_.is_simulated ()) {
      const std::uint64_t seed = source_.seed.value_or (1);
      SickBenchOptions options =
          random_healthy_bench (seed, {.rate = plan_.frame_rate});
      if (plan_.bench) {
        options = {.rate = plan_.frame_rate, .seed = seed};
        replay (options, *plan_.bench);
      }
      if (second_) {
        options.second = {random_second_camera (options)};
        if (source_.bench)
          replay (options.second.front (),
              bench_of ("--bench", *source_.bench).of_beam (true));
      }
      value_of (inflict (options, faults_.value_or ("")), Exit::usage);
      slow_disk_ = options.has ("slow-disk");
      auto rig = SimulatedRig::make (options);
      if (rig)
        return std::unique_ptr<Rig> (*std::move (rig));
      if (rig.error ().code == ErrorCode::invalid_argument)
        throw Failure{Exit::usage, rig.error ()}; // no bench has such numbers
      missing = part_missing (rig.error (), options.has ("camera-missing"));
      return rig.error ();
    }
    slow_disk_ = std::getenv ("CODEDEXPOSURE_SLOW_DISK") != nullptr;
    source_.device = source_.device.value_or ("usb:");
    source_.pixel_format = plan_.pixel_format; // not what the camera had before
    auto dmd = open_dmd (*source_.device);
    if (!dmd) {
      missing = part_missing (dmd.error (), false);
      return dmd.error ();
    }
    CameraRigOptions options{source_, plan_, folder_->path ("recording.mkv")};
    if (second_)
      options.second = beside_.options (source_);
    auto rig = open_camera_rig (options, *std::move (dmd), stop_);
    if (!rig)
      missing = part_missing (rig.error (), true);
    return rig;
  }

  HostFacts host_facts () const
  {
    constexpr double kSlowDisk = 1e5; // bytes/s
    HostFacts host;
    host.disk_rate = Measured{
        slow_disk_ ? kSlowDisk : disk_speed (folder_->path ("index.html")),
        0.0};
    if (const auto text = read_file ("/proc/sys/net/core/rmem_max", 64))
      host.socket_buffer = std::atof (text->c_str ());
    return host;
  }

  void examine ()
  {
    Finding missing;
    const auto rig = open_bench (missing);
    if (!rig) {
      check_stop (rig.error ().code == ErrorCode::cancelled);
      findings_.push_back (missing);
      return tell (missing);
    }
    parts_ = (*rig)->parts ();
    Examination examination{**rig, host_facts ()};
    examination.schedule = plan_.schedule;
    examination.recording = seconds_.value_or (60);
    if (asks ())
      check_stop (ask ("Place a plain, bright target before the bench; nothing "
                       "may move. Then press Enter (q: end).") == 'q');
    for (const Check &check : checks_) {
      check_stop (false);
      findings_.push_back (take (check, examination));
    }
    (*rig)->park ();
    examination.profile.measured = now_utc ();
    for (BenchProfile &other : examination.profile.second)
      other.measured = examination.profile.measured;
    if (worst () != Verdict::fail)
      profile_ = examination.profile;
  }

  /* One check, again after each correction of the user. */
  Finding take (const Check &check, Examination &examination) const
  {
    for (;;) {
      auto result = run_check (check, examination, findings_);
      check_stop (!result && result.error ().code == ErrorCode::cancelled);
      Finding finding{
          check.name, "nothing more: the check ended with an error"};
      if (result)
        finding = *std::move (result);
      else
        finding.blame ("error", result.error ().message, Verdict::fail,
            "correct that, and repeat the check");
      tell (finding);
      if (finding.skipped || finding.verdict () != Verdict::fail || !asks ())
        return finding;
      const char answer = ask ("   Correct it and press Enter to repeat the "
                               "check; c: continue; q: end.");
      check_stop (answer == 'q');
      if (answer == 'c')
        return finding;
    }
  }

  std::string profile_path () const { return folder_->name () + "/bench.json"; }

  /* ----------------------------------------------------------- the files -- */

  std::vector<std::string> next_commands () const
  {
    if (!profile_)
      return {};
    const std::string bench = " --bench " + profile_path ();
    const std::string second =
        !second_         ? ""
        : beside_.camera ? " --both --second-camera \"" + *beside_.camera + "\""
                         : " --both";
    const std::string record =
        source_.is_simulated ()
            ? (second_ ? "record" : "simulate") + second + " --scene pour" +
                  bench + " --frames 50"
            : "record --camera \"" + *source_.camera + "\"" + second +
                  " --device " + *source_.device + " --schedule " +
                  source_.schedule_text () + bench;
    return {"codedexposure " + record + " --output coded.mkv",
        "codedexposure decode coded.mkv --fuse best --output fused.mkv"};
  }

  DoctorPage page () const
  {
    DoctorPage page;
    page.simulated = source_.is_simulated ();
    page.head = {{"Result", verdict_text (worst ())},
        {"Examined", utc_text (now_utc ())}};
    if (parts_) {
      page.head.emplace_back ("Camera", source_.camera.value_or ("simulated"));
      if (second_)
        page.head.emplace_back (
            "Second camera", beside_.camera.value_or ("simulated"));
      page.head.emplace_back ("DMD", parts_->dmd.name);
      page.head.emplace_back (
          "Frame rate", format ("%.6g frames/s", 1 / parts_->period ()));
    }
    page.head.emplace_back ("Made by", "doctor of codedexposure " VERSION);
    page.findings = findings_;
    if (profile_)
      page.profile = profile_->rows ();
    page.next = next_commands ();
    return page;
  }

  void write ()
  {
    folder_->write ("index.html", page ().html ());
    if (profile_)
      value_of (profile_->save (folder_->path ("bench.json")));
    folder_->publish ();
    say ("page: " + folder_->name () + "/index.html");
    const std::string profile = profile_path ();
    std::error_code ignored;
    if (profile_)
      say ("bench profile: " + profile);
    else
      say ("no bench profile, since a check failed" +
           (std::filesystem::exists (profile, ignored)
                   ? "; " + profile + " is that of an earlier run"
                   : ""));
  }

  /* ------------------------------------------------------------------------ */

  Verdict worst () const
  {
    Verdict worst = Verdict::pass;
    for (const Finding &finding : findings_)
      worst = std::max (worst, finding.verdict ());
    return worst;
  }

  Exit result () const
  {
    if (run_.json)
      std::printf ("%s\n", findings_json (findings_).c_str ());
    say (std::string ("result: ") + verdict_text (worst ()));
    if (worst () == Verdict::fail)
      return Exit::failed;
    if (std::ranges::all_of (findings_, &Finding::is_known))
      return Exit::done;
    say ("not all is known: see what is UNKNOWN or was not measured");
    return Exit::not_known;
  }

  SourceOptions source_;
  RunOptions run_;
  std::optional<Text> only_, faults_;
  std::string output_ = "bench";
  std::optional<double> seconds_;
  bool yes_ = false, second_ = false;
  SecondCamera beside_;

  SourcePlan plan_;
  std::stop_token stop_;
  std::optional<PageFolder> folder_;
  bool slow_disk_ = false; // as a fault of an emulated bench
  std::vector<Check> checks_;
  std::vector<Finding> findings_;
  std::optional<BenchProfile> profile_;
  std::optional<RigParts> parts_;
};

} // namespace

Command
doctor_command ()
{
  return make_command<Doctor> ({.name = "doctor",
      .summary = "examine a bench, and measure its numbers",
      .usage = "[option...]",
      .description = R"(
Examines a bench, one check after the other: it shows masks on the DMD, looks at
them with the camera, and says what it saw, whether that is good (PASS, WARN,
FAIL or UNKNOWN), what is the most likely cause of a fault, and what to try
next. Writes a page with all figures, FOLDER/index.html, and, unless a check
failed, the bench profile FOLDER/bench.json, which the other commands can use.
Takes less than three minutes at 25 frames/s. docs/doctor.md explains the
checks.

Place a plain, bright target before the bench; nothing may move. Ctrl-C ends it
and parks the mirrors. Without --camera, it examines a simulated bench.
)",
      .notes = R"(
Exit status: 0 all is good, or worth a warning; 1 a check failed, or could not
be made; 2 wrong usage; 4 none failed, but not all is known, be it beside a
warning; 130 stopped.

Examples:
  A camera and a DMD on the USB:
    codedexposure doctor --camera "Allied Vision-0123456789" \
      --device usb: --output bench
  Only the trigger, after a cable was changed, without questions:
    codedexposure doctor --camera "Allied Vision-0123456789" \
      --device usb: --only trigger --yes --force
  A simulated bench, whose numbers are drawn by a seed:
    codedexposure doctor --seed 7 --output simulated
)"});
}

} // namespace codedexposure::app
