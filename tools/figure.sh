# shellcheck shell=bash disable=SC2154 # program, out: of those who source it
# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the picture of pipelines/demo that explains a coded frame, panel by panel
# with GStreamer.

# draw PIPELINE: its words are quoted as in a shell. Prints its log only if it
# fails.
draw ()
{
  local log
  log=$(mktemp)
  eval "gst-launch-1.0 -q ${1//$'\n'/ }" >"$log" 2>&1 || {
    cat "$log" >&2
    rm "$log"
    echo "demo: could not draw the figure; see the log above" >&2
    exit 1
  }
  rm "$log"
}

first_picture ()  # first_picture FOLDER
{
  local files=("$1"/*.png)
  printf '%s' "${files[0]}"
}

# A stream with the picture as its only frame.
still ()
{
  printf 'filesrc location=%q ! pngdec ! videoconvert ! ' "$1"
  printf 'imagefreeze num-buffers=1 ! video/x-raw,framerate=1/1 ! '
}

crop ()  # crop X Y W H of a frame of 768x576
{
  printf 'videocrop left=%d top=%d right=%d bottom=%d ! ' \
    "$1" "$2" $((768 - $1 - $3)) $((576 - $2 - $4))
}

# Magnifies every pixel to a square, to a picture of that size.
magnify_to ()
{
  printf 'videoscale method=nearest-neighbour add-borders=false ! '
  printf 'video/x-raw,width=%d,height=%d,pixel-aspect-ratio=1/1 ! ' "$1" "$2"
}

red_frame ()
{
  printf 'videoconvert ! video/x-raw,format=BGRA ! '
  printf 'videobox top=-2 left=-2 right=-2 bottom=-2 fill=red ! '
}

write_text ()  # write_text TEXT SIZE OPTION...
{
  printf 'videoconvert ! video/x-raw,format=BGRA ! textoverlay text=%q ' "$1"
  printf 'font-desc="DejaVu Sans, %s" halignment=left valignment=top %s ! ' \
    "$2" "${*:3}"
}

# panel FILE HEADING PADS BRANCHES: composes the branches on the pads of a
# compositor named page, under a heading.
panel ()
{
  draw "compositor name=page background=white $3 !
    videoconvert ! video/x-raw,format=BGRA !
    videobox top=-36 left=-6 right=-6 bottom=-6 fill=white !
    $(write_text "$2" 16px xpad=6 ypad=8 color=0xff202020 draw-outline=false \
      draw-shadow=false)
    videoconvert ! video/x-raw,format=RGB ! pngenc ! filesink location=$(printf %q "$1")
    $4"
}

# The positions of four pictures, two by two.
two_by_two ()  # two_by_two WIDTH HEIGHT
{
  printf 'sink_1::xpos=%d sink_2::ypos=%d sink_3::xpos=%d sink_3::ypos=%d' \
    "$1" "$2" "$1" "$2"
}

# Four pictures of a folder, each with a caption.
captioned ()  # captioned FOLDER CAPTION...
{
  local k files=("$1"/*.png)
  for k in 0 1 2 3; do
    still "${files[k]}"
    write_text "${@:k+2:1}" 24px xpad=6 ypad=6 shaded-background=true
    printf 'page.sink_%d ' "$k"
  done
}

# Decodes the pictures of the figure into a folder.
take_pictures ()  # take_pictures FOLDER SECONDS BENCH-OPTION...
{
  local folder=$1 at=$2
  shift 2
  "$program" simulate "$@" --schedule staircase:2x2 \
    --frames "$(awk -v t="$at" 'BEGIN { print int(t * 25 + 1.5) }')" \
    --output "$folder/staircase.mkv"
  "$program" decode "$folder/staircase.mkv" --method rank --start "$at" \
    --duration 0.04 --output "$folder/rank/"
  "$program" decode "$out/coded.mkv" --start "$at" --duration 0.04 \
    --output "$folder/select/" --coded "$folder/coded/"
}

# draw_figure FILE SECONDS X Y BENCH-OPTION...: draws the coded frame of
# $out/coded.mkv at that time, the area around that pixel, its subframes, and
# those of the method of the paper.
draw_figure ()
{
  local file=$1 at=$2 x=$3 y=$4 work
  work=$(mktemp -d)
  take_pictures "$work" "$at" "${@:5}" >"$work/log" 2>&1 || {
    cat "$work/log" >&2
    echo "demo: could not decode the pictures of the figure; see the log above" >&2
    exit 1
  }

  local coded zoom=12 width=64 height=48
  coded=$(first_picture "$work/coded")
  panel "$work/a.png" "One coded frame: 768x576 pixels, exposure 40 ms" \
    "sink_1::xpos=$((x - 2)) sink_1::ypos=$((y - 2))" \
    "$(still "$coded") page.sink_0
     $(still "$coded") $(crop "$x" "$y" $width $height) $(red_frame) page.sink_1"

  local middle_x=$((width * zoom / 2)) middle_y=$((height * zoom / 2))
  panel "$work/b.png" \
    "The red part, magnified: 2x2 pixels of an exposure group, four slots" \
    "sink_1::xpos=$((middle_x - 2)) sink_1::ypos=$((middle_y - 2))" \
    "$(still "$coded") $(crop "$x" "$y" $width $height)
       $(magnify_to $((width * zoom)) $((height * zoom))) page.sink_0
     $(still "$coded")
       $(crop $((x + width / 2)) $((y + height / 2)) 2 2)
       $(magnify_to $((2 * zoom)) $((2 * zoom))) $(red_frame) page.sink_1"

  panel "$work/c.png" \
    "Its four subframes, one every 10 ms (code sequential, method select)" \
    "$(two_by_two 384 288)" \
    "$(captioned "$work/select" '0 ms' '10 ms' '20 ms' '30 ms')"
  panel "$work/d.png" \
    "The method of the paper: code staircase, method rank" \
    "$(two_by_two 384 288)" \
    "$(captioned "$work/rank" 'darkest' 'second' 'third' 'brightest')"

  draw "compositor name=page background=white $(two_by_two 780 618) !
    videoconvert ! video/x-raw,format=RGB ! pngenc compression-level=9 !
    filesink location=$work/page.png
    $(still "$work/a.png") page.sink_0 $(still "$work/c.png") page.sink_1
    $(still "$work/b.png") page.sink_2 $(still "$work/d.png") page.sink_3"
  mv "$work/page.png" "$file"
  rm -r "$work"
}
