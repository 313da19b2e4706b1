/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as the JSON of the tags that a stream or a file carries. */
#include "fuzz_check.h"
#include "record/provenance.h"
#include "setup/stream_setup.h"

using namespace codedexposure;
using namespace codedexposure::test;

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  const std::string_view text = text_of (data, size);
  check_json (StreamSetup::from_json (text));
  const auto provenance = Provenance::from_json (text);
  check_json (provenance);
  if (provenance)
    check (Error{provenance->text ()});
  return 0;
}
