# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the figures of pipelines/report:
#   gnuplot -c figures.gp FOLDER SUBFRAMES FROM TO
# FOLDER contains the first columns of the files of subframestats: coded.csv,
# subframes.csv and shown.csv (the coded frame to show, then its subframes); and
# profiles.csv, one block of position,value for each row of shown.csv. FROM and TO
# are the times of that frame in s. The pictures are written into the folder.

folder = ARG1
n = int(ARG2)
from = real(ARG3)
to = real(ARG4)
set datafile separator ","
file(name) = folder . "/" . name

# Early subframes are dark, late ones light.
set palette defined (0 "#2c115f", 0.35 "#932667", 0.7 "#ed6925", 1 "#f4c13c")
unset colorbox
shade(k) = n > 1 ? (k - 1.0) / (n - 1) : 0.0
coded = "#4a7ebb"
set style line 1 lc rgb coded lw 2
set border 3
set tics nomirror out
set grid ytics lc rgb "#dddddd"
set key outside below horizontal samplen 2
set bmargin 5.5
step = n > 20 ? 8 : (n > 8 ? 2 : 1)

# Two panels: the whole recording, and one frame.
set terminal pngcairo size 1200,440 font "DejaVu Sans,11" background "white"
do for [figure in "intensity entropy"] {
  field = figure eq "intensity" ? 4 : 7
  label = figure eq "intensity" ? "mean pixel value" : "entropy (bits per pixel)"
  set output file(figure . ".png")
  set multiplot layout 1,2
  set yrange [*:*]
  set offsets graph 0, graph 0, graph 0.08, graph 0.08
  set ylabel label
  set xlabel "time, middle of the exposure (s)"
  set xrange [*:*]
  set xtics auto
  set key on
  unset label
  set object 1 rectangle from from, graph 0 to to, graph 1 \
      fc rgb "#fff0cc" fs solid noborder behind
  set title "The whole recording"
  plot file("subframes.csv") every ::1 using ($3 / 1e9 + (to - from) / 2 / n):(column(field)) \
          with lines lc rgb "#d65f2b" lw 1 title "subframes", \
      file("coded.csv") every ::1 using ($3 / 1e9 + (to - from) / 2):(column(field)) \
          with points ls 1 pt 7 ps 0.5 title "coded frames"
  unset object 1
  set title "The coded frame and its subframes"
  set yrange [0:*]
  set offsets graph 0, graph 0, graph 0.08, graph 0
  set xlabel "subframe"
  set xrange [-0.6:n + 0.6]
  set xtics ("coded" 0)
  do for [k = 1:n:step] { set xtics add (sprintf("I_{%d}", k) k) }
  set boxwidth 0.7
  set style fill solid 0.9 noborder
  unset key
  plot file("shown.csv") every ::0::0 using (0):(column(field)) with boxes \
          lc rgb coded, \
      for [k = 1:n] file("shown.csv") every ::k::k using (k):(column(field)) \
          with boxes lc palette frac shade(k), \
      file("shown.csv") \
          using 0:(column(field)):(sprintf(n <= 8 ? "%.2f" : "", column(field))) \
          with labels offset 0,0.7 font ",9"
  unset multiplot
}

set terminal pngcairo size 1200,480 font "DejaVu Sans,11" background "white"
set output file("profile.png")
set offsets 0, 0, 0, 0
set title "Profiles along the line: the coded frame and its subframes"
set xlabel "position along the line (pixels of the coded frame)"
set ylabel "pixel value (DN)"
set xrange [*:*]
set yrange [0:*]
set xtics auto
set key on
plot file("profiles.csv") index 0 using 1:2 with lines lc rgb "#c8c8c8" lw 1 \
        title "coded", \
    for [k = 1:n] file("profiles.csv") index k using 1:2 with lines lw 2 \
        lc palette frac shade(k) title ((k - 1) % step ? "" : sprintf("I_{%d}", k))
