/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Read once for all sources of the library, to build it faster. Sources include
 * what they use all the same: -Db_pch=false builds without this file. */
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
