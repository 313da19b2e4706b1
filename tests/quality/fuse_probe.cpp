#include <chrono>
#include <cstring>
#include <fstream>
#include <cstdio>
#include <cstdlib>
#include "footage.h"
#include "fusion.h"
using namespace cexp; using namespace cexp::quality;
// fuse_probe quality lookahead frames noisy corr contrast [dump]
int main (int argc, char **argv)
{
  auto clips = read_clips ("/work/shared/data", 32);
  FuseOptions o; o.quality = *parse_quality (argv[1]); o.lookahead = atoi (argv[2]);
  int frames = atoi (argv[3]); bool noisy = atoi (argv[4]);
  if (argc > 5) o.scene.plain.correlation = atof (argv[5]);
  if (argc > 6) o.scene.contrast = atof (argv[6]);
  Condition c; if (noisy) { c.electrons = 10000; c.read_noise = 5; o.noise = {10000, 5}; }
  for (const char *p : {"sequential:lattice:4/2", "sequential:lattice:8/3,order=bit-reversal"}) {
    Schedule s = schedule_of (p);
    for (Scene &scene : *clips) {
      Scene part = scene; int n = s.slots ();
      size_t want = std::min<size_t> (frames > 0 ? frames : scene.frames.size (), scene.frames.size ()) / n * n; if (!want) continue;
      part.frames.resize (want);
      auto coded = take (part, s, c);
      auto t0 = std::chrono::steady_clock::now ();
      auto out = fuse (coded, s, o);
      double dt = std::chrono::duration<double> (std::chrono::steady_clock::now () - t0).count ();
      auto m = compare (out, part.frames);
      printf ("n=%d %-20s %.2f / %.4f  %.3fs/coded\n", n, scene.name.c_str (), m.psnr, m.ssim, dt / coded.size ()); fflush (stdout);
      if (argc > 7) for (size_t i = 0; i < out.size (); i++) {
        char name[200]; snprintf (name, 200, "%s/%s_n%d_%02zu.pgm", argv[7], scene.name.c_str (), n, i);
        std::ofstream f (name); f << "P5\n" << out[i].width () << " " << out[i].height () << "\n255\n"; f.write ((const char *) out[i].view ().data, out[i].width () * out[i].height ());
      }
    }
  }
}
