/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The parts of codedexposure-recordmux and -recorddemux, as elements that a
 * harness makes: part-log and part-restore. */
#pragma once

#include <gtest/gtest.h>

#include "common/meta.h"
#include "record/parts.h"

namespace codedexposure::test
{

/** Define one global object of this type in a program with linked elements. */
class RecordParts : public ::testing::Environment
{
  void SetUp () override
  {
    gst::register_meta (gst::kFrameMetaName);
    ASSERT_TRUE (gst_element_register (nullptr, "part-log", GST_RANK_NONE,
        gst_coded_exposure_log_get_type ()));
    ASSERT_TRUE (gst_element_register (nullptr, "part-restore", GST_RANK_NONE,
        gst_coded_exposure_restore_get_type ()));
  }
};

} // namespace codedexposure::test
