/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The downstream side of an element, controlled by the test. */
#pragma once

#include <gst/check/gstharness.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include "common/raii.h"

namespace codedexposure::test
{

using namespace codedexposure::gst;

/** The answer of a pad's peer to the ALLOCATION query. */
struct Downstream {
  explicit Downstream (GstHarness *h)
  {
    gst_pad_add_probe (
        h->sinkpad, GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM, answer, this, nullptr);
  }
  static GstPadProbeReturn answer (
      GstPad *, GstPadProbeInfo *info, gpointer user_data)
  {
    GstQuery *query = GST_PAD_PROBE_INFO_QUERY (info);
    if (GST_QUERY_TYPE (query) != GST_QUERY_ALLOCATION)
      return GST_PAD_PROBE_OK;
    auto &self = *static_cast<Downstream *> (user_data);
    self.queries++;
    if (self.video_meta)
      gst_query_add_allocation_meta (query, GST_VIDEO_META_API_TYPE, nullptr);
    if (self.pool)
      gst_query_add_allocation_pool (
          query, self.pool.get (), 0, self.min, self.max);
    return GST_PAD_PROBE_HANDLED;
  }

  ObjectPtr<GstBufferPool> pool;
  guint min = 0, max = 0;
  bool video_meta = true;
  int queries = 0;
};

} // namespace codedexposure::test
