#!/bin/bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Records a camera that a DMD triggers. docs/bench.md explains their wiring,
# docs/record.md the line; with comfort: codedexposure record --camera.
OUTPUT=${1:-camera.mkv}
CAMERA=${CAMERA:-} # as "codedexposure camera list" shows it
DEVICE=${DEVICE:-usb:}
SCHEDULE=${SCHEDULE:-sequential:2x2}
FORMAT=${FORMAT:-format=GRAY8,width=768,height=576,framerate=25/1}
FRAMES=${FRAMES:-50}
# In a source tree, the plugin is that of its build.
here=$(dirname "$(readlink -f "$0")")
export GST_PLUGIN_PATH="${GST_PLUGIN_PATH-$here/../build/gst}"

exec gst-launch-1.0 -e \
  codedexposure-camerasrc camera-name="$CAMERA" trigger=dmd \
  ! "video/x-raw,$FORMAT" \
  ! dmdsync schedule="$SCHEDULE" device="$DEVICE" timestamp-at=device-clock \
  ! identity eos-after=$((FRAMES + 1)) \
  ! queue max-size-buffers=75 max-size-bytes=0 max-size-time=0 leaky=downstream \
  ! codedexposure-recordmux log-location="${OUTPUT%.mkv}.jsonl" \
  ! filesink location="$OUTPUT"
