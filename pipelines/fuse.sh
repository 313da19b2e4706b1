#!/bin/bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Decodes a recording to full-size frames at N times the frame rate, without loss.
# docs/fusion.md explains it; with comfort: codedexposure decode --fuse.
INPUT=${1:-coded.mkv}
OUTPUT=${2:-fused.mkv}
QUALITY=${QUALITY:-balanced}
# In a source tree, the plugin is that of its build.
here=$(dirname "$(readlink -f "$0")")
export GST_PLUGIN_PATH="${GST_PLUGIN_PATH-$here/../build/gst}"

exec gst-launch-1.0 -e \
  filesrc location="$INPUT" ! codedexposure-recorddemux ! queue \
  ! codedexposure-fuse quality="$QUALITY" lookahead=1 require-schedule=true ! queue \
  ! avenc_ffv1 gop-size=1 slices=4 threads=auto ! matroskamux timecodescale=1000 \
  ! filesink location="$OUTPUT"
