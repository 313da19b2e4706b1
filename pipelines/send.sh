#!/bin/bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Sends coded frames of the simulated bench to receive.sh on another machine, with
# all that is known of them. docs/record.md explains it; with comfort:
# codedexposure send.
HOST=${1:-127.0.0.1} # address of this machine; 0.0.0.0: all of its networks
PORT=${2:-5000}
SIZE=${SIZE:-width=768,height=576}
FRAMES=${FRAMES:-250}
# In a source tree, the plugin is that of its build.
here=$(dirname "$(readlink -f "$0")")
export GST_PLUGIN_PATH="${GST_PLUGIN_PATH-$here/../build/gst}"

exec gst-launch-1.0 -e \
  videotestsrc pattern=ball is-live=true \
  ! "video/x-raw,format=GRAY8,$SIZE,framerate=100/1" \
  ! codedexposure-sim dmd=sim:bench ! video/x-raw,framerate=25/1 \
  ! dmdsync device=sim:bench ! identity eos-after=$((FRAMES + 1)) ! queue \
  ! codedexposure-recordmux streamable=true codec=raw \
  ! tcpserversink host="$HOST" port="$PORT" sync-method=burst-keyframe \
      burst-format=buffers burst-value=50 buffers-min=100 buffers-max=500
