/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Owners of what libraries in C make. */
#pragma once

namespace codedexposure
{

/** For std::unique_ptr: lets the function @p Free of the library free it. */
template <auto Free>
struct FreeWith {
  void operator() (auto *object) const { Free (object); }
};

} // namespace codedexposure
