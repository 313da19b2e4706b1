#!/bin/bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Decodes a recording to subframes, without loss. docs/decode.md explains it; with
# comfort: codedexposure decode.
INPUT=${1:-coded.mkv}
OUTPUT=${2:-subframes.mkv}
METHOD=${METHOD:-auto}
# In a source tree, the plugin is that of its build.
here=$(dirname "$(readlink -f "$0")")
export GST_PLUGIN_PATH="${GST_PLUGIN_PATH-$here/../build/gst}"

exec gst-launch-1.0 -e \
  filesrc location="$INPUT" ! codedexposure-recorddemux ! queue \
  ! codedexposure-demux method="$METHOD" require-schedule=true ! queue \
  ! avenc_ffv1 gop-size=1 slices=4 threads=auto ! matroskamux timecodescale=1000 \
  ! filesink location="$OUTPUT"
