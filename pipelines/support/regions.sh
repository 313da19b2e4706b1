# shellcheck shell=bash disable=SC2154 # out: of those who source it
# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the picture of a frame with regions. Sourced by pipelines/report, after
# figure.sh.

sheet_width=1544 sheet_gap=8 sheet_max=32

# Prints the regions of the schedule, WxH+X+Y each, from the log of the demux.
regions_said_in ()  # regions_said_in LOG
{
  grep 'info: demux: src and the subframe pads' "$1" \
    | grep -oE 'region=[0-9]+x[0-9]+\+[0-9]+\+[0-9]+' | cut -d= -f2
}

size_of ()  # size_of FILE.png: WIDTH HEIGHT
{
  od -An -tu1 -j 16 -N 8 "$1" | awk '{ print $3 * 256 + $4, $7 * 256 + $8 }'
}

# place X Y BRANCH: adds the picture of a branch to the sheet.
place ()
{
  pads+="sink_$placed::xpos=$1 sink_$placed::ypos=$2 "
  branches+="$3 page.sink_$placed "
  placed=$((placed + 1))
}

heading ()  # heading X Y TEXT
{
  place "$1" "$2" "videotestsrc pattern=white num-buffers=1 !
    video/x-raw,width=640,height=28,framerate=1/1 !
    $(write_text "$3" 16px xpad=2 ypad=6 color=0xff202020 draw-outline=false \
      draw-shadow=false)"
}

# Adds all pictures of a folder in rows, with the aspect ratio of a part of the
# frame, and moves bottom below them.
strip ()  # strip FOLDER WIDTH HEIGHT TEXT
{
  local files file columns width height column=0
  mapfile -t files < <(find "$1" -name '*.png' | sort | head -n "$sheet_max")
  columns=$((${#files[@]} < 8 ? ${#files[@]} : 8))
  width=$(((sheet_width - (columns - 1) * sheet_gap) / columns))
  width=$((width < 380 ? width : 380))
  height=$((width * $3 / $2))
  heading 0 "$bottom" "$4"
  bottom=$((bottom + 28))
  for file in "${files[@]}"; do
    if [ "$column" = "$columns" ]; then
      column=0
      bottom=$((bottom + height + sheet_gap))
    fi
    place $((column * (width + sheet_gap))) "$bottom" \
      "$(still "$file") $(magnify_to "$width" "$height")"
    column=$((column + 1))
  done
  bottom=$((bottom + height + sheet_gap))
}

# subframes_in FOLDER RATE: how many there are of a coded frame, and their rate.
subframes_in ()
{
  local count
  count=$(find "$1" -name '*.png' | wc -l)
  awk -v n="$count" -v rate="$2" \
    'BEGIN { printf "%d subframes, %.6g frames/s", n, n * rate }'
}

# draw_regions FILE RATE REGION...: draws the coded frame, the fused frame and the
# subframes of every part, from the folders coded, fused, subframes and region-I
# in $out. RATE: coded frames/s.
draw_regions ()
{
  local file=$1 rate=$2 pads='' branches='' placed=0 bottom frame=() half i=0 rect
  local coded fused w h x y
  coded=$(first_picture "$out/coded")
  fused=$(first_picture "$out/fused")
  shift 2
  read -r -a frame <<< "$(size_of "$fused")"
  half=$(((sheet_width - sheet_gap) / 2))
  bottom=$((28 + half * frame[1] / frame[0]))
  heading 0 0 "One coded frame, $rate frames/s"
  heading $((half + sheet_gap)) 0 "All parts in one picture, \
$(subframes_in "$out/fused" "$rate" | sed 's/.*, //'): first slot, fused; red: regions"
  place 0 28 "$(still "$coded") $(magnify_to "$half" $((bottom - 28)))"
  place $((half + sheet_gap)) 28 \
    "$(still "$fused") $(magnify_to "$half" $((bottom - 28)))"
  for rect; do
    IFS='x+' read -r w h x y <<< "$rect"
    place $((half + sheet_gap + x * half / frame[0] - 2)) \
      $((26 + y * half / frame[0])) \
      "$(still "$fused") videocrop left=$x top=$y \
        right=$((frame[0] - x - w)) bottom=$((frame[1] - y - h)) !
      $(magnify_to $((w * half / frame[0])) $((h * half / frame[0]))) $(red_frame)"
  done
  strip "$out/subframes" "${frame[@]}" "Background: $(subframes_in "$out/subframes" "$rate")"
  for rect; do
    strip "$out/region-$i" "${rect%%x*}" "$(sed 's/.*x//; s/+.*//' <<< "$rect")" \
      "Region $i, $rect: $(subframes_in "$out/region-$i" "$rate")"
    i=$((i + 1))
  done
  play_quietly "compositor name=page background=white $pads !
    videoconvert ! video/x-raw,format=RGB ! pngenc compression-level=9 !
    filesink location=$(quoted "$file") $branches"
}
