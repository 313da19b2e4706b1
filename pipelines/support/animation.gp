# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the subframes of a frame one after the other, for pipelines/report:
#   gnuplot -c animation.gp LIST OUT.gif WIDTH HEIGHT CENTISECONDS
# LIST has a line for each subframe: its PNG file, its columns and rows, and its
# caption, with tabs between. WIDTH x HEIGHT is the size of the pictures, without
# the caption below; each is shown for CENTISECONDS.

list = ARG1
width = int(ARG3)
height = int(ARG4)
caption = 30
set terminal gif animate delay int(ARG5) loop 0 size width,height + caption \
    font "DejaVu Sans,13" background "#ffffff"
set output ARG2
set datafile separator "\t"
stats list using 0 nooutput
n = int(STATS_records)
array file[n]
array columns[n]
array rows[n]
array words[n]
set table $ignored
plot [] [0:1] list using (file[$0 + 1] = strcol(1), columns[$0 + 1] = $2, \
    rows[$0 + 1] = $3, words[$0 + 1] = strcol(4), $0):(0)
unset table

unset key
unset tics
unset border
unset colorbox
set lmargin at screen 0
set rmargin at screen 1
set tmargin at screen 1
set bmargin at screen real(caption) / (height + caption)
do for [k = 1:n] {
  set xrange [-0.5:columns[k] - 0.5]
  set yrange [-0.5:rows[k] - 0.5]
  set label 1 words[k] at screen 0.01, screen 0.5 * caption / (height + caption) \
      noenhanced front
  plot file[k] binary filetype=png with rgbimage
}
