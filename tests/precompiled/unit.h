/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Read once for all tests of the library, to build them faster; see
 * lib/precompiled/std.h. */
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
