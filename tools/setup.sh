# shellcheck shell=bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Installs what is missing and builds; sourced by pipelines/demo, tools/package
# and tests/run.
#
#   install_packages PURPOSE     Debian packages for one of these: build, run,
#                                tests, rivals, package, check
#   install_beside PURPOSE       the same while the rest of a shell goes on; then
#                                wait_for_packages
#   configure_tree DIR OPTION... meson setup
#   compile_tree DIR TARGET...   these, or all
#   build_tree DIR OPTION...     both, all
#   sample_video                 in sample.sh
#
# Nothing here asks the network for what is already there.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cache=$root/build/cache
# shellcheck source-path=SCRIPTDIR source=sample.sh
. "$root/tools/sample.sh"

# package|what it is for|which purposes need it; the build is part of all
packages='
meson|configures the build (brings ninja)|build
g++|compiles C++20|build
pkg-config|finds the libraries|build
libgstreamer1.0-dev|GStreamer core and its test harness|build
libgstreamer-plugins-base1.0-dev|GStreamer video library|build
nlohmann-json3-dev|reads and writes JSON (schedules, tracks)|build
libcairo2-dev|draws over pictures: calibration, window|build
libx11-dev|the screen of the window|build
libusb-1.0-0-dev|DMD boards on the USB|build
libeigen3-dev|linear algebra of estimates and calibrations|build
libxxhash-dev|hashes of recorded frames|build
libcli11-dev|options of the command-line tool|build
gstreamer1.0-tools|gst-launch-1.0, gst-inspect-1.0|run
gstreamer1.0-plugins-base|test scenes, conversion, TCP, compositor|run
gstreamer1.0-plugins-good|Matroska, AVI, PNG, window and its texts|run
gstreamer1.0-plugins-bad|parses H.264 in tests|tests
gstreamer1.0-plugins-ugly|H.264 encoder|run
gstreamer1.0-libav|FFV1, and decoding most video files|run
gstreamer1.0-x|windows under X, text in pictures|run
parallel|decodes archives on the cores of a machine|tests
slurm-wlm|a Slurm of their own for the tests of archives|tests
munge|authentication of that Slurm|tests
libgtest-dev|unit and element tests|tests
libbenchmark-dev|benchmarks|tests
libumockdev-dev|an emulated USB, for a DMD in software|tests package
libtiff-dev|decode to OME-TIFF|tests package
libhdf5-dev|decode to HDF5|tests package
libzstd-dev|decode to OME-Zarr|tests package
zstd|reads compressed OME-Zarr, to test it|tests
python3-tifffile|reads OME-TIFF, to test it|tests
python3-h5py|reads HDF5, to test it|tests
libaravis-dev|the emulated camera, and aravissrc|tests package
iproute2|the private network of the emulated camera|tests
umockdev|an emulated USB, for a DMD in software|tests package
xvfb|a virtual screen for the window tests|tests
xdotool|presses keys in the window tests|tests
shellcheck|checks the scripts|tests
pybind11-dev|the Python library for single arrays|tests package
python3-dev|the Python library for single arrays|tests package
python3-gi|GStreamer in the Python package|tests
python3-numpy|frames of the Python package|tests
python3-venv|installs the Python package, to test it|tests
python3-wheel|builds the Python package, to test it|tests
build-essential|flags and programs of Debian packages|tests package
debhelper|steps of building a Debian package|package
dh-python|Debian package of the Python package|package
lintian|checks Debian packages|check
libopencv-dnn-dev|runs the refinement of fusion, for comparison|tests
libopencv-video-dev|calibration with OpenCV, for comparison|rivals
'

give_up ()
{
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# usage_error WHAT: of the script that sourced this.
usage_error ()
{
  printf '%s: %s\nTry: %s --help\n' "$(basename "$0")" "$*" "$0" >&2
  exit 2
}

is_installed ()
{
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

# Packages that a purpose needs and that are missing, a line each: name|reason.
missing_packages ()
{
  local name reason purposes needed=$1
  case $1 in
    tests) needed='run|tests' ;;
    rivals) needed="run|$1" ;;
    check) needed='package|check' ;;
  esac
  while IFS='|' read -r name reason purposes; do
    if [[ " $purposes " =~ " "(build|$needed)" " ]]; then
      is_installed "$name" || printf '%s|%s\n' "$name" "$reason"
    fi
  done <<< "$packages"
}

as_root ()
{
  if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

# Turns apt's status messages into one line every ten percent.
show_apt_progress ()
{
  local kind percent last=-10
  while IFS=: read -r kind _ percent _; do
    percent=${percent%%.*}
    case $kind-$percent in
      dlstatus-[0-9]* | pmstatus-[0-9]*) ;;
      *) continue ;;
    esac
    [ "$percent" -ge "$last" ] || last=-10
    if [ "$percent" -ge $((last + 10)) ]; then
      last=$((percent / 10 * 10))
      if [ "$kind" = dlstatus ]; then
        note "downloading: $last %"
      else
        note "installing: $last %"
      fi
    fi
  done
}

apt_install ()
{
  # apt's status goes to a descriptor that is opened here, as sudo closes all.
  # shellcheck disable=SC2016
  as_root env DEBIAN_FRONTEND=noninteractive sh -c '
    exec 3>&1 >"$0" 2>&1
    exec apt-get install -y --no-install-recommends -o APT::Status-Fd=3 "$@"
  ' "$cache/apt.log" "$@" </dev/null | show_apt_progress
  return "${PIPESTATUS[0]}"
}

install_packages ()
{
  local missing names
  if ! command -v dpkg-query >/dev/null; then
    note "this is no Debian: install what these are called here, if needed:"
    awk -F'|' 'NF { printf "     %-34s %s\n", $1, $2 }' <<< "$packages" >&2
    return
  fi
  missing=$(missing_packages "$1")
  [ -n "$missing" ] || return 0

  note "these Debian packages are missing, and will be installed:"
  awk -F'|' '{ printf "     %-34s %s\n", $1, $2 }' <<< "$missing" >&2
  mapfile -t names < <(cut -d'|' -f1 <<< "$missing")
  apt_get "${names[@]}"
}

# Most packages are needed only to run, and dpkg uses one processor: they are
# installed while what the demo needs is compiled.
install_beside ()
{
  install_packages build
  install_packages "$1" &
  packages_job=$!
}

wait_for_packages ()
{
  wait "$packages_job" || exit
}

# apt_get OPTION-OR-NAME-OR-FILE...: installs packages, with new package lists if
# need be.
apt_get ()
{
  local name names=()
  for name; do
    [[ $name == */* || $name == -* ]] || names+=("$name")
  done
  [ "$(id -u)" = 0 ] || command -v sudo >/dev/null || give_up "this needs root," \
    "and there is no sudo. As root, run:" \
    "apt-get install --no-install-recommends $*"
  mkdir -p "$cache"
  # A log that root made could not be written below.
  rm -f "$cache/apt.log"
  : > "$cache/apt.log"
  # A new system has no package lists, and old lists name files that are gone.
  if { [ ${#names[@]} -gt 0 ] && ! apt-cache show "${names[@]}"; } >/dev/null 2>&1 \
      || ! apt_install "$@"; then
    note "reading the package lists"
    as_root apt-get update -qq >"$cache/apt.log" 2>&1 || {
      cat "$cache/apt.log" >&2
      give_up "apt-get update failed; is there a network?"
    }
    apt_install "$@" || {
      tail -n 20 "$cache/apt.log" >&2
      give_up "apt-get failed; all it said is in $cache/apt.log"
    }
  fi
}

# Configures a build folder, or changes the options of one.
configure_tree ()
{
  local dir=$1
  shift
  if [ ! -f "$dir/build.ninja" ] || [ ! -f "$dir/meson-private/coredata.dat" ]; then
    note "configuring $dir"
    mkdir -p "$cache"
    meson setup "$dir" "$root" "$@" >"$cache/meson.log" 2>&1 || {
      cat "$cache/meson.log" >&2
      give_up "meson setup failed"
    }
  elif [ $# -gt 0 ]; then
    meson configure "$dir" "$@" >/dev/null
  fi
}

compile_tree ()
{
  meson compile -C "$@" || give_up "the build failed"
}

# What records and decodes.
compile_demo ()
{
  note "building $1: what records and decodes"
  compile_tree "$1" gstcodedexposure app/codedexposure:executable
}

build_tree ()
{
  configure_tree "$@"
  note "building $1"
  compile_tree "$1"
}
