/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Decodes coded frames without GStreamer:
 *   decode SCHEDULE WIDTH HEIGHT < coded.raw > subframes.raw
 * Pixels have 8 bits; rows, and the subframes of a frame, follow each other. */
#include <cstdlib>
#include <iostream>

#include <extract/extractor.h>
#include <schedule/schedule.h>

using namespace codedexposure;

int
main (int argc, char **argv)
{
  const auto fail = [] (const Error &error) {
    std::cerr << "decode: " << error.message << '\n';
    return error.code == ErrorCode::out_of_memory ? 3 : 1;
  };
  const auto schedule = Schedule::parse (argc > 1 ? argv[1] : "");
  if (!schedule)
    return fail (schedule.error ());
  const int width = argc > 2 ? std::atoi (argv[2]) : 768;
  const int height = argc > 3 ? std::atoi (argv[3]) : 576;
  const auto extractor =
      Extractor<std::uint8_t>::make (*schedule, width, height);
  if (!extractor)
    return fail (extractor.error ());

  const Extent size = extractor->subframe_size ();
  Image<std::uint8_t> coded (width, height);
  Image<std::uint8_t> subframes (
      size.width, size.height * extractor->subframes ());
  std::vector<ImageView<std::uint8_t>> views;
  for (int k = 0; k < extractor->subframes (); k++)
    views.push_back (subframes.view ().rows (k * size.height, size.height));

  char *const in = reinterpret_cast<char *> (coded.view ().data);
  const char *const out = reinterpret_cast<char *> (subframes.view ().data);
  while (std::cin.read (in, std::streamsize (width) * height)) {
    if (const auto report = extractor->run (coded.view (), views); !report)
      return fail (report.error ());
    std::cout.write (out, std::streamsize (size.width) * subframes.height ());
  }
  return std::cout.flush () ? 0 : 1;
}
