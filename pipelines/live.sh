#!/bin/bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Shows the subframes of the simulated bench while it runs, at N times the frame
# rate. docs/record.md explains it; with keys and captions: codedexposure live.
SINK=${SINK:-autovideosink}
SCHEDULE=${SCHEDULE:-sequential:2x2}
SIZE=${SIZE:-width=768,height=576}
FRAMES=${FRAMES:-250}
# In a source tree, the plugin is that of its build.
here=$(dirname "$(readlink -f "$0")")
export GST_PLUGIN_PATH="${GST_PLUGIN_PATH-$here/../build/gst}"

exec gst-launch-1.0 -e \
  codedexposure-scene scene=pour repeat=1500000000 \
  ! "video/x-raw,format=GRAY8,$SIZE,framerate=100/1" ! clocksync ! queue \
  ! codedexposure-sim schedule="$SCHEDULE" dmd=sim:bench ! video/x-raw,framerate=25/1 \
  ! dmdsync schedule="$SCHEDULE" device=sim:bench ! identity eos-after=$((FRAMES + 1)) \
  ! queue max-size-buffers=8 ! codedexposure-demux \
  ! queue leaky=downstream max-size-buffers=8 ! codedexposure-view ! videoconvert \
  ! "$SINK"
