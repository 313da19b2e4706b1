# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws quality.png from the tables of ../quality.md:
#   cd docs/figures && gnuplot quality.gp
# Needs Debian's gnuplot-nox.

# Cells of a table as tab-separated lines, without its head.
table(id) = sprintf("< awk '/<!-- table %s -->/ { on = 1 } /<!-- end -->/ " . \
    "{ on = 0 } on && /^\\|/ { if (++row > 2) { gsub (/^\\| *| *\\|$/, \"\"); " . \
    "gsub (/ *\\| */, \"\\t\"); print } }' ../quality.md", id)

set terminal pngcairo size 1200,460 font "DejaVu Sans,11" background "white"
set output "quality.png"
set datafile separator "\t"
set multiplot layout 1,2

set title "PSNR of subframes, noisy (dB)"
set style fill solid 0.8 border -1
set xrange [0:48]
set yrange [8.6:-0.6]
set grid xtics
unset key
plot table("point-noisy") every ::0::8 using (column(9) / 2):0:( \
        column(9) / 2):(0.35):ytic(sprintf("%s  %s", strcol(1), strcol(2))) \
        with boxxyerrorbars lc rgb "#4a7ebb", \
    "" every ::0::8 using (column(9) + 0.8):0:(sprintf("%.1f", column(9))) \
        with labels left font ",10"

set title "Ranks of a staircase, static scenes (noisy)"
set xrange [0.7:4.3]
set yrange [0:160]
set ytics 0, 20
set y2range [0:8]
set ytics nomirror
set y2tics
unset grid
set ylabel "mean pixel value"
set y2label "entropy (bits)"
set xtics ("I1" 1, "I2" 2, "I3" 3, "I4" 4)
set key top left font ",9"
row(scene) = sprintf("%s | awk -F '\\t' '$1 ~ /^%s/ && $2 ~ /noisy/ " . \
    "{ for (k = 1; k <= 4; k++) print k \"\\t\" $(2 + k) \"\\t\" $(6 + k) }'", \
    table("still"), scene)
plot for [scene in "vtest runner40"] row(scene) using 1:2 \
        with linespoints pt 7 lw 2 title scene . ", mean grey", \
    for [scene in "vtest runner40"] row(scene) using 1:3 axes x1y2 \
        with linespoints pt 6 dt 2 lw 2 title scene . ", entropy"
