/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pictures that come out of an element. */
#pragma once

#include <vector>

#include "pipeline.h"

namespace codedexposure::test
{

/* What came out of a picture. */
struct Shown {
  GstClockTime pts, duration;
  Image<std::uint8_t> pixels;
  bool operator== (const Shown &) const = default;
};

/* What comes out of an element since the last flush. */
class Output
{
public:
  Output (Pipeline &pipeline, const char *name)
      : pad_ (pipeline.pad (name, "src"))
  {
    gst_pad_add_probe (
        pad_.get (),
        GstPadProbeType (
            GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_FLUSH),
        +[] (GstPad *pad, GstPadProbeInfo *info, gpointer self) {
          auto &shown = static_cast<Output *> (self)->shown;
          if (!(info->type & GST_PAD_PROBE_TYPE_BUFFER)) {
            shown.clear ();
            return GST_PAD_PROBE_OK;
          }
          GstBuffer *buffer = GST_PAD_PROBE_INFO_BUFFER (info);
          const CapsPtr caps (gst_pad_get_current_caps (pad));
          shown.push_back (
              {GST_BUFFER_PTS (buffer), GST_BUFFER_DURATION (buffer),
                  image_of<std::uint8_t> (buffer, caps.get ())});
          return GST_PAD_PROBE_OK;
        },
        this, nullptr);
  }
  std::vector<Shown> shown;

private:
  ObjectPtr<GstPad> pad_;
};

} // namespace codedexposure::test
