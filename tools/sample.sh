# shellcheck shell=bash disable=SC2154 # cache: of those who source it
# SPDX-License-Identifier: LGPL-2.1-or-later
# Fetches the sample clip into the folder $cache. Sourced by setup.sh and by
# pipelines/demo.

note ()
{
  printf '== %s\n' "$*" >&2
}

# Prints the path of vtest.avi: 768x576, 795 frames of people walking. It lies
# in opencv-doc, which is 270 MB installed, so only this file is taken out of
# the package. Fails if it is not available.
sample_video ()
{
  local name=vtest.avi where=usr/share/doc/opencv-doc/examples/data deb
  for path in "$cache/$name" "/$where/$name"; do
    if [ -f "$path" ]; then
      printf '%s\n' "$path"
      return
    fi
  done
  note "fetching the sample clip $name out of the package opencv-doc (96 MB)"
  mkdir -p "$cache/deb"
  (cd "$cache/deb" && apt-get download -qq opencv-doc) >"$cache/deb.log" 2>&1 \
    || return 1
  for deb in "$cache"/deb/opencv-doc_*.deb; do
    dpkg-deb --fsys-tarfile "$deb" \
      | tar -x -C "$cache" --transform 's,.*/,,' "./$where/$name" || return 1
  done
  rm -r "$cache/deb"
  printf '%s\n' "$cache/$name"
}
