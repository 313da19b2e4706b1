# shellcheck shell=bash disable=SC2154 # scratch: of tap.sh
# SPDX-License-Identifier: LGPL-2.1-or-later
# A screen for the tests of windows; sourced after tap.sh.

screens=()

# Starts an X server of that size and sets DISPLAY; fails when there is none.
start_screen ()
{
  command -v Xvfb >/dev/null || return 1
  rm -f "$scratch/display"
  mkfifo "$scratch/display"
  # A server that resets when its last client leaves refuses those that come.
  Xvfb -displayfd 3 -screen 0 "$1x24" -noreset -nolisten tcp \
    3>"$scratch/display" >"$scratch/xvfb.log" 2>&1 &
  screens+=($!)
  trap 'kill "${screens[@]}"; wait "${screens[@]}" 2>/dev/null; rm -rf "$scratch"' EXIT
  local number
  read -r -t 30 number < "$scratch/display" || return 1
  export DISPLAY=:$number
  unset WAYLAND_DISPLAY
}

# photograph FILE WIDTH HEIGHT TOP: a part of the screen from its left edge, 3
# bytes a pixel.
photograph ()
{
  play "ximagesrc num-buffers=1 use-damage=false show-pointer=false starty=$4
    endx=$(($2 - 1)) endy=$(($3 + $4 - 1)) ! videoconvert ! video/x-raw,format=BGR !
    filesink location=$1" >/dev/null 2>&1
}
