/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* main () of the unit tests. */
#include "run_tests.h"

int
main (int argc, char **argv)
{
  return codedexposure::test::run_tests (argc, argv);
}
