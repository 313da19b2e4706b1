/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What decoded pictures say of how they were made. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/result.h"
#include "setup/stream_setup.h"

namespace codedexposure
{

/** Of a stream of pictures that were made from coded frames. */
struct Provenance {
  StreamSetup setup;
  std::string method; ///< "select", "decode", "rank", "fuse fast" ...
  std::uint64_t first_frame = 0; ///< coded frame of the first picture
  int first_slot = 0;

  /** One line. docs/formats.md, "Provenance". */
  std::string to_json () const;
  static Result<Provenance> from_json (std::string_view json);

  /** "subframes of sequential:2x2 by select": for messages. */
  std::string text () const;

  bool operator== (const Provenance &) const = default;
};

} // namespace codedexposure
