# shellcheck shell=bash disable=SC2034,SC2154 # shared with common.sh and scripts
# SPDX-License-Identifier: LGPL-2.1-or-later
# Where coded frames come from: scene and simulated bench, or a camera with a DMD.
# Sourced by common.sh.

# Options of the scene and the bench, and of the coded stream's source.
scene_options='input input-rate scene pattern size frame-rate bits'
bench_options='schedule bench psf-sigma full-well read-noise gain seed shift-x shift-y
  rotation scale'
source_options="$scene_options $bench_options frames camera features source
  device exposure trigger trigger-line trigger-edge pixel-format reconnect"

patterns='ball bar black blink blue checkers-1 checkers-2 checkers-4 checkers-8
chroma-zone-plate circular colors gamut gradient green pinwheel red smpte
smpte-rp-219 smpte100 smpte75 snow solid-color spokes white zone-plate'
patterns=${patterns//$'\n'/ }

scene_help='Scene (each frame is one slot of the exposure):
  --input FILE        video file; each frame becomes one slot
  --input-rate R      frame rate of the input, if the file does not have one
  --scene NAME        a drawn scene: candle, blown-out or pour
  --pattern NAME      a moving test picture, as of videotestsrc [ball]
  --size WxH          size of scene and camera [that of the input; 768x576]
  --bits N            significant bits of the camera, 8 or 9..16 [8]'
bench_help='Bench:
  --schedule S        CODE:TILE[,key=value...] or a JSON file [sequential:2x2]
  --frame-rate R      coded frames/s, such as 25 or 30000/1001 [25]
  --frames N          stop after N coded frames
  --bench FILE        bench profile (JSON) of camera and DMD; the simulated
                      bench has its noise, black level, leakage, blur and
                      mapping, recordings carry it, and other options win
  --full-well E       electrons at white, e-; 0: no noise [0]
  --read-noise E      read noise, e- rms [0]
  --psf-sigma P       blur of the lens, pixels [0]
  --gain G            gain; 0: automatic, white maps to the largest value [0]
  --seed N            seed of the noise [0]
  --shift-x P, --shift-y P, --rotation DEG, --scale F   misalignment'
camera_help='Instead of the bench:
  --camera NAME       a GenICam camera, as "gst-device-monitor-1.0 Source/Video"
                      lists it
  --trigger M         which device triggers: dmd, camera, or none [dmd]
  --trigger-line L    line of the camera to or from the DMD [Line0; Line1]
  --trigger-edge E    rising or falling [rising]
  --exposure US       exposure time, microseconds [as the camera has it]
  --pixel-format F    Mono8, Mono12, Mono12Packed ... [Mono8; Mono16]
  --features "A=1 ..."  camera features beyond these
  --reconnect N       tries to restart a camera that went away [0]
  --device DEV        the DMD [sim:bench on the bench]
  --source "GST"      any GStreamer source of coded frames'

schedule ()
{
  printf '%s' "${opt[schedule]:-sequential:2x2}"
}

# Prints a row of the description of the schedule, such as slots or cell.
schedule_row ()
{
  "$tool" schedule show "$(schedule)" | awk -v row="$1" '$1 == row { print $2 }'
}

grey_format ()
{
  if [ "${opt[bits]:-8}" -gt 8 ] || [ "${opt[pixel-format]:-Mono8}" != Mono8 ]; then
    printf GRAY16_LE
  else
    printf GRAY8
  fi
}

grey_bytes ()
{
  [ "$(grey_format)" = GRAY8 ] && printf 1 || printf 2
}

# Prints WIDTH HEIGHT NUM DEN of a video file.
probe_video ()
{
  local caps
  [ -r "$1" ] || die "cannot read $1"
  # It is stopped from here: after an early end, a queue may keep the end of the
  # file to itself.
  caps=$(exec 3< <(exec gst-launch-1.0 -v filesrc location="$(quoted "$1")" ! \
      decodebin ! videoconvert name=probe ! fakesink sync=true 2>&1)
    sed -n '/probe.GstPad:sink: caps = /{s/.*caps = //p;q}' <&3
    kill $! 2>/dev/null) || true
  [ -n "$caps" ] || die "$1 is no video that the installed decoders can read"
  sed -E 's/.*width=\(int\)([0-9]+).*height=\(int\)([0-9]+).*framerate=\(fraction\)([0-9]+)\/([0-9]+).*/\1 \2 \3 \4/' \
    <<< "$caps"
}

# Prints a row of the description of the bench profile, such as size or bits.
bench_row ()
{
  "$tool" bench show "${opt[bench]}" | sed -n "s/^$1  *//p"
}

# Frames are those of the bench profile, where no option says otherwise.
use_bench ()
{
  "$tool" bench show "${opt[bench]}" >/dev/null \
    || usage_error "--bench ${opt[bench]} is not valid"
  is_set size || opt[size]=$(bench_row size)
  is_set bits || opt[bits]=$(bench_row bits)
  ! is_set camera || is_set pixel-format \
    || opt[pixel-format]=$(bench_row 'pixel format')
  ! is_set source || is_set device || is_set schedule || usage_error \
    "--bench with --source needs --schedule, or --device for the DMD"
}

# Sets slots, width and height, and the fractions frame_rate and scene_rate (N
# times frame_rate).
plan_scene ()
{
  ! is_set bench || use_bench
  slots=$(schedule_row slots) || usage_error "--schedule $(schedule) is not valid"
  frame_rate=${opt[frame-rate]:-25}
  [[ $frame_rate == */* ]] || frame_rate=$frame_rate/1
  scene_rate=$((${frame_rate%/*} * slots))/${frame_rate#*/}
  width=768 height=576
  ! is_set input || ! is_set scene \
    || usage_error "--input and --scene exclude each other; use one of them"
  if is_set input; then
    local facts num den
    facts=$(probe_video "${opt[input]}")
    read -r width height num den <<< "$facts"
    input_rate=${opt[input-rate]:-$num/$den}
    [[ $input_rate == */* ]] || input_rate=$input_rate/1
    [ "${input_rate%/*}" != 0 ] \
      || usage_error "${opt[input]} has no fixed frame rate; set --input-rate"
  fi
  if is_set size; then
    width=${opt[size]%x*} height=${opt[size]#*x}
  fi
  local cell
  cell=$(schedule_row cell)
  if [ "$width" -lt "${cell%x*}" ] || [ "$height" -lt "${cell#*x}" ]; then
    usage_error "${width}x$height pixels are less than one exposure group of" \
      "$(schedule), $cell; set a larger --size"
  fi
}

# The scene at N times the frame rate; "live": in real time.
scene ()
{
  local caps
  caps="video/x-raw,format=$(grey_format),width=$width,height=$height"
  caps+=",framerate=$scene_rate"
  if is_set input; then
    # Every frame of the file becomes one slot, so its times are scaled.
    # videorate counts them from 0, and not every file begins at 0.
    local speed
    speed=$(awk -v s="$scene_rate" -v i="$input_rate" 'BEGIN {
      split(s, a, "/"); split(i, b, "/")
      printf "%.12g", a[1] * b[2] / (a[2] * b[1]) }')
    printf 'filesrc location=%s ! decodebin ! videoconvert ! videoscale ! ' \
      "$(quoted "${opt[input]}")"
    printf 'identity single-segment=true ! videorate rate=%s ! %s ! ' \
      "$speed" "$caps"
    [ "${1:-}" != live ] || printf 'clocksync ! '
    printf 'queue ! '
  elif is_set scene; then
    printf 'codedexposure-scene scene=%s %s! %s ! ' "${opt[scene]}" \
      "${scene_repeat:+repeat=$scene_repeat }" "$caps"
    [ "${1:-}" != live ] || printf 'clocksync ! '
    printf 'queue ! '
  else
    printf 'videotestsrc pattern=%s %s ! %s ! ' \
      "$(quoted "${opt[pattern]:-ball}")" \
      "$([ "${1:-}" != live ] || echo is-live=true)" "$caps"
  fi
}

# Ends the stream after --frames coded frames. identity also counts the frame
# that it refuses; codedexposure-launch ends the stream before that one is made.
frame_limit ()
{
  ! is_set frames \
    || printf 'identity name=limit eos-after=%d ! ' $((opt[frames] + 1))
}

# The simulated bench; its masks come from the schedule.
simulation ()
{
  scene "$@"
  printf 'codedexposure-sim name=bench schedule=%s %s ! ' \
    "$(quoted "$(schedule)")" \
    "$(properties bench psf-sigma full-well read-noise bits gain seed \
      shift-x shift-y rotation scale)"
  printf 'video/x-raw,framerate=%s ! ' "$frame_rate"
}

# Prints "live" if frames come in real time and do not wait; a source may be a
# file.
pace_of_frames ()
{
  is_set source || printf live
}

# Coded frames of a camera, of any source, or of the bench with its DMD.
coded_source ()
{
  if is_set camera; then
    printf 'codedexposure-camerasrc camera-name=%s trigger=%s ' \
      "$(quoted "${opt[camera]}")" "${opt[trigger]:-dmd}"
    ! is_set exposure || printf 'exposure-time=%s ' "${opt[exposure]}"
    properties trigger-line trigger-edge pixel-format features reconnect bench
    printf 'source::num-arv-buffers=150 ! video/x-raw,format=%s,' "$(grey_format)"
    printf 'width=%d,height=%d,framerate=%s ! ' "$width" "$height" "$frame_rate"
  elif is_set source; then
    printf '%s ! ' "${opt[source]}"
  else
    simulation "$@" | sed 's/codedexposure-sim /&dmd=sim:bench /'
  fi
  # The frames of a user's source may already have a schedule and times.
  if ! is_set source || is_set device || is_set schedule; then
    local device=${opt[device]:-} timestamps=''
    is_set camera || is_set source || device=${device:-sim:bench}
    ! is_set camera || timestamps='timestamp-at=device-clock '
    printf 'dmdsync name=sync device=%s schedule=%s %s%s! ' \
      "$(quoted "$device")" "$(quoted "$(schedule)")" "$timestamps" \
      "$(properties bench)"
  fi
  frame_limit
}
