/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Masks for a ViALUX board, which another program shows: its library is closed.
 *
 * Facts of the ALP-4 interface: its public header, as in ALP4lib
 * (https://github.com/wavefrontshaping/ALP4lib). */
#pragma once

#include <string>

#include "base/result.h"
#include "dmd/bytes.h"
#include "dmd/dmd.h"
#include "dmd/erle.h"

namespace codedexposure
{

/** A sequence of pictures that repeats for ever, one for each mask, with a
 * pulse to the camera at the first one of each exposure. */
struct AlpSequence {
  int pictures = 0; ///< of the pattern
  int slots = 0;    ///< pictures of an exposure, 1 to 16
  int period = 0;   ///< of a picture, us
};

/** The masks of a schedule in the slots of @p plan, on the board @p info. Error
 * if check_limits () has one. */
Result<AlpSequence> alp_sequence (
    const DmdInfo &info, const Schedule &schedule, const SlotPlan &plan);

/** Appends a mask as a bit plane: rows from the top, each a whole number of
 * bytes, whose highest bit is the left mirror. */
void append_bit_plane (Bytes &planes, const MirrorRows<std::uint8_t> &mirrors);

/** A Python program that shows @p sequence, with ALP4lib and the library of the
 * board, until it is interrupted.
 * @p planes  name of the file that has its pictures, in the same folder.
 * @p what  the schedule and the rate, for people. */
std::string alp_script (const AlpSequence &sequence, Extent size,
    const std::string &planes, const std::string &what);

} // namespace codedexposure
