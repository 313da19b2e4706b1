/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Registers the elements that are linked into a test program, so that both use
 * the same simulated DMDs; a loaded plugin would have its own. The program must
 * not find the plugin, because types are registered once. */
#include <gtest/gtest.h>

#include "parts.h"
#include "record/parts.h"

namespace codedexposure::test
{

namespace
{

class LinkedElements : public ::testing::Environment
{
  void SetUp () override
  {
    ASSERT_TRUE (gst::register_elements (nullptr));
    ASSERT_TRUE (gst::register_devices (nullptr));
    /* What recordmux and recorddemux have inside, for a harness. */
    ASSERT_TRUE (gst_element_register (nullptr, "part-log", GST_RANK_NONE,
        gst_coded_exposure_log_get_type ()));
    ASSERT_TRUE (gst_element_register (nullptr, "part-restore", GST_RANK_NONE,
        gst_coded_exposure_restore_get_type ()));
  }
};

const auto *const linked =
    ::testing::AddGlobalTestEnvironment (new LinkedElements);

} // namespace

} // namespace codedexposure::test
