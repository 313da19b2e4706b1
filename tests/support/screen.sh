# shellcheck shell=bash disable=SC2154 # scratch: of tap.sh
# SPDX-License-Identifier: LGPL-2.1-or-later
# A screen for the tests of windows; sourced after tap.sh.

# Starts an X server of that size and sets DISPLAY; fails when there is none.
start_screen ()
{
  command -v Xvfb >/dev/null || return 1
  mkfifo "$scratch/display"
  # A server that resets when its last client leaves refuses those that come.
  Xvfb -displayfd 3 -screen 0 "$1x24" -noreset -nolisten tcp \
    3>"$scratch/display" >"$scratch/xvfb.log" 2>&1 &
  screen=$!
  trap 'kill "$screen"; wait "$screen" 2>/dev/null; rm -rf "$scratch"' EXIT
  local number
  read -r -t 30 number < "$scratch/display" || return 1
  export DISPLAY=:$number
  unset WAYLAND_DISPLAY
}

# photograph FILE WIDTH HEIGHT: the upper left part of the screen, 3 bytes a
# pixel.
photograph ()
{
  play "ximagesrc num-buffers=1 use-damage=false show-pointer=false endx=$(($2 - 1))
    endy=$(($3 - 1)) ! videoconvert ! video/x-raw,format=BGR !
    filesink location=$1" >/dev/null 2>&1
}
