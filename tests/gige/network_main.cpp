/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Runs tests of cameras in a network of their own. */
#include <cstdio>

#include <gst/gst.h>
#include <gtest/gtest.h>

#include "emulation/own_network.h"

int
main (int argc, char **argv)
{
  const bool alone = codedexposure::leave_network (2).ok ();
  gst_init (&argc, &argv);
  ::testing::InitGoogleTest (&argc, argv);
  if (!alone) {
    std::puts ("a network of its own is not allowed here: skipped");
    return 77;
  }
  const int result = RUN_ALL_TESTS ();
  gst_deinit ();
  return result;
}
