# shellcheck shell=bash disable=SC2034 # most of this is used by the scripts
# SPDX-License-Identifier: LGPL-2.1-or-later
# Options, search for the plugin, and parts of pipelines that the scripts share.
# Sourced; a script defines usage () first.

set -euo pipefail

script=$(basename "$0")
pipelines=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)
# shellcheck source-path=SCRIPTDIR source-path=SCRIPTDIR/support source=source.sh
. "$pipelines/support/source.sh"

window_help='Keys in the window:
  Space           pause at the subframe that is shown; again: live
  Left, Right     pause, and go one subframe back or forward
  L               loop the last second at 1/4 speed; again: live
  S               write what is shown to the current folder, but replace no
                  file: '$script'-frameN-slotK-TIMEs.png
  Q               end, as Ctrl-C does
The stream does not wait for the window: recording and counting go on in a pause
or loop, and subframes are skipped if the screen is too slow. The window keeps
the pictures of about one second, 8 bits deep and at most as large as shown:
25 MB for 768x576 pixels at 25 frames/s, and N times 14 MB more if fused.'
force_help='  --force             replace files that exist
'
common_help='  --print             print the pipeline and do not run it
  --verbose           also print messages and counters of the elements
  -h, --help          show this help'

say ()
{
  printf '%s: %s\n' "$script" "$*" >&2
}

die ()
{
  say "$*"
  exit 1
}

# The command that runs another script, in the form of the call of this one.
sibling ()
{
  if [[ $script == codedexposure-* ]]; then
    printf 'codedexposure-%s' "$1"
  else
    printf '%s/%s' "$(dirname "$0")" "$1"
  fi
}

usage_error ()
{
  say "$*"
  printf 'Try: %s --help\n' "$0" >&2
  exit 2
}

declare -A opt=()
args=()

# parse_options "NAMES THAT TAKE A VALUE" "FLAGS" "$@"
# fills opt[NAME] (a flag: 1) and args. With command_follows set, the first word
# that is not an option begins a command, and its options are not parsed.
parse_options ()
{
  local valued=" ${1//$'\n'/ } " flags=" $2 print verbose help " name
  shift 2
  while [ $# -gt 0 ]; do
    case $1 in
      -h | --help)
        usage
        exit 0
        ;;
      --)
        shift
        args+=("$@")
        return
        ;;
      --*)
        name=${1#--}
        name=${name%%=*}
        if [[ $valued == *" $name "* ]]; then
          if [[ $1 == *=* ]]; then
            opt[$name]=${1#*=}
          else
            [ $# -gt 1 ] || usage_error "--$name needs a value"
            opt[$name]=$2
            shift
          fi
        elif [[ $flags == *" $name "* && $1 != *=* ]]; then
          opt[$name]=1
        else
          usage_error "unknown option $1"
        fi
        ;;
      -?*) usage_error "unknown option $1" ;;
      *)
        if [ -n "${command_follows:-}" ]; then
          args+=("$@")
          return
        fi
        args+=("$1")
        ;;
    esac
    shift
  done
}

is_set ()
{
  [ -n "${opt[$1]:-}" ]
}

# check_option NAME REGEX "WHAT IT MUST BE"
check_option ()
{
  ! is_set "$1" || [[ ${opt[$1]} =~ ^($2)$ ]] \
    || usage_error "--$1 must be $3, not ${opt[$1]}"
}

check_options ()
{
  local name
  check_option size '[1-9][0-9]{0,4}x[1-9][0-9]{0,4}' 'WIDTHxHEIGHT'
  check_option frame-rate '[1-9][0-9]{0,6}(/[1-9][0-9]{0,6})?' \
    'a rate such as 25 or 30000/1001'
  check_option input-rate '[1-9][0-9]{0,6}(/[1-9][0-9]{0,6})?' \
    'a rate such as 25 or 30000/1001'
  check_option frames '[1-9][0-9]{0,8}' 'a number of coded frames'
  check_option bits '[1-9]|1[0-6]' 'a number from 1 to 16'
  check_option white '[1-9][0-9]{0,4}' 'a pixel value from 1 on'
  check_option pattern "${patterns// /|}" "one of $patterns"
  check_option region '[0-9]{1,2}' 'the number of a region, from 0 on'
  check_option scene 'candle|blown-out|pour' 'candle, blown-out or pour'
  check_option codec 'raw|ffv1|auto' 'ffv1, raw or auto'
  check_option port '[1-9][0-9]{0,4}' 'a TCP port'
  check_option wait '[0-9]+(\.[0-9]+)?' 'a number of seconds'
  check_option start '[0-9]+(\.[0-9]+)?' 'a number of seconds'
  check_option duration '[0-9]+(\.[0-9]+)?' 'a number of seconds'
  check_option excerpt '[0-9]+(\.[0-9]+)?-([0-9]+(\.[0-9]+)?)?' \
    'FROM-UNTIL in seconds, such as 10-20 or 10-'
  check_option threads '[1-9]|[1-5][0-9]|6[0-4]' 'a number from 1 to 64'
  check_option jobs '[1-9][0-9]{0,2}' 'a number from 1 to 999'
  check_option fuse 'fast|balanced|best|learned' \
    'fast, balanced, best or learned'
  check_option trigger 'dmd|camera|none' 'dmd, camera or none'
  check_option trigger-edge 'rising|falling' 'rising or falling'
  check_option reconnect '[0-9]{1,9}' 'a number of tries'
  check_option exposure '[0-9]*\.?[0-9]+' 'a time in microseconds'
  check_option pixel-format 'Mono(8|16|1[02](Packed|p)?)' \
    'Mono8, Mono16, Mono10 or Mono12, these also with Packed or p'
  check_option method 'auto|rank|select|decode' 'auto, rank, select or decode'
  for name in psf-sigma full-well read-noise gain scale; do
    check_option "$name" '[0-9]*\.?[0-9]+' 'a number of at least 0'
  done
  for name in shift-x shift-y rotation; do
    check_option "$name" '-?[0-9]*\.?[0-9]+' 'a number'
  done
  check_option seed '[0-9]+' 'a whole number'
}

# Prints the folder of the installed programs: this one or, for the scripts of a
# source tree, that of the same version among the user's commands.
installed_programs ()
{
  local folder=$pipelines version
  if [ ! -x "$folder/codedexposure-launch" ]; then
    version=$(sed -nE "s/^ *version: '([^']+)'.*/\1/p" "$pipelines/../meson.build") \
      && [ "$(codedexposure --version 2>/dev/null)" = "codedexposure $version" ] \
      || return
    folder=$(readlink -f "$(command -v codedexposure)")
    folder=$(dirname "$(dirname "$folder")")/libexec/gst-codedexposure
  fi
  [ -x "$folder/codedexposure-launch" ] && printf '%s' "$folder"
}

# Finds the plugin and the programs: in the build tree beside this folder, or
# where they were installed.
find_plugin ()
{
  local build=${CODEDEXPOSURE_BUILD:-$pipelines/../build}
  local installed prefix libs='' folder
  if [ -e "$build/gst/libgstcodedexposure.so" ]; then
    build=$(cd "$build" && pwd)
    launcher=$build/pipelines/codedexposure-launch
    tool=$build/lib/tools/codedexposure
    camera_program=$build/pipelines/codedexposure-camera
    libs=$build/gst
    export GST_REGISTRY_1_0=$build/registry.bin
  elif installed=$(installed_programs); then
    prefix=$installed/../..
    launcher=$installed/codedexposure-launch
    tool=$prefix/bin/codedexposure
    camera_program=$installed/codedexposure-camera
    for folder in "$prefix"/lib{,/*}/gstreamer-1.0; do
      [ ! -e "$folder/libgstcodedexposure.so" ] || libs=$folder
    done
  else
    die "the plugin is not built; run $pipelines/demo, or" \
      "meson setup build && meson compile -C build"
  fi
  # The guard that stops a board.
  export CODEDEXPOSURE_TOOL=${CODEDEXPOSURE_TOOL:-$tool}
  # GStreamer finds a plugin in its own folder without this path.
  [ -z "$libs" ] || export \
    GST_PLUGIN_PATH_1_0="$libs${GST_PLUGIN_PATH_1_0:+:$GST_PLUGIN_PATH_1_0}"
}

# need_program PROGRAM [PACKAGE]: ends with the remedy if PROGRAM was not built,
# for which PACKAGE may be missing.
need_program ()
{
  [ -x "$1" ] || die "$(basename "$1") was not built;" \
    "${2:+install $2 and }run meson compile -C build"
}

# run COMMAND...: the signals that end this script end COMMAND, which finishes
# its files. They arrive as SIGTERM, since a terminal sends its own to both.
run ()
{
  local child status
  "$@" <&0 &
  child=$!
  # shellcheck disable=SC2064 # the child of now
  trap "stopped=1; kill -TERM $child 2>/dev/null || true" INT TERM HUP
  while
    status=0
    wait "$child" 2>/dev/null || status=$?
    kill -0 "$child" 2>/dev/null
  do :; done
  wait "$child" 2>/dev/null || status=$?
  trap - INT TERM HUP
  return "$status"
}

# run_step COMMAND...: the same for one of several; a signal ends the script.
run_step ()
{
  run "$@" || return
  [ -z "${stopped:-}" ] || die stopped
}

# launch OPTION... PIPELINE: sets no_frame if it failed because none arrived.
launch ()
{
  local status=0
  if is_set print; then
    printf 'gst-launch-1.0 -e %s\n' "$(tr -s ' \n' '  ' <<< "${*: -1}")"
    exit 0
  fi
  run "$launcher" --what="$script" ${opt[force]:+--force} \
    ${opt[verbose]:+--verbose} ${opt[camera]:+--camera} "$@" || status=$?
  [ "$status" -le 128 ] || say "the pipeline was ended by" \
    "SIG$(kill -l "$status"); what it wrote is in files that end in .part," \
    "which can be renamed and used"
  no_frame=
  if [ "$status" = 5 ]; then
    no_frame=1 status=1
  fi
  return "$status"
}

# A text as a value in a pipeline.
quoted ()
{
  local text=${1//\\/\\\\}
  printf '"%s"' "${text//\"/\\\"}"
}

# NAME=VALUE for each of the named options that is set.
properties ()
{
  local name
  for name in "$@"; do
    ! is_set "$name" || printf '%s=%s ' "$name" "$(quoted "${opt[$name]}")"
  done
}

# The file with the metadata of a recording.
sidecar_of ()
{
  printf '%s.jsonl' "${1%.mkv}"
}

# Pixels and bytes depend on the slices, not on the threads.
ffv1_encoder ()
{
  printf 'avenc_ffv1 gop-size=1 slices=4 threads=%s' \
    "${opt[threads]:-auto}"
}

# is_raw RECORDING: whether its frames are not compressed.
is_raw ()
{
  LC_ALL=C grep -qa V_UNCOMPRESSED <(head -c 100000 "$1")
}

# Prints how many frames, and how many bytes, may wait for encoder and disk: 3 s,
# and a quarter of the memory.
buffer_limits ()
{
  local rate=${frame_rate:-25/1} free
  free=$(awk '$1 == "MemAvailable:" { print $2 * 256 }' /proc/meminfo)
  awk -v num="${rate%/*}" -v den="${rate#*/}" -v bytes="${free:-1000000000}" 'BEGIN {
    frames = 3 * num / den
    printf "max-size-buffers=%d max-size-bytes=%.0f max-size-time=0",
      (frames < 75 ? 75 : frames), (bytes > 4e9 ? 4e9 : bytes) }'
}

# Prints the bytes of a raw recording whose length and frame size are known; else
# nothing.
raw_size ()
{
  is_set frames || return 0
  is_set size || ! is_set source || return 0
  # A frame has a line in the track and an entry in the index.
  printf 'reserve=%d ' $((opt[frames] * (width * height * $(grey_bytes) + 4096)))
}

# coded_recording FILE [CODEC [live]]: writes coded frames to Matroska, as FFV1 or raw,
# with the track of what is known of each frame, and the same to the sidecar.
# Every frame can be decoded alone; with ticks of 1 µs it has its own cluster.
# "live": when the buffer is full, frames are dropped, and nothing else waits; the
# oldest, so that the next one that is written shows how many are missing.
coded_recording ()
{
  local encoder='' sink leaky=
  [ "${3:-}" != live ] || leaky='leaky=downstream '
  sink="codedexposure-filesink direct=true $(raw_size)"
  if [ "${2:-ffv1}" = ffv1 ]; then
    encoder="$(ffv1_encoder) !" sink='filesink '
  fi
  printf 'queue name=buffer %s%s ! ' "$leaky" "$(buffer_limits)"
  printf 'codedexposure-log name=log location=%s ! ' \
    "$(quoted "$(sidecar_of "$1")")"
  # Hashes and writes in two threads.
  printf 'queue max-size-buffers=2 max-size-bytes=0 max-size-time=0 ! '
  printf '%s codedexposure-matroskamux name=mux ! ' "$encoder"
  printf '%slocation=%s ' "$sink" "$(quoted "$1")"
  printf 'log.track ! queue max-size-buffers=0 max-size-time=0 ! mux.subtitle_0 '
}

# read_container SOURCE: the coded frames of a recording or of a sender, with
# what its track says of them.
read_container ()
{
  printf '%s ! matroskademux name=file ! decodebin ! ' "$1"
  printf 'codedexposure-restore name=restore file.subtitle_0 ! restore.track '
  printf 'restore. ! '
}

# launch_decoder FILE OPTION... PIPELINE reads FILE from front to back, if its
# index is damaged; PIPELINE has @source@ for the source of the recording.
launch_decoder ()
{
  local file=$1 pipeline=${*: -1} source status=0
  source="filesrc location=$(quoted "$file")"
  set -- "${@:2:$#-2}"
  launch "$@" "${pipeline/@source@/$source}" || status=$?
  [ "$status" = 6 ] || return "$status"
  say "the index or the tags of $file are damaged; reading it from front to back"
  launch --salvage "$@" "${pipeline/@source@/$source ! queue name=file-queue}"
}

lossless_video ()
{
  printf '%s ! ' "$(ffv1_encoder)"
  printf 'matroskamux timecodescale=1000 ! filesink location=%s ' \
    "$(quoted "$1")"
}

# Scales frames of any bit depth to 8 bits, for display.
for_display ()
{
  printf 'codedexposure-view %s! ' "$(properties bits white)"
}

# check_recording FILE: whether it is what record writes.
check_recording ()
{
  local codec
  if [ ! -f "$1" ] || [ ! -r "$1" ]; then
    die "cannot read $1; give the name of a recording"
  fi
  [ "$(head -c 4 "$1" | od -An -tx1)" = ' 1a 45 df a3' ] \
    || die "$1 is not a Matroska file; use a recording of" \
      "$(sibling record) or $(sibling simulate)"
  # The names of its codecs are at its beginning.
  codec=$(head -c 100000 "$1" | LC_ALL=C grep -aoE '[VA]_[A-Z0-9/_]{3,30}|FFV1' \
    | tr '\n' ' ') || true
  [ -z "$codec" ] || [[ $codec == *FFV1* || $codec == *V_UNCOMPRESSED* ]] \
    || die "$1 has ${codec% }, but coded frames are recorded as FFV1 or raw; use" \
      "a recording of $(sibling record) or $(sibling simulate)"
}

# check_recording_name OPTION: whether its value can be written.
check_recording_name ()
{
  [[ ${opt[$1]} == *.mkv ]] || usage_error "--$1 ${opt[$1]}: coded frames are" \
    "recorded in Matroska; end the name in .mkv"
}

# Writes frames to a file by its ending: FFV1, H.264, a stack, or a folder of
# PNG. PNG keeps the pixel values, unless view is set.
video_output ()
{
  case $1 in
    *.mkv) lossless_video "$1" ;;
    *.mp4)
      # All players and browsers support 4:2:0 with even sides and values from
      # 16 to 235. From grey, videoconvert would not scale the values, so they
      # go through colour, with 16 bits for exact values. All other modes of
      # x264 spend less on pictures that follow each other fast, but these are
      # looked at one by one. The fragments of a file that was not finished can
      # be played. Its bytes depend on the number of threads, so that is fixed.
      # A video to look at begins at 0; its provenance names its first frame.
      printf 'identity name=from-zero-%s silent=true ! ' "${1//[^a-zA-Z0-9]/-}"
      for_display
      printf 'videoconvert ! video/x-raw,format=ARGB64 ! videoconvert ! '
      printf 'videoscale ! %s ! ' \
        'video/x-raw,format=I420,width=[2,65536,2],height=[2,65536,2]'
      printf 'x264enc pass=quant quantizer=18 vbv-buf-capacity=0 '
      printf 'speed-preset=veryfast threads=4 ! mp4mux fragment-duration=1000 '
      printf 'fragment-mode=first-moov-then-finalise ! filesink location=%s ' \
        "$(quoted "$1")"
      ;;
    *.ome.tif | *.ome.tiff | *.h5)
      gst-inspect-1.0 codedexposure-stack > /dev/null 2>&1 || die "$1:" \
        "this build has neither libtiff nor HDF5; install libtiff-dev and" \
        "libhdf5-dev, and build again"
      printf 'codedexposure-stack %slocation=%s ' \
        "${opt[deflate]:+deflate=true }" "$(quoted "$1")"
      ;;
    */ | *%d*.png | *%0[1-9]d*.png)
      # A folder may have any name; only the last part is a format.
      local pattern=$1
      [[ $1 != */ ]] || pattern=${1//%/%%}%06d.png
      ! is_set view || for_display
      # Without these caps, videoconvert makes 8-bit colours of 16-bit grey.
      printf 'videoconvert ! video/x-raw,format={GRAY8,GRAY16_BE} ! '
      printf 'pngenc snapshot=false ! '
      printf 'multifilesink location=%s ' "$(quoted "$pattern")"
      ;;
    *)
      usage_error "--output $1: end in .mkv (FFV1, lossless), .mp4 (H.264)," \
        ".ome.tif, .h5, / (a folder of PNG) or %06d.png"
      ;;
  esac
}

# The output must not be the input, which would be replaced by itself.
check_output ()
{
  local read
  for read in "${opt[input]:-}" "${args[@]}"; do
    [ -z "$read" ] || [ ! "$1" -ef "$read" ] \
      || usage_error "$1 is the input; use another name for the output"
  done
}

# A folder with files is only used with --force.
check_folder ()
{
  [ ! -e "$1" ] || [ -d "$1" ] || die "$1 is a file; name a folder"
  is_set force || [ -z "$(ls -A "$1" 2>/dev/null)" ] \
    || die "$1 is not empty; choose another folder, or set --force to replace" \
      "what an earlier run has written"
}

# claim_folder FOLDER: sets claimed to FOLDER.part, which is empty and which no
# other run writes. publish_folder moves its content to FOLDER.
claim_folder ()
{
  check_folder "$1"
  claimed=$1.part
  # awk takes an argument with a = for a variable, unless it is a path.
  [[ $claimed == /* ]] || claimed=./$claimed
  mkdir -p "$claimed" || die "cannot write $1; choose a folder that you can write to"
  exec {claim}< "$claimed"
  flock -n "$claim" || die "another run is writing $1; choose another folder," \
    "or wait for its end"
  find "$claimed" -mindepth 1 -delete
}

publish_folder ()
{
  local folder=${claimed%.part} table
  mkdir -p "$folder"
  # Pictures of an earlier run that the new ones would not replace.
  for table in "$folder"/*/times.csv; do
    [ ! -e "$table" ] || (cd "$(dirname "$table")" \
      && cut -d, -f1 times.csv | grep -xE '[0-9]+\.png' | xargs -r rm -f)
  done
  cp -r "$claimed/." "$folder/"
  rm -r "$claimed"
}

# pane PAD NAME NUMBER FRAMES: a pane of the window shows the frames of PAD. The
# first queue never blocks their source; the second one skips frames for which
# the screen is too slow, when codedexposure-launch has remembered them.
pane ()
{
  local latest='leaky=downstream max-size-bytes=0 max-size-time=0'
  latest+=" max-size-buffers=$4"
  printf '%s ! queue name=%s %s ! ' "$1" "$2" "$latest"
  printf 'codedexposure-view name=%s-view qos=false %s! ' "$2" \
    "$(properties bits)"
  printf 'videoscale method=bilinear2 add-borders=false qos=false ! '
  printf 'capsfilter name=%s-kept ! queue name=%s-late %s ! ' "$2" "$2" "$latest"
  printf 'videoscale name=%s-enlarge method=nearest-neighbour ' "$2"
  printf 'add-borders=false ! capsfilter name=%s-shown ! videoconvert ! ' "$2"
  printf 'video/x-raw,format=BGRx ! view.sink_%d ' "$3"
}

# display CODED FAST [FULL]: shows the frames of two or three pads beside each
# other. codedexposure-launch sets the sizes and draws captions and panel.
display ()
{
  local k
  pane "$1" beside 0 4
  pane "$2" fast 1 $((2 * slots))
  [ $# = 2 ] || pane "$3" full 2 $((2 * slots))
  printf 'compositor name=view background=black '
  for ((k = 0; k < $#; k++)); do
    printf 'sink_%d::xpos=%d sink_%d::width=%d sink_%d::height=%d ' \
      $k $((k * width)) $k "$width" $k "$height"
  done
  # No screen shows more; fewer would make keys slow.
  printf '! capsfilter name=window '
  printf 'caps="video/x-raw,format=BGRx,framerate=[25/1,100/1]" ! '
  printf 'cairooverlay name=panel ! queue max-size-buffers=4 ! '
  printf 'videoconvert ! %s ' \
    "${opt[sink]:-autovideosink}"
}

need_display ()
{
  if [ -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] && ! is_set sink; then
    die "no screen: DISPLAY is not set. Run this in a desktop session or" \
      "through ssh -X, or record and decode instead."
  fi
}
