#!/bin/bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Records what send.sh sends from another machine. docs/record.md explains it; with
# a window: codedexposure receive.
HOST=${1:-127.0.0.1} # the sender
PORT=${2:-5000}
OUTPUT=${3:-received.mkv}
# In a source tree, the plugin is that of its build.
here=$(dirname "$(readlink -f "$0")")
export GST_PLUGIN_PATH="${GST_PLUGIN_PATH-$here/../build/gst}"

exec gst-launch-1.0 -e \
  tcpclientsrc host="$HOST" port="$PORT" ! codedexposure-recorddemux \
  ! queue max-size-buffers=50 max-size-bytes=0 max-size-time=0 \
  ! codedexposure-recordmux ! filesink location="$OUTPUT"
