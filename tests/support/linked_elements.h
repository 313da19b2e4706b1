/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The elements as a part of the test, for those that share the mirrors of
 * simulated DMDs with them: what a plugin that is loaded holds is its own. */
#pragma once

#include <gtest/gtest.h>

#include "gstcodedexposuredemux.h"
#include "gstcodedexposuremeta.h"
#include "gstcodedexposuresim.h"
#include "gstdmdsync.h"
#include "gstmoirecalib.h"

namespace cexp::test
{

/** Make one of these global in every program that runs linked elements. Such a
 * program must not find the plugin: types are registered once. */
class LinkedElements : public ::testing::Environment
{
  void SetUp () override
  {
    gst::register_frame_meta ();
    ASSERT_TRUE (GST_ELEMENT_REGISTER (codedexposure_demux, nullptr));
    ASSERT_TRUE (GST_ELEMENT_REGISTER (codedexposure_sim, nullptr));
    ASSERT_TRUE (GST_ELEMENT_REGISTER (dmdsync, nullptr));
    ASSERT_TRUE (GST_ELEMENT_REGISTER (moirecalib, nullptr));
  }
};

} // namespace cexp::test
