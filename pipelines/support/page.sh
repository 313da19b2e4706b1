# shellcheck shell=bash disable=SC2154 # out, scratch ...: of those who source it
# SPDX-License-Identifier: LGPL-2.1-or-later
# Writes the page of pipelines/report, which sources this.

# Larger tables are linked as files beside the page, not put into it.
page_max_csv=1000000

escaped ()
{
  sed 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g; s/"/\&quot;/g' <<< "$1"
}

# picture FILE TEXT CLASS [OVERLAY]: FILE is a PNG or a GIF.
picture ()
{
  printf '<figure class="%s"><div><img alt="%s" src="data:image/%s;base64,' \
    "$3" "$(escaped "$2")" "${1##*.}"
  base64 -w0 "$1"
  printf '">%s</div><figcaption>%s</figcaption></figure>\n' "${4:-}" \
    "$(escaped "$2")"
}

# csv_link NAME: a link to a table of $out.
csv_link ()
{
  local table=$scratch/linked.csv
  # Lists of a picture are in the file only.
  cut -d, -f1-10 "$out/$1" > "$table"
  printf '<a download="%s" href="' "$1"
  if [ "$(stat -c %s "$table")" -le "$page_max_csv" ]; then
    printf 'data:text/csv;base64,'
    base64 -w0 "$table"
  else
    printf '%s' "$1"
  fi
  printf '">%s</a>' "$1"
}

# The line of the profiles, as an overlay for a picture.
line_over ()
{
  awk -v line="${opt[line]:-row:50%}" 'BEGIN {
    y1 = x1 = 100
    gsub(/%/, "", line)
    if (sub(/^row:/, "", line)) y0 = y1 = line
    else if (sub(/^column:/, "", line)) x0 = x1 = line
    else { split(line, p, "/"); x0 = p[1]; y0 = p[2]; x1 = p[3]; y1 = p[4] }
    printf "<svg viewBox=\"0 0 100 100\" preserveAspectRatio=\"none\">" \
      "<line x1=\"%g\" y1=\"%g\" x2=\"%g\" y2=\"%g\"/></svg>", x0, y0, x1, y1 }'
}

# A table of the figures of the frame and its subframes.
table ()
{
  printf '<div class="table"><table><tr><th></th><th>time (s)</th>'
  printf '<th>mean (DN)</th><th>min</th><th>max</th><th>entropy (bits)</th>'
  printf '<th>saturated</th></tr>\n'
  awk -F, '{ printf "<tr><th>%s</th><td>%.6f</td><td>%.2f</td><td>%d</td>" \
      "<td>%d</td><td>%.3f</td><td>%.2f %%</td></tr>\n",
      NR == 1 ? "coded frame" : "I<sub>" $2 + 1 "</sub>", $3 / 1e9, $4, $5, $6,
      $7, 100 * $8 / $9 }' "$scratch/shown.csv"
  printf '</table></div>\n'
}

# row NAME TEXT: a line of the head.
row ()
{
  printf '<dt>%s</dt><dd>%s</dd>\n' "$1" "$(escaped "$2")"
}

# What was recorded, how it was decoded, and how it is shown.
head_of_page ()
{
  local coded subframe measured
  coded=$(size_of "$(first_picture "$out/coded")")
  subframe=$(size_of "$(first_picture "$out/subframes")")
  printf '<dl>\n'
  row Schedule "$(schedule_of_pictures)${opt[schedule]:+ (--schedule)}"
  row 'Coded frames' "$(($(wc -l < "$out/coded.csv") - 1)) of ${coded/ /x} \
pixels, $(significant_bits) bits, $(rate_text 1) frames/s"
  row Subframes "$slots for each coded frame, ${subframe/ /x} pixels, \
$(rate_text "$slots") subframes/s"
  row Method "$(provenance_of_pictures method) (--method ${opt[method]:-auto})"
  [ -z "$(provenance_of_pictures simulated)" ] \
    || row Source 'simulated bench; no camera recorded this'
  measured=$(provenance_of_pictures measured)
  [ -z "$measured" ] || row Bench "profile measured $measured"
  row Losses "$(losses)"
  row Shown "coded frame $(cut -d, -f1 < "$scratch/rows.csv" | head -n 1), from \
$(seconds "$shown") s on"
  row Contrast "$(contrast)"
  printf '<dt>Numbers</dt><dd>%s</dd>\n' \
    "$(csv_link coded.csv) $(csv_link subframes.csv) $(csv_link profiles.csv)"
  row 'Made by' "$script of $("$tool" --version)"
  printf '</dl>\n'
}

# style COLUMNS SHAPE: of a grid with that many columns, and pictures of that
# shape.
style ()
{
  cat "$pipelines/support/page.css" - << END
.grid{display:grid;gap:8px;align-content:start;grid-template-columns:
  repeat(auto-fill,minmax(max(84px,calc((100% - $((8 * ($1 - 1)))px)/$1)),1fr))}
.frame img{display:block;aspect-ratio:$2}
END
}

# Pictures per row, for a layout that is as square as possible.
columns ()
{
  awk -v n="$slots" 'BEGIN { c = int(sqrt(n)); print c + (c * c < n) }'
}

pictures_of_page ()
{
  local k=0 file times
  mapfile -t times < <(awk -F, 'NR > 1 { printf "%.6f s\n", $3 / 1e9 }' \
    "$scratch/shown.csv")
  printf '<h2>One coded frame and its subframes</h2><div class="%s">\n' \
    "$([ "$slots" -le 16 ] && echo pair || echo many)"
  picture "$(first_picture "$out/coded")" \
    'Coded frame; dashed: the line of the profiles' frame "$(line_over)"
  printf '<div class="grid">\n'
  for file in "$out"/subframes/*.png; do
    picture "$file" "I$((k + 1)), ${times[k]}" frame
    k=$((k + 1))
  done
  printf '</div></div>\n<h2>In slow motion</h2>\n'
  picture "$out/animation.gif" "The subframes one after the other, \
$slow_motion times slower than they were exposed" 'frame one slow'
  if [ -f "$out/regions.png" ]; then
    printf '<h2>Regions</h2>\n'
    picture "$out/regions.png" \
      'Each part separately, and all parts in one picture' 'plot wide'
  fi
}

plots_of_page ()
{
  printf '<h2>Intensity over subframes</h2><div class="pair">\n'
  picture "$out/intensity.png" \
    'Mean pixel value of every picture; the frame shown above is marked.' plot
  picture "$out/intensity-frame.png" 'Mean pixel values of that frame.' plot
  printf '</div>\n'
  printf '<h2>Line profiles</h2>\n'
  picture "$out/profile.png" \
    "Pixel values along ${opt[line]:-row:50%}, from the first to the last." \
    'plot one'
  printf '<h2>Entropy</h2><div class="pair">\n'
  picture "$out/entropy.png" \
    'Shannon entropy of the grey levels; exposure and noise increase it as well.' \
    plot
  picture "$out/entropy-frame.png" 'Entropy of that frame.' plot
  printf '</div>\n'
  printf '<h2>Figures of the frame</h2>\n'
  table
}

page ()
{
  local title badge='' shape
  title=$(escaped "$(basename "$recording")")
  shape=$(size_of "$(first_picture "$out/coded")")
  [ -z "$(provenance_of_pictures simulated)" ] \
    || badge=' <span class="badge">simulated</span>'
  cat << END
<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>$title</title>
<meta name="viewport" content="width=device-width,initial-scale=1">
<style>$(style "$(columns)" "${shape/ //}")
.slow{max-width:$((${slow_shape%/*} * 3 / 2))px} .slow img{aspect-ratio:$slow_shape;image-rendering:auto}</style></head><body>
<h1>$title$badge</h1>
END
  head_of_page
  pictures_of_page
  plots_of_page
  printf '</body></html>\n'
}
