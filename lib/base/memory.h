/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The memory of the machine. */
#pragma once

#include <cstdint>

namespace codedexposure
{

/** A quarter of the memory that is free now, at most 4 GB, in bytes. */
std::uint64_t room_in_memory ();

} // namespace codedexposure
