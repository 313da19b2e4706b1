/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The demo needs no more elements. */
#include "parts.h"

gboolean
codedexposure::gst::register_more_elements (GstPlugin *)
{
  return TRUE;
}
