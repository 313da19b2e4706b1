# shellcheck shell=bash disable=SC2034 # most of this is used by the tests
# SPDX-License-Identifier: LGPL-2.1-or-later
# A test of scripts: what it checks it says in TAP. Sourced by tests/pipeline/*;
# such a test ends with done_testing.

set -uo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
export CODEDEXPOSURE_BUILD=${CODEDEXPOSURE_BUILD:-$root/build}
scripts=$root/pipelines
PATH=$CODEDEXPOSURE_BUILD/app:$PATH
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cases=0

# What a command says goes to this file, and into the report when it fails.
said=$scratch/said

verdict ()
{
  cases=$((cases + 1))
  printf '%s %d - %s\n' "$1" "$cases" "$2"
}

# check NAME COMMAND...: COMMAND succeeds.
check ()
{
  local name=$1
  shift
  if "$@" >"$said" 2>&1; then
    verdict ok "$name"
  else
    verdict 'not ok' "$name"
    printf '# %s\n' "command: $*"
    sed 's/^/# /' "$said"
  fi
}

# check_status NAME STATUS COMMAND...: COMMAND ends with that status.
check_status ()
{
  local name=$1 expected=$2 status=0
  shift 2
  "$@" >"$said" 2>&1 || status=$?
  if [ "$status" = "$expected" ]; then
    verdict ok "$name"
  else
    verdict 'not ok' "$name"
    printf '# command: %s\n# status %d, not %d\n' "$*" "$status" "$expected"
    sed 's/^/# /' "$said"
  fi
}

# wait_for_bytes FILE: until it has some.
wait_for_bytes ()
{
  for _ in {1..3000}; do
    [ ! -s "$1" ] || return 0
    sleep 0.02
  done
  return 1
}

# check_said NAME REGEX: the command before this said so.
check_said ()
{
  if grep -qE -e "$2" "$said"; then
    verdict ok "$1"
  else
    verdict 'not ok' "$1"
    printf '# nothing like "%s" in:\n' "$2"
    sed 's/^/# /' "$said"
  fi
}

# check_unsaid NAME REGEX: and did not say this. "$said" is empty while check and
# check_status run their command, so a grep there finds nothing.
check_unsaid ()
{
  if grep -qE -e "$2" "$said"; then
    verdict 'not ok' "$1"
    sed 's/^/# /' "$said"
  else
    verdict ok "$1"
  fi
}

skip ()
{
  verdict ok "$1 # SKIP $2"
}

done_testing ()
{
  printf '1..%d\n' "$cases"
  exit 0
}

# camera_file IN OUT OPTION...: a copy with the times of a camera's recording.
camera_file ()
{
  "$CODEDEXPOSURE_BUILD/tests/pipeline/camera_file" "$@"
}

# Runs a pipeline, quietly.
play ()
{
  "$CODEDEXPOSURE_BUILD/tests/pipeline/play" "$*"
}

# The pixels of a recording, one after the other.
raw_frames_of ()
{
  play "filesrc location=$1 ! matroskademux ! avdec_ffv1 ! filesink location=$2"
}

# Frame numbers and times of a sidecar, a line each.
times_of ()
{
  sed -nE 's/.*"frame":([0-9]+),"pts_ns":([0-9]+).*/\1 \2/p' "$1"
}

export GST_PLUGIN_PATH_1_0=$CODEDEXPOSURE_BUILD/gst
export GST_REGISTRY_1_0=$CODEDEXPOSURE_BUILD/registry.bin
export GST_PLUGIN_PATH_1_0 GST_REGISTRY_1_0
