/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Read once for all sources of the elements, to build them faster; see
 * lib/precompiled/std.h. */
#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>
#include <gst/video/gstvideofilter.h>
#include <gst/video/video.h>
