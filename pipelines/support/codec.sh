# shellcheck shell=bash disable=SC2034,SC2154 # shared with common.sh and scripts
# SPDX-License-Identifier: LGPL-2.1-or-later
# The codec of a recording. Sourced by record.

# FFV1 must be faster than the camera by this factor, because other programs and
# brighter scenes need time as well.
codec_margin=1.5

# ffv1_speed FILE: prints the frames/s of a recording beside FILE as FFV1, of
# noise, which takes longest.
ffv1_speed ()
{
  local file log frames
  file=$(dirname "$1")/.codec-$$.mkv
  # A second at 0.03 GB/s.
  frames=$((30000000 / (width * height * $(grey_bytes))))
  frames=$((frames < 4 ? 4 : frames > 200 ? 200 : frames))
  log=$(timeout --signal=KILL 20 "$launcher" --what=codec --verbose --count=log \
    "videotestsrc num-buffers=1 pattern=snow !
    video/x-raw,format=$(grey_format),width=$width,height=$height,framerate=$frame_rate !
    imagefreeze num-buffers=$frames !
    codedexposure-log name=log location=/dev/null !
    $(ffv1_encoder) ! matroskamux timecodescale=1000 !
    filesink location=$(quoted "$file")" 2>&1 < /dev/null) || true
  rm -f "$file" "$file.part"
  sed -nE 's/.* s, ([0-9.]+) coded frames\/s.*/\1/p' <<< "$log"
}

# disk_speed FILE: prints the bytes/s that the disk of FILE takes, past the page
# cache where its file system can, as raw recordings are written.
disk_speed ()
{
  local file begin how=conv=fdatasync
  file=$(dirname "$1")/.disk-$$
  ! dd if=/dev/zero of="$file" bs=1M count=1 oflag=direct 2>/dev/null || how=oflag=direct
  begin=$(date +%s.%N)
  timeout 5 dd if=/dev/zero of="$file" bs=8M count=32 "$how" 2>/dev/null || true
  awk -v bytes="$(stat -c %s "$file" 2>/dev/null || echo 0)" -v from="$begin" \
    -v to="$(date +%s.%N)" 'BEGIN { printf "%.0f", bytes / (to - from) }'
  rm -f "$file"
}

# choose_codec FILE: sets codec to --codec; auto: to ffv1 if this machine is fast
# enough for it, else to raw.
choose_codec ()
{
  local speed disk needed words
  codec=${opt[codec]:-ffv1}
  [ "$codec" = auto ] || return 0
  ! is_set source || is_set size || usage_error "--codec auto measures with" \
    "frames of the camera; set their --size"
  mkdir -p "$(dirname "$1")" || die "cannot write $1"
  speed=$(ffv1_speed "$1")
  needed=$(awk -v r="$frame_rate" 'BEGIN { split(r, a, "/"); print a[1] / a[2] }')
  words="FFV1 reaches ${speed:-0} frames/s of noise here, and"
  words+=" $codec_margin times the $needed frames/s of the camera"
  if awk -v s="${speed:-0}" -v n="$needed" -v m="$codec_margin" \
    'BEGIN { exit !(s >= m * n) }'; then
    codec=ffv1
    say "codec ffv1: $words are needed"
    return
  fi
  codec=raw
  disk=$(disk_speed "$1")
  say "codec raw: $words would be needed; $(awk -v d="$disk" -v n="$needed" \
    -v b=$((width * height * $(grey_bytes))) 'BEGIN {
      printf "the disk writes %.2f GB/s, and raw frames need %.2f GB/s",
        d / 1e9, n * b / 1e9
      if (d < n * b) printf ", so the buffer will fill: use a faster disk" }')"
}
