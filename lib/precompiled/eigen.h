/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The same with linear algebra, which takes the compiler a second a source. */
#include "precompiled/std.h"

#include <Eigen/Dense>
