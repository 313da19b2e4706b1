/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The same for sources with linear algebra, which most of these are. */
#include <Eigen/Core>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
