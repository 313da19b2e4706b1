#!/bin/bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Shows gratings on the DMD of the simulated bench, and writes the mapping from
# pixels to mirrors. docs/align.md explains it; with comfort:
# codedexposure calibrate.
OUTPUT=${1:-mapping.json}
SINK=${SINK:-autovideosink}
MODE=${MODE:-map} # as the bench stands; auto: shows how to align it before
WIDTH=${WIDTH:-384} HEIGHT=${HEIGHT:-288} FRAMES=${FRAMES:-400}
# In a source tree, the plugin is that of its build.
here=$(dirname "$(readlink -f "$0")")
export GST_PLUGIN_PATH="${GST_PLUGIN_PATH-$here/../build/gst}"

exec gst-launch-1.0 -e \
  videotestsrc pattern=white is-live=true \
  ! "video/x-raw,format=GRAY8,width=$WIDTH,height=$HEIGHT,framerate=100/1" \
  ! codedexposure-sim dmd=sim:bench psf-sigma=0.5 full-well=10000 read-noise=5 \
      gain=3.2 shift-x=0.4 shift-y=-0.3 rotation=0.5 scale=1.01 \
  ! video/x-raw,framerate=25/1 ! dmdsync device="sim:bench,size=${WIDTH}x$HEIGHT" \
  ! identity eos-after=$((FRAMES + 1)) \
  ! moirecalib mode="$MODE" location="$OUTPUT" \
  ! queue max-size-buffers=2 leaky=downstream ! codedexposure-view ! videoconvert \
  ! "$SINK"
