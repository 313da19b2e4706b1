/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "request_pad.h"

namespace codedexposure::gst
{

GstPad *
RequestPad::add (GstPad *made)
{
  const ObjectPtr<GstPad> pad (GST_PAD (gst_object_ref_sink (made)));
  {
    const ObjectLock lock (element_);
    if (pad_)
      return nullptr;
    pad_ = pad.get ();
  }
  gst_pad_set_active (pad.get (), TRUE);
  gst_element_add_pad (element_, pad.get ());
  return pad.get ();
}

void
RequestPad::release (GstPad *pad)
{
  {
    const ObjectLock lock (element_);
    if (pad_ != pad)
      return;
    pad_ = nullptr;
  }
  gst_pad_set_active (pad, FALSE);
  gst_element_remove_pad (element_, pad);
}

ObjectPtr<GstPad>
RequestPad::get () const
{
  const ObjectLock lock (element_);
  return ObjectPtr<GstPad> (pad_ ? GST_PAD (gst_object_ref (pad_)) : nullptr);
}

} // namespace codedexposure::gst
