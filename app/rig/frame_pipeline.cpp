/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "frame_pipeline.h"

#include "base/try.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

using namespace gst;

Result<std::unique_ptr<FramePipeline>>
FramePipeline::make (const Build &build)
try {
  std::unique_ptr<FramePipeline> made (new FramePipeline);
  made->frames_.emplace (build (made->job_));
  const auto refused = made->job_.outputs.claim (true);
  if (!refused.empty ())
    return Error{refused.front (), ErrorCode::io};
  return made;
} catch (const Failure &failure) {
  return failure.error;
}

FramePipeline::~FramePipeline ()
{
  gst_element_set_state (pipeline (), GST_STATE_NULL);
  job_.outputs.finish (Outputs::Finish::discard);
}

Result<void>
FramePipeline::set_state (GstState state)
{
  if (gst_element_set_state (pipeline (), state) != GST_STATE_CHANGE_FAILURE)
    return {};
  const auto why = take_error ();
  gst_element_set_state (pipeline (), GST_STATE_NULL);
  return why.value_or (
      Error{"the camera cannot be started", ErrorCode::device});
}

std::optional<Error>
FramePipeline::take_error ()
{
  while (const MessagePtr message =
             next_message (pipeline (), GST_MESSAGE_ERROR)) {
    const Told said (message.get ());
    const std::string kind = factory_of (GST_MESSAGE_SRC (message.get ()));
    if (is_silence (kind, said))
      continue;
    const std::string remedy = remedy_for (kind, said);
    return Error{said.error->message + (remedy.empty () ? "" : "; " + remedy),
        ErrorCode::device};
  }
  return std::nullopt;
}

bool
FramePipeline::begins () const
{
  return gst_element_get_state (pipeline (), nullptr, nullptr, 0) ==
         GST_STATE_CHANGE_ASYNC;
}

Nanoseconds
FramePipeline::base_time () const
{
  return Nanoseconds (gst_element_get_base_time (pipeline ()));
}

GstElement *
FramePipeline::find (const char *factory) const
{
  GstElement *found = nullptr;
  each_element (pipeline (), [&] (GstElement *element) {
    if (factory_of (element) == factory)
      found = element;
  });
  return found;
}

} // namespace codedexposure::app
