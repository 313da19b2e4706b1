/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A pad that an element has at most once, on request. */
#pragma once

#include <gst/gst.h>

#include "raii.h"

namespace codedexposure::gst
{

/** Any thread. */
class RequestPad
{
public:
  explicit RequestPad (GstElement *element) : element_ (element) {}

  /** Adds @p pad to the element, which takes a floating reference. Null if
   * there is one already. */
  GstPad *add (GstPad *pad);
  /** For the release_pad () of the element. */
  void release (GstPad *pad);
  /** Null if there is none. */
  ObjectPtr<GstPad> get () const;

private:
  GstElement *element_;
  GstPad *pad_ = nullptr; ///< object lock; the element's
};

} // namespace codedexposure::gst
