#!/bin/bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Records two seconds of the simulated bench. docs/record.md explains it; with
# comfort: codedexposure record.
OUTPUT=${1:-coded.mkv}
SCHEDULE=${SCHEDULE:-sequential:2x2}
SIZE=${SIZE:-width=768,height=576}
FRAMES=${FRAMES:-50}
# In a source tree, the plugin is that of its build.
here=$(dirname "$(readlink -f "$0")")
export GST_PLUGIN_PATH="${GST_PLUGIN_PATH-$here/../build/gst}"

# The scene has a picture for each slot: here, 100 a second for 25 coded frames.
exec gst-launch-1.0 -e \
  videotestsrc pattern=ball is-live=true \
  ! "video/x-raw,format=GRAY8,$SIZE,framerate=100/1" \
  ! codedexposure-sim schedule="$SCHEDULE" dmd=sim:bench ! video/x-raw,framerate=25/1 \
  ! dmdsync schedule="$SCHEDULE" device=sim:bench ! identity eos-after=$((FRAMES + 1)) \
  ! queue max-size-buffers=75 max-size-bytes=0 max-size-time=0 leaky=downstream \
  ! codedexposure-recordmux log-location="${OUTPUT%.mkv}.jsonl" \
  ! filesink location="$OUTPUT"
