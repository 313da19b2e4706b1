# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the figures of pipelines/report:
#   gnuplot -c figures.gp FOLDER SUBFRAMES FROM TO
# FOLDER contains the first columns of the files of subframestats: coded.csv,
# subframes.csv and shown.csv (the coded frame to show, then its subframes); and
# profiles.csv, one block of position,value for each row of shown.csv. FROM and TO
# are the times of that frame in s. The pictures are written into the folder, with
# twice the pixels and the letters of a page, so that a phone shows them legibly.

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
set border 3
set tics nomirror out
set grid ytics lc rgb "#dddddd"
set key outside below horizontal samplen 2
set bmargin 6
step = n > 64 ? 32 : (n > 20 ? 8 : (n > 8 ? 2 : 1))

# The whole recording, and one frame.
set terminal pngcairo size 1180,900 font "DejaVu Sans,26" linewidth 2 \
    background "white"
do for [figure in "intensity entropy"] {
  field = figure eq "intensity" ? 4 : 7
  set ylabel figure eq "intensity" ? "mean pixel value (DN)" \
      : "entropy (bits per pixel)"

  set output file(figure . ".png")
  set title "The whole recording"
  set xlabel "time, middle of the exposure (s)"
  set yrange [*:*]
  set offsets graph 0, graph 0, graph 0.08, graph 0.08
  set xrange [*:*]
  set xtics auto font ",22"
  set key on
  set object 1 rectangle from from, graph 0 to to, graph 1 \
      fc rgb "#fff0cc" fs solid noborder behind
  plot file("subframes.csv") every ::1 using ($3 / 1e9 + (to - from) / 2 / n):(column(field)) \
          with lines lc rgb "#d65f2b" lw 1 title "subframes", \
      file("coded.csv") every ::1 using ($3 / 1e9 + (to - from) / 2):(column(field)) \
          with points lc rgb coded pt 7 ps 1 title "coded frames"
  unset object 1

  set output file(figure . "-frame.png")
  set title "The coded frame and its subframes"
  set xlabel "subframe"
  set yrange [0:*]
  set offsets graph 0, graph 0, graph 0.08, graph 0
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
          using 0:(column(field)):(sprintf(n <= 8 ? "%.4g" : "", column(field))) \
          with labels offset 0,0.7 font ",20"
}

set terminal pngcairo size 1500,960 font "DejaVu Sans,28" linewidth 2 \
    background "white"
set output file("profile.png")
set offsets 0, 0, 0, 0
set title "Profiles along the line"
set xlabel "position along the line (pixels of the coded frame)"
set ylabel "pixel value (DN)"
set autoscale xfix
set xrange [*:*]
set yrange [0:*]
set xtics auto
set key on
plot file("profiles.csv") index 0 using 1:2 with lines lc rgb "#c8c8c8" lw 0.7 \
        title "coded", \
    for [k = 1:n] file("profiles.csv") index k using 1:2 with lines lw 1.2 \
        lc palette frac shade(k) title ((k - 1) % step ? "" : sprintf("I_{%d}", k))
