/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "network_frames.h"

#include <arv.h>

#include "base/try.h"
#include "common/raii.h"
#include "rig/frame_tap.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* Waits are this long at most, so that a request to stop is obeyed; us. */
constexpr std::uint64_t kMoment = 50'000;
constexpr int kBuffers = 10;

SeenFrame
frame_of (ArvBuffer *buffer)
{
  SeenFrame frame;
  frame.time = Nanoseconds (arv_buffer_get_timestamp (buffer));
  frame.arrival = monotonic_now ();
  frame.damaged = arv_buffer_get_status (buffer) != ARV_BUFFER_STATUS_SUCCESS;
  return frame;
}

std::vector<SeenFrame>
pop_frames (ArvStream *stream, const StreamRequest &request)
{
  std::vector<SeenFrame> seen;
  Nanoseconds last = monotonic_now ();
  while (int (seen.size ()) < request.frames &&
         !request.stop.stop_requested () &&
         monotonic_now () - last < request.patience) {
    ArvBuffer *buffer = arv_stream_timeout_pop_buffer (stream, kMoment);
    if (!buffer)
      continue;
    last = monotonic_now ();
    seen.push_back (frame_of (buffer));
    arv_stream_push_buffer (stream, buffer);
  }
  return seen;
}

} // namespace

Error
camera_error (GError *error)
{
  Error why{error->message, ErrorCode::device};
  g_error_free (error);
  return why;
}

Result<std::vector<SeenFrame>>
receive_frames (const StreamRequest &request)
{
  GError *error = nullptr;
  const ObjectPtr<ArvCamera> camera (
      arv_camera_new (request.camera.c_str (), &error));
  if (error)
    return camera_error (error);
  /* What a camera refuses here, it refuses in the pipelines, too, which say
   * so. */
  arv_device_set_features_from_string (arv_camera_get_device (camera.get ()),
      request.features.c_str (), nullptr);
  arv_camera_set_exposure_time (
      camera.get (), double (request.exposure) / 1e3, nullptr);
  RETURN_IF_ERROR (request.begin ());
  const ObjectPtr<ArvStream> stream (
      arv_camera_create_stream (camera.get (), nullptr, nullptr, &error));
  if (error)
    return camera_error (error);
  const guint payload = arv_camera_get_payload (camera.get (), nullptr);
  for (int k = 0; k < kBuffers; k++)
    arv_stream_push_buffer (stream.get (), arv_buffer_new_allocate (payload));
  arv_camera_start_acquisition (camera.get (), &error);
  if (error)
    return camera_error (error);
  auto seen = pop_frames (stream.get (), request);
  arv_camera_stop_acquisition (camera.get (), nullptr);
  if (request.stop.stop_requested ())
    return Error{"stopped", ErrorCode::cancelled};
  return seen;
}

} // namespace codedexposure::app
