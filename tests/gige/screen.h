/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A screen in software, and photographs of it. */
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include <gst/app/gstappsink.h>
#include <gtest/gtest.h>

#include "base/image.h"
#include "common/raii.h"

namespace codedexposure::test
{

/** An X server that this process's windows are on from now on. */
class Screen
{
public:
  Screen ()
  {
    int number[2];
    if (pipe2 (number, O_CLOEXEC) != 0)
      return;
    // A server that resets when its last client leaves refuses those that come.
    std::string words[] = {"Xvfb", "-displayfd", "3", "-screen", "0",
        "640x480x24", "-noreset", "-nolisten", "tcp"};
    char *arguments[std::size (words) + 1] = {};
    for (std::size_t k = 0; k < std::size (words); k++)
      arguments[k] = words[k].data ();
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init (&actions);
    posix_spawn_file_actions_adddup2 (&actions, number[1], 3);
    posix_spawn_file_actions_addopen (
        &actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    if (posix_spawnp (
            &id_, arguments[0], &actions, nullptr, arguments, environ) != 0)
      id_ = 0;
    posix_spawn_file_actions_destroy (&actions);
    close (number[1]);
    FILE *said = fdopen (number[0], "r");
    int display = 0;
    there_ = id_ != 0 && std::fscanf (said, "%d", &display) == 1;
    std::fclose (said);
    setenv ("DISPLAY", (":" + std::to_string (display)).c_str (), 1);
  }
  ~Screen ()
  {
    if (id_ == 0)
      return;
    kill (id_, SIGTERM);
    waitpid (id_, nullptr, 0);
  }
  Screen (const Screen &) = delete;
  Screen &operator= (const Screen &) = delete;

  /** False where no X server could be started. */
  bool there () const { return there_; }

  /** Grey values of its upper left corner; -1 where there is a colour. */
  Image<int> photograph (int width, int height) const
  {
    using namespace gst;
    const ObjectPtr<GstElement> pipeline (
        GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
            ("ximagesrc num-buffers=1 use-damage=false show-pointer=false "
             "endx=" +
                std::to_string (width - 1) +
                " endy=" + std::to_string (height - 1) +
                " ! videoconvert ! video/x-raw,format=RGBx ! "
                "appsink name=picture sync=false")
                .c_str (),
            nullptr))));
    const ObjectPtr<GstElement> sink (
        gst_bin_get_by_name (GST_BIN (pipeline.get ()), "picture"));
    gst_element_set_state (pipeline.get (), GST_STATE_PLAYING);
    GstSample *sample = gst_app_sink_try_pull_sample (
        GST_APP_SINK (sink.get ()), 30 * GST_SECOND);
    Image<int> grey (width, height);
    GstVideoInfo info;
    if (sample &&
        gst_video_info_from_caps (&info, gst_sample_get_caps (sample))) {
      MappedFrame frame (info, gst_sample_get_buffer (sample), GST_MAP_READ);
      for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
          const auto *rgb =
              static_cast<const guint8 *> (
                  GST_VIDEO_FRAME_PLANE_DATA (frame.frame (), 0)) +
              y * GST_VIDEO_FRAME_PLANE_STRIDE (frame.frame (), 0) + 4 * x;
          grey.at (x, y) = rgb[0] == rgb[1] && rgb[1] == rgb[2] ? rgb[0] : -1;
        }
    }
    if (sample)
      gst_sample_unref (sample);
    gst_element_set_state (pipeline.get (), GST_STATE_NULL);
    return grey;
  }

private:
  pid_t id_ = 0;
  bool there_ = false;
};

} // namespace codedexposure::test
