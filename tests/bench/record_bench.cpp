/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Speed of recording coded frames from memory:
 *   record_bench [FOLDER [WIDTH HEIGHT [SECONDS [RATE]]]]
 * FOLDER is memory-backed by default, so that no disk is measured. A virtual
 * machine may have to get memory from its host, which takes longer than all
 * else, so the memory is used once before. */
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gst/app/gstappsrc.h>
#include <gst/gst.h>
#include <sys/resource.h>
#include <unistd.h>

#include "common/raii.h"

namespace
{

using namespace codedexposure::gst;
using Clock = std::chrono::steady_clock;

struct Setting {
  std::string folder = "/dev/shm";
  int width = 4096, height = 3072;
  double seconds = 10, rate = 100;

  std::size_t size () const { return std::size_t (width) * height; }
  std::string file () const { return folder + "/record_bench.mkv"; }
};

double
seconds_since (Clock::time_point begin)
{
  return std::chrono::duration<double> (Clock::now () - begin).count ();
}

double
processor_seconds ()
{
  rusage used = {};
  getrusage (RUSAGE_SELF, &used);
  const auto seconds = [] (const timeval &time) {
    return double (time.tv_sec) + 1e-6 * double (time.tv_usec);
  };
  return seconds (used.ru_utime) + seconds (used.ru_stime);
}

/** Frames of noise on a gradient, more than the caches hold. */
class Ring
{
public:
  static constexpr std::size_t kFrames = 8;

  explicit Ring (std::size_t size)
  {
    std::minstd_rand random (1);
    for (auto &frame : frames_) {
      frame.resize (size);
      for (std::size_t i = 0; i < size; i++)
        frame[i] = std::uint8_t (i / 4096 % 128 + random () % 16);
    }
  }
  std::vector<std::uint8_t> &frame (gint64 k)
  {
    return frames_[std::size_t (k) % kFrames];
  }

private:
  std::array<std::vector<std::uint8_t>, kFrames> frames_;
};

struct Speed {
  double rate = 0;  ///< frames/s
  double cores = 0; ///< that it got
};

/** Of @p work, for half a second. */
Speed
speed_of (const std::function<void (gint64)> &work)
{
  const double used = processor_seconds ();
  const auto begin = Clock::now ();
  gint64 frames = 0;
  while (seconds_since (begin) < 0.5)
    work (frames++);
  const double seconds = seconds_since (begin);
  return {double (frames) / seconds, (processor_seconds () - used) / seconds};
}

Speed
memcpy_speed (const Setting &setting, Ring &ring)
{
  Ring copies (setting.size ());
  return speed_of ([&] (gint64 k) {
    std::memcpy (
        copies.frame (k).data (), ring.frame (k).data (), setting.size ());
  });
}

/** Plain write () to a file that is new; its @p reserved bytes are allocated
 * before. */
Speed
write_speed (const Setting &setting, Ring &ring, off_t reserved)
{
  const int file =
      open (setting.file ().c_str (), O_CREAT | O_TRUNC | O_WRONLY, 0666);
  if (reserved > 0 && posix_fallocate (file, 0, reserved) != 0)
    std::perror ("posix_fallocate");
  const Speed speed = speed_of ([&] (gint64 k) {
    if (write (file, ring.frame (k).data (), setting.size ()) < 0)
      std::perror ("write");
  });
  close (file);
  unlink (setting.file ().c_str ());
  return speed;
}

/** Uses the memory, or the disk space, of a recording once. */
void
warm_up (const Setting &setting, Ring &ring)
{
  const int file =
      open (setting.file ().c_str (), O_CREAT | O_TRUNC | O_WRONLY, 0666);
  const auto frames = gint64 (setting.seconds * setting.rate);
  for (gint64 k = 0; k < frames; k++)
    if (write (file, ring.frame (k).data (), setting.size ()) < 0)
      std::perror ("write");
  close (file);
  unlink (setting.file ().c_str ());
}

/** Processor time of each thread so far, s, by its name. */
std::map<std::string, double>
thread_seconds ()
{
  std::map<std::string, double> seconds;
  for (const auto &thread :
      std::filesystem::directory_iterator ("/proc/self/task")) {
    std::string name;
    double ns = 0;
    std::getline (std::ifstream (thread.path () / "comm"), name);
    std::ifstream (thread.path () / "schedstat") >> ns;
    seconds[name] += 1e-9 * ns;
  }
  return seconds;
}

/** Frames that may wait for the disk, as in a recording. */
constexpr guint kWaiting = 75;

struct Run {
  gint64 frames = 0, lost = 0;
  double seconds = 0, cores = 0;
  std::map<std::string, double> threads; ///< seconds of a core
};

/** @p rate  frames/s of the source, which drops frames while kWaiting wait; 0:
 * as fast as they are taken, in 2 s. */
Run
record (const Setting &setting, Ring &ring, const std::string &codec,
    double rate, bool reserve)
{
  const double length = rate > 0 ? setting.seconds : 2;
  const double expected = length * (rate > 0 ? rate : 400);
  const std::string description =
      "appsrc name=in format=time caps=\"video/x-raw,format=GRAY8,width=" +
      std::to_string (setting.width) +
      ",height=" + std::to_string (setting.height) +
      ",framerate=100/1\" ! queue name=buffer "
      "max-size-buffers=" +
      std::to_string (rate > 0 ? kWaiting : 2) +
      " max-size-bytes=0 max-size-time=0 ! codedexposure-recordmux codec=" +
      codec + " ! codedexposure-filesink reserve=" +
      std::to_string (
          reserve ? guint64 (expected * double (setting.size ())) : 0) +
      " location=" + setting.file ();
  const ObjectPtr<GstElement> pipeline (
      gst_parse_launch (description.c_str (), nullptr));
  const ObjectPtr<GstElement> in (
      gst_bin_get_by_name (GST_BIN (pipeline.get ()), "in"));
  const ObjectPtr<GstElement> queue (
      gst_bin_get_by_name (GST_BIN (pipeline.get ()), "buffer"));
  g_object_set (in.get (), "block", TRUE, "max-buffers", guint64 (2), nullptr);
  gst_element_set_state (pipeline.get (), GST_STATE_PLAYING);
  Run run;
  const auto threads = thread_seconds ();
  const double used = processor_seconds ();
  const auto begin = Clock::now ();
  for (gint64 k = 0; seconds_since (begin) < length; k++) {
    if (rate > 0)
      std::this_thread::sleep_until (
          begin + std::chrono::duration_cast<Clock::duration> (
                      std::chrono::duration<double> (double (k) / rate)));
    guint waiting = 0;
    g_object_get (queue.get (), "current-level-buffers", &waiting, nullptr);
    if (rate > 0 && waiting >= kWaiting) {
      run.lost++;
      continue;
    }
    auto &frame = ring.frame (k);
    GstBuffer *buffer = gst_buffer_new_wrapped_full (GST_MEMORY_FLAG_READONLY,
        frame.data (), frame.size (), 0, frame.size (), nullptr, nullptr);
    GST_BUFFER_PTS (buffer) = guint64 (k) * (GST_SECOND / 100);
    GST_BUFFER_DURATION (buffer) = GST_SECOND / 100;
    gst_app_src_push_buffer (GST_APP_SRC (in.get ()), buffer);
    run.frames++;
  }
  gst_app_src_end_of_stream (GST_APP_SRC (in.get ()));
  const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline.get ()));
  GstMessage *end = gst_bus_timed_pop_filtered (bus.get (), 300 * GST_SECOND,
      GstMessageType (GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
  if (!end || GST_MESSAGE_TYPE (end) != GST_MESSAGE_EOS)
    std::printf ("The recording failed.\n");
  gst_clear_message (&end);
  run.seconds = seconds_since (begin);
  run.cores = (processor_seconds () - used) / run.seconds;
  for (const auto &[name, seconds] : thread_seconds ()) {
    const auto before = threads.find (name);
    run.threads[name] =
        seconds - (before == threads.end () ? 0 : before->second);
  }
  gst_element_set_state (pipeline.get (), GST_STATE_NULL);
  unlink (setting.file ().c_str ());
  return run;
}

void
print (const Setting &setting, const char *name, const Speed &speed,
    const Speed &reference)
{
  std::printf ("| %s | %.1f | %.2f | %.2f | %.2f | %.0f |\n", name, speed.rate,
      speed.rate * double (setting.size ()) / 1e9, speed.rate / reference.rate,
      speed.cores, speed.rate / speed.cores);
}

/** At the rate of a camera. */
void
record_live (const Setting &setting, Ring &ring, bool reserve)
{
  warm_up (setting, ring);
  const Run run = record (setting, ring, "raw", setting.rate, reserve);
  std::printf ("\nraw at %g frames/s for %g s%s: %" G_GINT64_FORMAT
               " recorded, %" G_GINT64_FORMAT
               " lost, %.2f cores, %.1f s until all were written\n",
      setting.rate, setting.seconds, reserve ? ", space reserved" : "",
      run.frames, run.lost, run.cores, run.seconds);
  for (const auto &[name, seconds] : run.threads)
    if (seconds > 0.01 * run.seconds)
      std::printf (
          "  thread %s: %.2f cores\n", name.c_str (), seconds / run.seconds);
}

void
run_all (const Setting &setting)
{
  Ring ring (setting.size ());
  const Speed copies = memcpy_speed (setting, ring);
  std::printf ("%dx%d, 8 bits, %s\n\n", setting.width, setting.height,
      setting.folder.c_str ());
  std::printf (
      "| | coded frames/s | GB/s | of memcpy | cores | frames/s of a core |\n"
      "|---|---|---|---|---|---|\n");
  print (setting, "memcpy", copies, copies);
  warm_up (setting, ring);
  print (setting, "write () to a new file", write_speed (setting, ring, 0),
      copies);
  print (setting, "write () into reserved space",
      write_speed (setting, ring, off_t (400 * setting.size ())), copies);
  const auto fast = [&] (const char *name, const char *codec, bool reserve) {
    const Run run = record (setting, ring, codec, 0, reserve);
    print (
        setting, name, {double (run.frames) / run.seconds, run.cores}, copies);
  };
  fast ("raw", "raw", false);
  fast ("raw, space reserved", "raw", true);
  record_live (setting, ring, false);
  record_live (setting, ring, true);
  fast ("FFV1", "ffv1", false);
}

} // namespace

int
main (int argc, char **argv)
{
  gst_init (&argc, &argv);
  std::setvbuf (stdout, nullptr, _IOLBF, 0);
  Setting setting;
  if (argc > 1)
    setting.folder = argv[1];
  if (argc > 3) {
    setting.width = std::atoi (argv[2]);
    setting.height = std::atoi (argv[3]);
  }
  if (argc > 4)
    setting.seconds = std::atof (argv[4]);
  if (argc > 5)
    setting.rate = std::atof (argv[5]);
  run_all (setting);
}
