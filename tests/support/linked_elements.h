/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The elements linked into the test, so that both use the same simulated DMDs;
 * a loaded plugin would have its own. */
#pragma once

#include <gtest/gtest.h>

#include "bench/simulated_dmd.h"
#include "common/elements.h"
#include "common/meta.h"

namespace codedexposure::test
{

/** Define one global object of this type in every program with linked elements.
 * The program must not find the plugin, because types are registered once. */
class LinkedElements : public ::testing::Environment
{
  void SetUp () override
  {
    gst::register_meta (gst::kFrameMetaName);
    serve_simulated_dmds ();
#ifdef CODEDEXPOSURE_ARAVIS
    ASSERT_TRUE (
        GST_DEVICE_PROVIDER_REGISTER (codedexposure_cameraprovider, nullptr));
#endif
    ASSERT_TRUE (GST_ELEMENT_REGISTER (codedexposure_camerasrc, nullptr));
    ASSERT_TRUE (GST_ELEMENT_REGISTER (codedexposure_demux, nullptr));
    ASSERT_TRUE (GST_ELEMENT_REGISTER (codedexposure_sim, nullptr));
    ASSERT_TRUE (GST_ELEMENT_REGISTER (dmdsync, nullptr));
    ASSERT_TRUE (GST_ELEMENT_REGISTER (moirecalib, nullptr));
  }
};

} // namespace codedexposure::test
