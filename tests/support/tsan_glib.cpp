/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Preloaded by tests/run --sanitize=thread: tells ThreadSanitizer about the
 * locks and reference counts of GLib and GStreamer, which are not built with
 * it. Every function does what the real one does. */
#include <dlfcn.h>
#include <glib-object.h>
#include <gst/gst.h>

extern "C" {

void __tsan_acquire (void *address);
void __tsan_release (void *address);

#define REAL(function)                                                         \
  static const auto real =                                                     \
      reinterpret_cast<decltype (&function)> (dlsym (RTLD_NEXT, #function))

void
g_mutex_lock (GMutex *mutex)
{
  REAL (g_mutex_lock);
  real (mutex);
  __tsan_acquire (mutex);
}

gboolean
g_mutex_trylock (GMutex *mutex)
{
  REAL (g_mutex_trylock);
  const gboolean locked = real (mutex);
  if (locked)
    __tsan_acquire (mutex);
  return locked;
}

void
g_mutex_unlock (GMutex *mutex)
{
  REAL (g_mutex_unlock);
  __tsan_release (mutex);
  real (mutex);
}

void
g_rec_mutex_lock (GRecMutex *mutex)
{
  REAL (g_rec_mutex_lock);
  real (mutex);
  __tsan_acquire (mutex);
}

gboolean
g_rec_mutex_trylock (GRecMutex *mutex)
{
  REAL (g_rec_mutex_trylock);
  const gboolean locked = real (mutex);
  if (locked)
    __tsan_acquire (mutex);
  return locked;
}

void
g_rec_mutex_unlock (GRecMutex *mutex)
{
  REAL (g_rec_mutex_unlock);
  __tsan_release (mutex);
  real (mutex);
}

void
g_cond_wait (GCond *condition, GMutex *mutex)
{
  REAL (g_cond_wait);
  __tsan_release (mutex);
  real (condition, mutex);
  __tsan_acquire (mutex);
}

gboolean
g_cond_wait_until (GCond *condition, GMutex *mutex, gint64 end)
{
  REAL (g_cond_wait_until);
  __tsan_release (mutex);
  const gboolean woken = real (condition, mutex, end);
  __tsan_acquire (mutex);
  return woken;
}

void
g_async_queue_push (GAsyncQueue *queue, gpointer data)
{
  REAL (g_async_queue_push);
  __tsan_release (queue);
  real (queue, data);
}

gpointer
g_async_queue_pop (GAsyncQueue *queue)
{
  REAL (g_async_queue_pop);
  const gpointer data = real (queue);
  __tsan_acquire (queue);
  return data;
}

gpointer
g_async_queue_try_pop (GAsyncQueue *queue)
{
  REAL (g_async_queue_try_pop);
  const gpointer data = real (queue);
  __tsan_acquire (queue);
  return data;
}

/* What a thread pool runs comes after what was done before it was pushed. */
static char pushed;

struct PoolTask {
  GFunc run;
  gpointer user_data;
};

static void
run_in_pool (gpointer data, gpointer user_data)
{
  const auto *task = static_cast<const PoolTask *> (user_data);
  __tsan_acquire (&pushed);
  task->run (data, task->user_data);
}

GThreadPool *
g_thread_pool_new (GFunc run, gpointer user_data, gint max_threads,
    gboolean exclusive, GError **error)
{
  REAL (g_thread_pool_new);
  return real (
      run_in_pool, new PoolTask{run, user_data}, max_threads, exclusive, error);
}

gboolean
g_thread_pool_push (GThreadPool *pool, gpointer data, GError **error)
{
  REAL (g_thread_pool_push);
  __tsan_release (&pushed);
  return real (pool, data, error);
}

/* What was done with an object comes before its end. */
void
gst_mini_object_unref (GstMiniObject *object)
{
  REAL (gst_mini_object_unref);
  __tsan_release (object);
  __tsan_acquire (object);
  real (object);
}

void
g_object_unref (gpointer object)
{
  REAL (g_object_unref);
  __tsan_release (object);
  __tsan_acquire (object);
  real (object);
}

void
gst_object_unref (gpointer object)
{
  REAL (gst_object_unref);
  __tsan_release (object);
  __tsan_acquire (object);
  real (object);
}

/* A buffer that comes back from a pool. */
GstFlowReturn
gst_buffer_pool_acquire_buffer (
    GstBufferPool *pool, GstBuffer **buffer, GstBufferPoolAcquireParams *params)
{
  REAL (gst_buffer_pool_acquire_buffer);
  const GstFlowReturn flow = real (pool, buffer, params);
  __tsan_acquire (pool);
  return flow;
}

void
gst_buffer_pool_release_buffer (GstBufferPool *pool, GstBuffer *buffer)
{
  REAL (gst_buffer_pool_release_buffer);
  __tsan_release (pool);
  real (pool, buffer);
}
}
