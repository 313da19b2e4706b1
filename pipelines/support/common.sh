# shellcheck shell=bash disable=SC2034 # most of this is used by the scripts
# SPDX-License-Identifier: LGPL-2.1-or-later
# Options, search for the plugin, and parts of pipelines that the scripts share.
# Sourced; a script defines usage () first.

set -euo pipefail

script=$(basename "$0")
pipelines=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)

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
  if [[ $1 == @(bench|decode|pack|record|simulate) ]]; then
    printf 'codedexposure %s' "$1"
  elif [[ $script == codedexposure-* ]]; then
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
  if [ ! -x "$folder/codedexposure-examine" ]; then
    version=$(sed -nE "s/^ *version: '([^']+)'.*/\1/p" "$pipelines/../meson.build") \
      && [ "$(codedexposure --version 2>/dev/null)" = "codedexposure $version" ] \
      || return
    folder=$(readlink -f "$(command -v codedexposure)")
    folder=$(dirname "$(dirname "$folder")")/libexec/gst-codedexposure
  fi
  [ -x "$folder/codedexposure-examine" ] && printf '%s' "$folder"
}

# Finds the plugin and the programs: in the build tree beside this folder, or
# where they were installed.
find_plugin ()
{
  local build=${CODEDEXPOSURE_BUILD:-$pipelines/../build}
  local installed prefix libs='' folder
  if [ -e "$build/gst/libgstcodedexposure.so" ]; then
    build=$(cd "$build" && pwd)
    examine_program=$build/pipelines/codedexposure-examine
    program=$build/app/codedexposure
    tool=$build/app/codedexposure
    libs=$build/gst
    export GST_REGISTRY_1_0=$build/registry.bin
  elif installed=$(installed_programs); then
    prefix=$installed/../..
    examine_program=$installed/codedexposure-examine
    program=$prefix/bin/codedexposure
    tool=$prefix/bin/codedexposure
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

# A folder with files is only used with --force.
check_folder ()
{
  [ ! -e "$1" ] || [ -d "$1" ] || die "$1 is a file; name a folder"
  is_set force || [ -z "$(ls -A "$1" 2>/dev/null)" ] \
    || die "$1 is not empty; choose another folder, or set --force to replace" \
      "what an earlier run has written"
}

