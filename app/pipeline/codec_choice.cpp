/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "codec_choice.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>

#include <fcntl.h>
#include <unistd.h>

#include "failure.h"
#include "pipeline/graph.h"
#include "pipeline/messages.h"
#include "pipeline/source.h"

namespace codedexposure::app
{

using namespace gst;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace
{

/* FFV1 must be faster than the camera by this factor, because other programs
 * and brighter scenes need time as well. */
constexpr double kMargin = 1.5;

/* Frames/s of noise, which takes longest, through the encoder. */
double
ffv1_speed (const SourcePlan &plan)
{
  constexpr std::size_t kBytes = 30'000'000; // a second at 0.03 GB/s
  constexpr GstClockTime kPatience = 20 * GST_SECOND;
  const int frames = std::clamp (int (kBytes / plan.frame_bytes ()), 4, 200);
  Graph graph;
  Chain chain =
      graph.begin ("videotestsrc", {{"num-buffers", 1}, {"pattern", "snow"}});
  chain.caps (grey_caps (plan, plan.frame_rate))
      .to ("imagefreeze", {{"num-buffers", frames}})
      .to ("codedexposure-recordmux")
      .to ("fakesink", {{"sync", false}});
  const auto begin = Clock::now ();
  gst_element_set_state (graph.pipeline (), GST_STATE_PLAYING);
  const MessagePtr message = next_message (
      graph.pipeline (), GST_MESSAGE_EOS | GST_MESSAGE_ERROR, kPatience);
  const bool ended =
      message && GST_MESSAGE_TYPE (message.get ()) == GST_MESSAGE_EOS;
  return ended ? frames / seconds_since (begin) : 0;
}

} // namespace

double
disk_speed (const std::string &file)
{
  constexpr std::size_t kBlock = std::size_t (8) << 20, kAlign = 4096;
  constexpr int kBlocks = 32;
  constexpr double kPatience = 5; // s
  const std::string path =
      (fs::absolute (file).parent_path () / ".codedexposure-disk-XXXXXX")
          .string ();
  std::string name = path;
  const int written = mkstemp (name.data ());
  if (written < 0)
    fail ("cannot write " + file + "; choose a folder that you can write to");
  const int direct = open (name.c_str (), O_WRONLY | O_DIRECT | O_CLOEXEC);
  unlink (name.c_str ());
  const std::unique_ptr<void, decltype (&std::free)> block (
      std::aligned_alloc (kAlign, kBlock), std::free);
  std::fill_n (static_cast<char *> (block.get ()), kBlock, '\0');
  const auto begin = Clock::now ();
  double bytes = 0;
  int error = 0;
  int to = direct >= 0 ? direct : written;
  for (int k = 0; k < kBlocks && seconds_since (begin) < kPatience; k++) {
    auto done = write (to, block.get (), kBlock);
    if (done < 0 && errno == EINVAL && to == direct) {
      to = written; // some file systems open files so, and do not write so
      done = write (to, block.get (), kBlock);
    }
    error = done < 0 ? errno : 0;
    if (done <= 0)
      break;
    bytes += double (done);
  }
  fdatasync (written);
  const double speed = bytes / seconds_since (begin);
  for (const int open_file : {direct, written})
    if (open_file >= 0)
      close (open_file);
  if (bytes < double (kBlock) && error != 0)
    fail (format ("only %.3g MB can be written beside ", bytes / 1e6) + file +
          ": " + std::strerror (error) +
          "; delete files, or choose another disk");
  return speed;
}

std::string
choose_codec (const SourcePlan &plan, const std::string &file, Status &status)
{
  std::error_code ignored;
  fs::create_directories (fs::absolute (file).parent_path (), ignored);
  const double needed = double (plan.frame_rate.num) / plan.frame_rate.den;
  const double reached = ffv1_speed (plan);
  const std::string words =
      format ("FFV1 reaches %.0f frames/s of noise here, and %g times the %g "
              "frames/s of the camera",
          reached, kMargin, needed);
  if (reached >= kMargin * needed) {
    status.line ("codec ffv1: " + words + " are needed");
    return "ffv1";
  }
  const double disk = disk_speed (file);
  const double raw = needed * double (plan.frame_bytes ());
  status.line (
      "codec raw: " + words + " would be needed; " +
      format ("the disk writes %.2f GB/s, and raw frames need %.2f "
              "GB/s%s",
          disk / 1e9, raw / 1e9,
          disk < raw ? ", so the buffer will fill: use a faster disk" : ""));
  return "raw";
}

} // namespace codedexposure::app
