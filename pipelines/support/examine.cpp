/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-examine: the program of pipelines/doctor. Examines a bench, one
 * check after the other. */
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>

#include <csignal>
#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <gst/gst.h>

#include "base/file.h"
#include "base/text.h"
#include "base/try.h"
#include "bench/simulated_rig.h"
#include "camera_rig.h"
#include "dmd/dmd.h"
#include "doctor/checks.h"
#include "doctor_page.h"
#include "pipeline/messages.h"
#include "pipeline/status.h"

using namespace codedexposure;
using codedexposure::app::format;

namespace
{

enum ExitCode { kGood = 0, kBad = 1, kUsage = 2, kNotKnown = 4 };

constexpr std::size_t kBlock = std::size_t (8) << 20; // of the disk's test
constexpr std::size_t kMostWritten = std::size_t (512) << 20;
constexpr double kDiskSeconds = 1.5;
/* Of a bench with the fault slow-disk, bytes/s. */
constexpr double kSlowDisk = 1e5;
constexpr const char *kSlowDiskVariable = "CODEDEXPOSURE_SLOW_DISK";

struct Arguments {
  CameraRigOptions rig;
  std::string rate = "25", exposure, schedule = "sequential:2x2", only, output,
              style, what = "doctor", bench, faults, version;
  double seconds = 60;
  std::uint64_t seed = 1;
  bool json = false, yes = false;

  bool simulated () const { return rig.camera.empty (); }
  std::string profile_path () const { return output + "/bench.json"; }
  std::string page_path () const { return output + "/index.html"; }
};

/** Lines for people: the report on stdout, unless that is for JSON. */
class Voice
{
public:
  explicit Voice (const Arguments &arguments)
      : what_ (arguments.what), to_ (arguments.json ? stderr : stdout)
  {
  }

  void line (const std::string &text) const
  {
    std::fprintf (to_, "%s\n", text.c_str ());
    std::fflush (to_);
  }
  void trouble (const std::string &text) const
  {
    std::fprintf (stderr, "%s: %s\n", what_.c_str (), text.c_str ());
  }

private:
  std::string what_;
  std::FILE *to_;
};

/** SIGINT, SIGTERM and SIGHUP as a request to stop. Made before other threads,
 * which inherit that the signals are blocked. */
class Signals
{
public:
  Signals ()
  {
    sigemptyset (&set_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
      sigaddset (&set_, signal);
    pthread_sigmask (SIG_BLOCK, &set_, nullptr);
    thread_ = std::jthread ([this] (const std::stop_token &done) {
      const timespec moment{0, 50'000'000};
      while (!done.stop_requested ())
        if (sigtimedwait (&set_, nullptr, &moment) > 0)
          source_.request_stop ();
    });
  }

  std::stop_token token () const { return source_.get_token (); }

private:
  sigset_t set_;
  std::stop_source source_{};
  std::jthread thread_;
};

/* ------------------------------------------------------------ this machine --
 */

/** Bytes/s that a file in @p folder takes; none if it cannot be written. */
std::optional<Measured>
disk_rate (const std::string &folder)
{
  const std::string path = folder + "/speed.part";
  const int file = open (path.c_str (), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  if (file < 0)
    return std::nullopt;
  const std::vector<char> block (kBlock, 'x');
  const gint64 begin = g_get_monotonic_time ();
  const auto spent = [begin] {
    return double (g_get_monotonic_time () - begin) / 1e6;
  };
  std::size_t written = 0;
  while (written < kMostWritten && spent () < kDiskSeconds &&
         write (file, block.data (), kBlock) == ssize_t (kBlock))
    written += kBlock;
  fdatasync (file);
  close (file);
  const double rate = double (written) / spent ();
  unlink (path.c_str ());
  return Measured{rate, 0.0};
}

HostFacts
host_facts (const std::string &folder, bool slow_disk)
{
  HostFacts host;
  if (slow_disk)
    host.disk_rate = Measured{kSlowDisk, 0.0};
  else if (!folder.empty ())
    host.disk_rate = disk_rate (folder);
  if (const auto text = read_file ("/proc/sys/net/core/rmem_max", 64))
    host.socket_buffer = std::atof (text->c_str ());
  return host;
}

/* ------------------------------------------------------------- the bench -- */

/** The rig, or the finding that a part is missing. */
struct Opened {
  std::unique_ptr<Rig> rig;
  std::optional<Finding> missing;
  bool slow_disk = false; // as a fault
};

Result<Opened>
open_rig (const Arguments &arguments, const std::stop_token &stop)
{
  if (arguments.simulated ()) {
    SickBenchOptions options =
        random_healthy_bench (arguments.seed, {.rate = arguments.rig.rate});
    if (!arguments.bench.empty ()) {
      ASSIGN_OR_RETURN (
          const auto profile, BenchProfile::parse (arguments.bench));
      options = {.rate = arguments.rig.rate, .seed = arguments.seed};
      replay (options, profile);
    }
    RETURN_IF_ERROR (inflict (options, arguments.faults));
    auto rig = SimulatedRig::make (options);
    if (!rig && rig.error ().code == ErrorCode::invalid_argument)
      return rig.error (); // no bench has such numbers
    if (!rig)
      return Opened{
          nullptr, part_missing (rig.error (), options.has ("camera-missing"))};
    return Opened{*std::move (rig), {}, options.has ("slow-disk")};
  }
  auto dmd = open_dmd (arguments.rig.device);
  if (!dmd)
    return Opened{nullptr, part_missing (dmd.error (), false)};
  auto rig = open_camera_rig (arguments.rig, *std::move (dmd), stop);
  if (!rig)
    return Opened{nullptr, part_missing (rig.error (), true)};
  return Opened{*std::move (rig), {}, g_getenv (kSlowDiskVariable) != nullptr};
}

/* ----------------------------------------------------------- the dialogue --
 */

class Doctor
{
public:
  Doctor (const Arguments &arguments, std::stop_token stop)
      : arguments_ (arguments), stop_ (std::move (stop)), voice_ (arguments)
  {
  }

  int run ();

private:
  bool asks () const
  {
    return !arguments_.yes && !arguments_.simulated () &&
           isatty (STDIN_FILENO) != 0;
  }
  char ask (const std::string &question) const;
  Result<void> examine (const std::vector<Check> &checks);
  Result<Finding> take (const Check &check, Examination &examination);
  void tell (const Finding &finding) const;
  Result<void> write () const;
  DoctorPage page () const;
  std::vector<std::string> next_commands () const;
  Verdict worst () const;
  /** That no check has failed is good only if each has told. */
  bool is_known () const;

  const Arguments &arguments_;
  const std::stop_token stop_;
  const Voice voice_;
  std::vector<Check> checks_;
  std::vector<Finding> findings_;
  std::optional<BenchProfile> profile_;
  std::optional<RigParts> parts_;
};

/** The first character of the answer, in lower case; 0: Enter. */
char
Doctor::ask (const std::string &question) const
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

void
Doctor::tell (const Finding &finding) const
{
  const auto check = std::ranges::find (checks_, finding.check, &Check::name);
  const auto number = check - checks_.begin () + 1;
  const std::string title =
      check == checks_.end () ? finding.check : check->title;
  const std::string line = format ("%d. %-22s ", int (number), title.c_str ());
  if (finding.skipped)
    return voice_.line (line + "SKIPPED: a check before it failed");
  voice_.line (line + verdict_text (finding.verdict ()) +
               format (" (%.0f s)", finding.seconds));
  voice_.line ("   shown: " + finding.shown);
  for (const auto &[name, text] : finding.notes)
    voice_.line ("   " + name + ": " + text);
  for (const Reading &reading : finding.readings)
    voice_.line ("   " + reading.name + ": " + reading_text (reading) +
                 (reading.rule.empty () ? "" : " (" + reading.rule + ")"));
  for (const Diagnosis &diagnosis : finding.diagnoses) {
    voice_.line (format ("   %s %s: ", verdict_text (diagnosis.severity),
                     diagnosis.id.c_str ()) +
                 diagnosis.cause + ".");
    voice_.line ("        try next: " + diagnosis.remedy + ".");
  }
}

/** One check, again after each correction of the user. */
Result<Finding>
Doctor::take (const Check &check, Examination &examination)
{
  for (;;) {
    ASSIGN_OR_RETURN (
        Finding finding, run_check (check, examination, findings_));
    tell (finding);
    if (finding.skipped || finding.verdict () != Verdict::fail || !asks ())
      return finding;
    const char answer = ask ("   Correct it and press Enter to repeat the "
                             "check; c: continue; q: end.");
    if (answer == 'q')
      return Error{"stopped", ErrorCode::cancelled};
    if (answer == 'c')
      return finding;
  }
}

Result<void>
Doctor::examine (const std::vector<Check> &checks)
{
  ASSIGN_OR_RETURN (Opened opened, open_rig (arguments_, stop_));
  if (opened.missing) {
    findings_.push_back (*opened.missing);
    tell (findings_.back ());
    return {};
  }
  parts_ = opened.rig->parts ();
  Examination examination{
      *opened.rig, host_facts (arguments_.output, opened.slow_disk)};
  ASSIGN_OR_RETURN (
      examination.schedule, Schedule::parse (arguments_.schedule));
  examination.recording = arguments_.seconds;
  if (asks () &&
      ask ("Place a plain, bright target before the bench; nothing may move. "
           "Then press Enter (q: end).") == 'q')
    return Error{"stopped", ErrorCode::cancelled};
  for (const Check &check : checks) {
    if (stop_.stop_requested ())
      return Error{"stopped", ErrorCode::cancelled};
    ASSIGN_OR_RETURN (Finding finding, take (check, examination));
    findings_.push_back (std::move (finding));
  }
  examination.rig.park ();
  examination.profile.measured = now_utc ();
  if (worst () != Verdict::fail)
    profile_ = examination.profile;
  return {};
}

Verdict
Doctor::worst () const
{
  Verdict worst = Verdict::pass;
  for (const Finding &finding : findings_)
    worst = std::max (worst, finding.verdict ());
  return worst;
}

bool
Doctor::is_known () const
{
  return std::ranges::none_of (findings_, [] (const Finding &finding) {
    return finding.verdict () == Verdict::unknown;
  });
}

/* -------------------------------------------------------------- the files --
 */

std::vector<std::string>
Doctor::next_commands () const
{
  if (!profile_)
    return {};
  const std::string bench = " --bench " + arguments_.profile_path ();
  if (arguments_.simulated ())
    return {"codedexposure-simulate --scene pour" + bench +
                " --frames 50 --output coded.mkv",
        "codedexposure-decode coded.mkv --fuse best --output fused.mkv"};
  return {"codedexposure-record --camera \"" + arguments_.rig.camera +
              "\" --device " + arguments_.rig.device + " --schedule " +
              arguments_.schedule + bench + " --output coded.mkv",
      "codedexposure-decode coded.mkv --fuse best --output fused.mkv"};
}

DoctorPage
Doctor::page () const
{
  DoctorPage page;
  if (const auto style = read_file (arguments_.style, 1 << 20))
    page.style = *style;
  page.simulated = arguments_.simulated ();
  const auto now = std::chrono::system_clock::to_time_t (now_utc ());
  char date[64];
  std::strftime (date, sizeof date, "%Y-%m-%d %H:%M:%S UTC", gmtime (&now));
  page.head = {{"Result", verdict_text (worst ())}, {"Examined", date}};
  if (parts_) {
    page.head.emplace_back ("Camera",
        arguments_.simulated () ? "simulated" : arguments_.rig.camera);
    page.head.emplace_back ("DMD", parts_->dmd.name);
    page.head.emplace_back ("Frame rate", arguments_.rate + " frames/s");
  }
  page.head.emplace_back (
      "Made by", arguments_.what + " of " + arguments_.version);
  for (const Check &check : all_checks ())
    page.titles.emplace_back (check.name, check.title);
  page.findings = findings_;
  if (profile_)
    page.profile = profile_->rows ();
  page.next = next_commands ();
  return page;
}

Result<void>
Doctor::write () const
{
  if (arguments_.output.empty ())
    return {};
  RETURN_IF_ERROR (write_file (arguments_.page_path (), html_of (page ())));
  voice_.line ("page: " + arguments_.page_path ());
  if (!profile_) {
    const bool earlier =
        access (arguments_.profile_path ().c_str (), F_OK) == 0;
    voice_.line ("no bench profile, since a check failed" +
                 (earlier ? "; " + arguments_.profile_path () +
                                " is that of an earlier run"
                          : std::string ()));
    return {};
  }
  RETURN_IF_ERROR (profile_->save (arguments_.profile_path ()));
  voice_.line ("bench profile: " + arguments_.profile_path ());
  return {};
}

int
Doctor::run ()
{
  auto checks = choose_checks (arguments_.only);
  if (!checks) {
    voice_.trouble ("--only " + checks.error ().message);
    return kUsage;
  }
  checks_ = *checks;
  auto done = examine (checks_);
  if (done)
    done = write ();
  if (arguments_.json)
    std::printf ("%s\n", findings_json (findings_).c_str ());
  if (!done) {
    const bool cancelled = done.error ().code == ErrorCode::cancelled;
    voice_.trouble (
        cancelled ? "stopped; the mirrors are parked" : done.error ().message);
    return kBad;
  }
  voice_.line (std::string ("result: ") + verdict_text (worst ()));
  if (worst () == Verdict::fail)
    return kBad;
  if (is_known ())
    return kGood;
  voice_.line ("not all is known: see the checks that are UNKNOWN");
  return kNotKnown;
}

/* ---------------------------------------------------------- the arguments --
 */

Result<void>
complete (Arguments &arguments)
{
  const auto parts = split (arguments.rate, '/');
  const auto num = parse_int (parts[0]);
  const auto den = parts.size () > 1 ? parse_int (parts[1]) : 1;
  if (!num || !den || *num < 1 || *den < 1)
    return Error{"--frame-rate " + arguments.rate +
                 " is no rate such as 25 or 30000/1001"};
  arguments.rig.rate = {*num, *den};
  if (!arguments.exposure.empty ()) {
    const auto us = parse_real (arguments.exposure);
    if (!us || *us <= 0)
      return Error{
          "--exposure " + arguments.exposure + " is no time in microseconds"};
    arguments.rig.exposure = Nanoseconds (*us * 1e3);
  }
  if (const auto schedule = Schedule::parse (arguments.schedule); !schedule)
    return schedule.error ();
  return {};
}

} // namespace

int
main (int argc, char **argv)
{
  Signals signals;
  gst_init (&argc, &argv);
  Arguments arguments;
  CLI::App app{"Examines a bench. Run it by pipelines/doctor."};
  app.add_option ("--camera", arguments.rig.camera, "GenICam camera");
  app.add_option ("--device", arguments.rig.device, "DMD");
  app.add_option ("--camera-properties", arguments.rig.properties,
      "further properties of codedexposure-camerasrc");
  app.add_option ("--frame-rate", arguments.rate, "frames/s");
  app.add_option ("--exposure", arguments.exposure, "longest exposure, us");
  app.add_option ("--schedule", arguments.schedule, "to be recorded");
  app.add_option ("--seconds", arguments.seconds, "of the recording");
  app.add_option ("--only", arguments.only, "checks, separated by commas");
  app.add_option ("--output", arguments.output, "folder");
  app.add_option ("--style", arguments.style, "CSS of the page");
  app.add_option ("--what", arguments.what, "prefix of lines");
  app.add_option ("--program-version", arguments.version, "for the page");
  app.add_option ("--bench", arguments.bench, "profile of the simulated bench");
  app.add_option ("--faults", arguments.faults, "of the simulated bench");
  app.add_option ("--seed", arguments.seed, "of the simulated bench");
  app.add_flag ("--json", arguments.json, "print findings as JSON");
  app.add_flag ("--yes", arguments.yes, "ask nothing");
  CLI11_PARSE (app, argc, argv);
  int code = kUsage;
  if (const auto good = complete (arguments); !good)
    std::fprintf (stderr, "%s: %s\n", arguments.what.c_str (),
        good.error ().message.c_str ());
  else
    code = Doctor (arguments, signals.token ()).run ();
  if (const auto written = finish_output (); !written) {
    std::fprintf (stderr, "%s: %s\n", arguments.what.c_str (),
        written.error ().message.c_str ());
    code = kBad;
  }
  gst_deinit ();
  return code;
}
