/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Read once for all tests of elements, to build them faster; see
 * lib/precompiled/std.h. */
#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>
#include <gst/check/gstharness.h>
#include <gst/gst.h>
#include <gst/video/video.h>
#include <gtest/gtest.h>
