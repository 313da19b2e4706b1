/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* An emulated GigE Vision camera that loses packets, is unplugged, and whose
 * client is stopped. */
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

#include "child.h"
#include "emulation/gige_camera.h"
#include "play.h"

namespace codedexposure::campaign
{

namespace
{

constexpr int kRate = 25; // frames/s

/** The camera in a process of its own. Its slots are counted from one origin,
 * whenever it was started. */
class Camera
{
public:
  explicit Camera (const std::string &packet_loss = "0")
      : child_ ("camera", {std::to_string (origin ()), packet_loss})
  {
    child_.await ("serving");
  }
  void type (const std::string &line) { child_.type (line); }

private:
  static GstClockTime origin ()
  {
    static const GstClockTime time = gst_util_get_timestamp ();
    return time;
  }
  Child child_;
};

/** A client of the camera and its judge. */
struct Client {
  Client ()
      : judge ({.by_number = true}),
        play ("codedexposure-camerasrc name=camera camera-name=127.0.0.1 "
              "source::packet-resend=false reconnect=100 ! "
              "video/x-raw,format=GRAY8,width=" +
              std::to_string (kWidth) + ",height=" + std::to_string (kHeight) +
              ",framerate=" + std::to_string (kRate) +
              "/1 ! dmdsync name=sync timestamp-at=device-clock "
              "schedule=sequential:2x2 ! codedexposure-demux ! "
              "fakesink name=out sync=false async=false")
  {
    judge.watch (play.pad ("out", "sink").get ());
    play.start ();
  }
  bool wait_frames (int count)
  {
    const auto wanted = judge.tally ().delivered + unsigned (count) * kSlots;
    auto came = judge.tally ().delivered;
    for (int tries = 0; tries < 30'000; tries++) {
      const auto now = judge.tally ().delivered;
      if (now >= wanted)
        return true;
      if (!play.poll ())
        return false;
      if (std::exchange (came, now) != now)
        tries = 0;
      g_usleep (2000);
    }
    play.hung = true;
    return false;
  }
  void end (Row &row)
  {
    play.poll ();
    play.stop ();
    row.runs++;
    row.tally += judge.tally ();
    row.refused += !play.error.empty ();
    row.hung += play.hung;
    for (const auto &[text, count] : play.told)
      row.told[text] += count;
    if (judge.tally ().as_good + judge.tally ().untold > 0)
      row.note (judge.evidence ());
  }

  Judge judge;
  Play play;
};

void
need (Row &row, const char *message)
{
  if (row.told.count (message))
    return;
  row.mute++;
  row.note (std::string ("no ") + message);
}

std::vector<Row>
camera_faults (Scale scale)
{
  Row row{.name = "GigE camera: frames lost, cut, twice, late"};
  Camera camera;
  Client client;
  const int rounds = scale == Scale::full ? 50 : 2;
  bool going = client.wait_frames (20);
  for (int round = 0; round < rounds && going; round++)
    for (const char *fault : {"lose@now:3", "incomplete@now", "duplicate@now",
             "late@now", "delay@now:9ms"}) {
      camera.type (fault);
      going = going && client.wait_frames (12);
    }
  client.end (row);
  need (row, "codedexposure/frames-lost");
  return {row};
}

std::vector<Row>
packets (Scale scale)
{
  std::vector<Row> rows;
  for (const char *part : {"0.001", "0.01", "0.1"}) {
    rows.push_back ({.name = "GigE camera: " + std::string (part) +
                             " of the packets lost"});
    Camera camera (part);
    Client client;
    client.wait_frames (scale == Scale::full ? 1500 : 50);
    client.end (rows.back ());
  }
  return rows;
}

std::vector<Row>
unplugged (Scale scale)
{
  Row row{.name = "GigE camera: unplugged and back"};
  auto camera = std::make_unique<Camera> ();
  Client client;
  bool going = client.wait_frames (20);
  const int times = scale == Scale::full ? 10 : 1;
  for (int time = 0; time < times && going; time++) {
    camera.reset ();
    camera = std::make_unique<Camera> ();
    going =
        client.play.wait_for ("codedexposure/camera-back", GST_SECOND * 60) &&
        client.wait_frames (20);
  }
  client.end (row);
  need (row, "codedexposure/camera-lost");
  need (row, "codedexposure/camera-back");
  return {row};
}

/** Stops this process for @p seconds, as Ctrl-Z does. */
void
stop_process (unsigned seconds)
{
  const pid_t self = getpid ();
  const pid_t child = fork ();
  if (child == 0) {
    kill (self, SIGSTOP);
    sleep (seconds);
    kill (self, SIGCONT);
    _exit (0);
  }
  waitpid (child, nullptr, 0);
}

std::vector<Row>
stopped (Scale scale)
{
  Row row{.name = "the program is stopped for 3 s (SIGSTOP)"};
  Camera camera;
  Client client;
  bool going = client.wait_frames (20);
  for (int time = 0; time < (scale == Scale::full ? 5 : 1) && going; time++) {
    stop_process (3);
    going = client.wait_frames (50);
  }
  client.end (row);
  return {row};
}

} // namespace

int
run_camera (const std::vector<std::string> &words)
{
  const GstClockTime origin = std::stoull (words[0]);
  constexpr GstClockTime kTime = GST_SECOND / kRate;
  GigeCameraOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.trigger_rate = kRate;
  options.packet_loss = std::stod (words[1]);
  /* It stands still while no client wants frames, but the scene does not. */
  constexpr std::int64_t kStoodStill = 25; // frames; fewer: a busy machine
  std::int64_t first = 0;
  std::int64_t last = -kStoodStill;
  auto camera = GigeCamera::open (
      options, [&] (std::uint64_t frame, ImageView<std::uint16_t> picture) {
        const auto now =
            std::int64_t ((gst_util_get_timestamp () - origin) / kTime);
        if (now - std::exchange (last, now) >= kStoodStill)
          first = now - std::int64_t (frame);
        const auto slot = (first + std::int64_t (frame)) * kSlots;
        for (int y = 0; y < picture.height; y++)
          for (int x = 0; x < picture.width; x++)
            picture.at (x, y) = std::uint16_t (coded_pixel (slot, x, y));
        return true;
      });
  if (!camera) {
    std::fprintf (stderr, "%s\n", camera.error ().message.c_str ());
    return 1;
  }
  std::puts ("serving");
  std::fflush (stdout);
  char line[256];
  while (std::fgets (line, sizeof line, stdin)) {
    std::string text = line;
    text.pop_back ();
    (void)(*camera)->add_faults (text);
  }
  return 0;
}

std::vector<Case>
camera_cases ()
{
  std::vector<Case> cases{{"camera", camera_faults}, {"packets", packets},
      {"unplugged", unplugged}, {"stopped", stopped}};
  if (!is_isolated ())
    for (Case &one : cases)
      one.run = [name = one.name] (Scale) {
        return std::vector<Row>{{.name = name,
            .skipped = "a network of its own is not allowed here"}};
      };
  return cases;
}

} // namespace codedexposure::campaign
