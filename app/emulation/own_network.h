/* SPDX-License-Identifier: LGPL-2.1-or-later */
#pragma once

#include "base/result.h"

namespace codedexposure
{

/** Gives this process, which has no second thread yet, a network of its own
 * with only the loopback interface, at 127.0.0.1 to 127.0.0.@p addresses: the
 * search for cameras is a broadcast, which must not leave the machine. Without
 * the rights of root, it also gets a user namespace. */
Result<void> leave_network (int addresses);

} // namespace codedexposure
