/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure bench: an emulated GigE Vision camera, and a board on an
 * emulated USB, for another command. */
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <memory>
#include <thread>

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/text.h"
#include "bench/sick_options.h"
#include "command.h"
#include "emulation/frame_source.h"
#include "emulation/own_network.h"
#include "emulation/served_bench.h"
#include "emulation/shared_trigger.h"
#include "options/board.h"
#include "pipeline/program.h"
#include "pipeline/source.h"
#include "pipeline/status.h"

namespace codedexposure::app
{

namespace
{

class Bench
{
public:
  void declare (Options &options)
  {
    options.rest (command_);
    options.heading ("");
    options.value ("--cameras", cameras_, "N",
        "number of cameras, at 127.0.0.1, 127.0.0.2 ... [1]", whole (1, 9));
    options.flag ("--second", second_,
        "also a camera in the beam of the mirrors that are off, at 127.0.0.2, "
        "which sees the same scene and is triggered with the first");
    options.value ("--drift", drift_, "PPM",
        "how much the clock of the camera is fast [0]",
        real (-500, 500, "a number of ppm from -500 to 500"));
    options.value ("--jitter", jitter_, "TIME",
        "max random delay of frames, such as 5ms [0]", time_rule ("5ms"));
    options.value ("--packet-loss", packet_loss_, "P",
        "part of the network packets that is lost, 0 to 1 [0]",
        real (0, 1, "a number from 0 to 1"));
    options.value ("--trigger-rate", trigger_rate_, "R",
        "rate of the DMD's trigger, frames/s [that of the camera]",
        real (0.1, 1000, "a number of frames/s from 0.1 to 1000"));
    options.value ("--dmd", dmd_, "BOARD",
        "the camera sees a DMD in place of a scene: dlp6500 or dlp5500, at "
        "usb: of COMMAND, in even light",
        one_of ({"dlp6500", "dlp5500"}));
    options.value ("--faults", faults_, "\"...\"",
        "faults of frames: lose@10:3 incomplete@20 delay@30:5ms duplicate@40 "
        "late@50 stop@60; with --dmd also those of the bench, which --faults "
        "help lists");
    options.flag (
        "--no-outputs", no_outputs_, "no line of the camera can be an output");
    options.value ("--address", address_, "ADDRESS",
        "in place of COMMAND: the camera is at this address of the present "
        "network, until Ctrl-C; reads more faults, such as lose@now:3, from "
        "standard input");
    options.flag ("--log", log_,
        "print a line of JSON for every frame that a camera sends");
    source_.declare (options, SourceOptions::Kind::simulated);
    /* The bench of --dmd has light in place of a scene, and its numbers in
     * --faults. */
    options.exclude (
        {"--input", "--input-rate", "--scene", "--pattern", "--schedule",
            "--bench", "--psf-sigma", "--full-well", "--read-noise", "--gain",
            "--shift-x", "--shift-y", "--rotation", "--scale", "--frames",
            "--trigger-rate", "--cameras", "--address"},
        "--dmd");
    options.exclude ({"--cameras", "--second"}, "--address");
    options.exclude ({"--cameras"}, "--second");
  }

  /* The namespace is made, and signals are blocked, before there are
   * threads. */
  Exit run ()
  {
    if (faults_ == "help") {
      std::printf (
          "Faults of the bench, with --dmd:\n%s", fault_help ().c_str ());
      return Exit::done;
    }
    check ();
    name_this_program ();
    sigset_t signals, before;
    sigemptyset (&signals);
    for (const int number : {SIGCHLD, SIGINT, SIGTERM, SIGHUP})
      sigaddset (&signals, number);
    sigprocmask (SIG_BLOCK, &signals, &before);
    if (!address_)
      value_of (leave_network (second_ ? 2 : cameras_.value_or (1)));
    start_gstreamer ();
    plan_ = SourcePlan::make (source_);
    const int cameras = second_ ? 2 : cameras_.value_or (1);
    if (second_ && !dmd_)
      trigger_ = std::make_unique<SharedTrigger> (
          std::llround (1e9 / camera_options (1).trigger_rate));
    if (dmd_)
      open_board ();
    else
      for (int number = 1; number <= cameras; number++)
        open_camera (number);
    if (address_) {
      sigdelset (&signals, SIGCHLD); // of what looks for plugins
      return serve_until_end (signals);
    }
    return Exit (run_command (signals, before));
  }

private:
  /** A camera, and the scene that it sees. */
  struct Camera {
    std::unique_ptr<Job> job;
    std::unique_ptr<FrameSource> frames;
    std::unique_ptr<GigeCamera> camera;
  };

  void check () const
  {
    if (dmd_ && command_.empty ())
      usage_error ("--dmd needs a COMMAND");
    if (address_ && !command_.empty ())
      usage_error ("--address serves until Ctrl-C; leave out the COMMAND");
  }

  GigeCameraOptions camera_options (int number) const
  {
    GigeCameraOptions options;
    options.address = address_.value_or ("127.0.0." + std::to_string (number));
    options.serial = "CE0" + std::to_string (number);
    options.width = plan_.size.width;
    options.height = plan_.size.height;
    options.bits = plan_.bits;
    options.trigger_rate = trigger_rate_.value_or (
        double (plan_.frame_rate.num) / plan_.frame_rate.den);
    options.drift = drift_.value_or (0);
    options.jitter = jitter_.value_or (0);
    options.packet_loss = packet_loss_.value_or (0);
    options.seed = source_.seed.value_or (options.seed);
    options.outputs = !no_outputs_;
    options.set_up = [address = options.address] (
                         const CameraSettings &settings) {
      std::fprintf (stderr, "bench: %s: the camera sends %s\n",
          address.c_str (), camera_settings_text (settings).c_str ());
    };
    if (log_)
      options.sent = [address = options.address] (
                         const SentFrame &sent) { print_sent (address, sent); };
    return options;
  }

  void open_camera (int number)
  {
    GigeCameraOptions options = camera_options (number);
    value_of (options.faults.add (faults_.value_or ("")), Exit::usage);
    Camera &opened = open_.emplace_back ();
    opened.job = std::make_unique<Job> ("bench", RunOptions{});
    SourceOptions source = source_;
    const bool is_off = second_ && number == 2;
    if (is_off)
      source.seed = 1 + source.seed.value_or (0);
    Chain chain = simulation (*opened.job, source, plan_, Pace::fast,
        {{"beam", is_off ? "off" : "on"}});
    limit_frames (*opened.job, source_, chain);
    const bool loop = !source_.frames && source_.input;
    opened.frames = value_of (FrameSource::open (chain, loop));
    FrameSource &frames = *opened.frames;
    options.width = frames.info ().width;
    options.height = frames.info ().height;
    /* Frame n of its source is that of exposure n. */
    if (second_)
      options.shoot = [this, &frames, last = std::optional<std::uint64_t> (),
                          taken = std::uint64_t (0)] (
                          ImageView<std::uint16_t> picture) mutable {
        const auto shot = trigger_->next (last);
        if (shot)
          last = shot->number;
        for (; shot && taken <= shot->number; taken++)
          if (!frames.take (picture))
            return std::optional<Shot> ();
        return shot;
      };
    opened.camera = value_of (GigeCamera::open (
        options, [&frames] (std::uint64_t, ImageView<std::uint16_t> picture) {
          return frames.take (picture);
        }));
    say_serving (options);
  }

  void open_board ()
  {
    std::vector<GigeCameraOptions> cameras = {camera_options (1)};
    if (second_)
      cameras.push_back (camera_options (2));
    served_ = value_of (ServedBench::open (
        *dmd_, faults_.value_or (""), plan_.size, std::move (cameras)));
    for (const GigeCameraOptions &options : served_->camera_options ())
      say_serving (options);
  }

  void say_serving (const GigeCameraOptions &options)
  {
    status_.line ("serving " + size_text ({options.width, options.height}) +
                  " as Aravis-Fake-" + options.serial + " at " +
                  options.address);
  }

  /* Adds faults from standard input; the thread ends with the process. */
  void read_faults (GigeCamera &camera)
  {
    std::thread ([this, &camera] {
      for (std::string line; std::getline (std::cin, line);)
        if (const auto added = camera.add_faults (line); !added)
          status_.line (added.error ().message);
    }).detach ();
  }

  /* The camera is a real one for others until a signal, or until its scene
   * ends. */
  Exit serve_until_end (const sigset_t &ends)
  {
    read_faults (*open_.front ().camera);
    const FrameSource &frames = *open_.front ().frames;
    const timespec moment{0, 100'000'000};
    while (!frames.ended () && sigtimedwait (&ends, nullptr, &moment) < 0)
      ;
    if (frames.ended ())
      status_.line (frames.why_ended ());
    return Exit::done;
  }

  /* A terminal sends its signals to both, and the camera must not end before
   * the command that reads it; other signals are passed on. */
  int run_command (const sigset_t &signals, const sigset_t &before) const
  {
    const std::vector<std::string> words = this->words ();
    std::vector<char *> arguments;
    for (const std::string &word : words)
      arguments.push_back (const_cast<char *> (word.c_str ()));
    arguments.push_back (nullptr);
    const pid_t child = fork ();
    if (child < 0)
      fail ("cannot start " + words[0] + "; end other programs");
    if (child == 0) {
      prctl (PR_SET_PDEATHSIG, SIGTERM);
      sigprocmask (SIG_SETMASK, &before, nullptr);
      if (served_)
        for (const auto &[name, value] : served_->environment ())
          setenv (name.c_str (), value.c_str (), 1);
      execvp (arguments[0], arguments.data ());
      std::fprintf (stderr, "bench: cannot run %s: %s\n", arguments[0],
          std::strerror (errno));
      _exit (127);
    }
    int status = 0;
    while (waitpid (child, &status, WNOHANG) == 0) {
      siginfo_t info = {};
      const int number = sigwaitinfo (&signals, &info);
      const bool from_terminal = info.si_code == SI_KERNEL;
      if (number > 0 && number != SIGCHLD && !from_terminal)
        kill (child, number);
    }
    return WIFSIGNALED (status) ? 128 + WTERMSIG (status)
                                : WEXITSTATUS (status);
  }

  std::vector<std::string> words () const
  {
    if (!command_.empty ())
      return command_;
    std::vector<std::string> live{"/proc/self/exe", "live", "--camera",
        "127.0.0.1", "--size", size_text (plan_.size), "--frame-rate",
        rate_text (plan_.frame_rate), "--pixel-format",
        plan_.bits > 8 ? "Mono16" : "Mono8", "--schedule",
        source_.schedule_text ()};
    if (second_)
      live.insert (live.end (), {"--second", "--second-camera", "127.0.0.2"});
    return live;
  }

  SourceOptions source_;
  SourcePlan plan_;
  std::optional<Text> dmd_, faults_, address_;
  std::optional<Nanoseconds> jitter_;
  std::optional<int> cameras_;
  std::optional<double> drift_, packet_loss_, trigger_rate_;
  bool no_outputs_ = false, log_ = false, second_ = false;
  std::vector<std::string> command_;
  Status status_{"bench", false};
  std::unique_ptr<SharedTrigger> trigger_; // of both cameras
  std::vector<Camera> open_;
  std::unique_ptr<ServedBench> served_;
};

} // namespace

Command
bench_command ()
{
  return make_command<Bench> ({.name = "bench",
      .summary = "run a command with an emulated camera, and a board",
      .usage = "[option...] [--] [COMMAND...]",
      .description = R"(
Runs COMMAND together with an emulated GigE Vision camera. The camera serves
coded frames of the simulated bench; codedexposure-camerasrc
camera-name=127.0.0.1 reads it. With --dmd, it sees the mirrors of a board on
an emulated USB, which triggers it, and faults make this bench ill. Both run in
a network namespace with only the loopback interface, so the search for cameras
does not reach other machines.
Without COMMAND, "codedexposure live" shows the picture of the camera.
)",
      .notes = R"(
Exit status: that of COMMAND; 1 if the camera cannot be started, 2 wrong usage.

Examples:
  Record the emulated camera:
    codedexposure bench codedexposure record --camera 127.0.0.1 \
      --frames 50 --output gige.mkv
  The same, with three frames that are lost and one that comes late:
    codedexposure bench --faults "lose@10:3 delay@30:5ms" \
      codedexposure record --camera 127.0.0.1 --frames 50 \
      --output faults.mkv
  A pipeline of your own, with a camera of 12 bits:
    codedexposure bench --bits 12 gst-launch-1.0 codedexposure-camerasrc \
      camera-name=127.0.0.1 pixel-format=Mono12 num-buffers=50 ! fakesink
)"});
}

} // namespace codedexposure::app
