/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "gstsourcekeeper.h"

#include <chrono>

namespace cexp::gst
{

namespace
{

constexpr std::chrono::seconds kPause{1};

std::string
text_of (GstMessage *message)
{
  GError *error = nullptr;
  gchar *debug = nullptr;
  gst_message_parse_error (message, &error, &debug);
  const std::string text = error->message;
  g_error_free (error);
  g_free (debug);
  return text;
}

/** What the source says of why its stream stopped; an error when it does not.
 */
GstFlowReturn
flow_of (GstMessage *message)
{
  const GstStructure *details = nullptr;
  gst_message_parse_error_details (message, &details);
  gint flow = GST_FLOW_ERROR;
  if (details)
    gst_structure_get_int (details, "flow-return", &flow);
  return GstFlowReturn (flow);
}

} // namespace

void
forget_camera (GstElement *source)
{
  constexpr const char *kName = "camera-name";
  if (!g_object_class_find_property (G_OBJECT_GET_CLASS (source), kName))
    return;
  gchar *name = nullptr;
  g_object_get (source, kName, &name, nullptr);
  const CharPtr owned (name);
  g_object_set (source, kName, name, nullptr);
}

/** What a message finds, also when the keeper is no more. */
struct SourceKeeper::Hook {
  std::weak_ptr<SourceKeeper> keeper;
  ObjectPtr<GstBus> above;
};

SourceKeeper::SourceKeeper (ObjectPtr<GstElement> source, GstElement *owner,
    guint tries, Reports reports)
    : source_ (std::move (source)), owner_ (owner), tries_ (tries),
      reports_ (std::move (reports)), bus_ (gst_bus_new ()),
      above_ (gst_element_get_bus (source_.get ())),
      thread_ ([this] { work (); })
{
}

std::shared_ptr<SourceKeeper>
SourceKeeper::keep (ObjectPtr<GstElement> source, GstElement *owner,
    guint tries, Reports reports)
{
  const std::shared_ptr<SourceKeeper> keeper (
      new SourceKeeper (std::move (source), owner, tries, std::move (reports)));
  auto *above = keeper->above_.get ();
  gst_bus_set_sync_handler (keeper->bus_.get (), take_message,
      new Hook{keeper, ObjectPtr<GstBus> (
                           above ? GST_BUS (gst_object_ref (above)) : nullptr)},
      [] (gpointer hook) { delete static_cast<Hook *> (hook); });
  gst_element_set_bus (keeper->source_.get (), keeper->bus_.get ());
  return keeper;
}

SourceKeeper::~SourceKeeper ()
{
  release ();
}

void
SourceKeeper::release ()
{
  {
    const std::lock_guard guard (lock_);
    quit_ = true;
  }
  changed_.notify_all ();
  if (thread_.joinable ())
    thread_.join ();
  const ObjectPtr<GstBus> now (gst_element_get_bus (source_.get ()));
  if (now == bus_)
    gst_element_set_bus (source_.get (), above_.get ());
}

bool
SourceKeeper::away () const
{
  const std::lock_guard guard (lock_);
  return away_;
}

bool
SourceKeeper::take_eos ()
{
  const std::lock_guard guard (lock_);
  return std::exchange (eos_due_, false);
}

void
SourceKeeper::stream_started ()
{
  const std::lock_guard guard (lock_);
  eos_due_ = false;
}

guint
SourceKeeper::frame_came ()
{
  const std::lock_guard guard (lock_);
  seen_ = true;
  if (!std::exchange (away_, false))
    return 0;
  why_.clear ();
  return std::exchange (tried_, 0);
}

GstBusSyncReply
SourceKeeper::take_message (GstBus *, GstMessage *message, gpointer data)
{
  const auto *hook = static_cast<Hook *> (data);
  const auto keeper = hook->keeper.lock ();
  const bool mended = keeper &&
                      GST_MESSAGE_TYPE (message) == GST_MESSAGE_ERROR &&
                      keeper->note_failure (message);
  /* Who has a message dropped owns it. */
  if (!mended && hook->above)
    gst_bus_post (hook->above.get (), message);
  else
    gst_message_unref (message);
  return GST_BUS_DROP;
}

/* What the source pushed last was taken: it is not what comes behind it that
 * stopped the stream. */
bool
SourceKeeper::is_own_failure (GstMessage *message) const
{
  const ObjectPtr<GstPad> pad (
      gst_element_get_static_pad (source_.get (), "src"));
  return GST_MESSAGE_SRC (message) == GST_OBJECT (source_.get ()) &&
         flow_of (message) == GST_FLOW_ERROR && pad &&
         gst_pad_get_last_flow_return (pad.get ()) == GST_FLOW_OK;
}

/* Whether it is going to be mended. */
bool
SourceKeeper::note_failure (GstMessage *message)
{
  const bool own = is_own_failure (message);
  bool first = false;
  {
    const std::lock_guard guard (lock_);
    if (quit_ || (!away_ && !(own && seen_)))
      return false;
    if (why_.empty ())
      why_ = text_of (message);
    if (own)
      eos_due_ = due_ = true;
    first = !std::exchange (away_, true);
  }
  changed_.notify_all ();
  if (first)
    reports_.lost (text_of (message));
  return true;
}

void
SourceKeeper::work ()
{
  std::unique_lock lock (lock_);
  for (;;) {
    changed_.wait (lock, [this] { return due_ || quit_; });
    if (quit_)
      return;
    lock.unlock ();
    restart ();
    lock.lock ();
  }
}

void
SourceKeeper::restart ()
{
  for (;;) {
    {
      std::unique_lock lock (lock_);
      if (tried_ == tries_) {
        due_ = false;
        break;
      }
      if (tried_ > 0 &&
          changed_.wait_for (lock, kPause, [this] { return quit_; }))
        return;
      tried_++;
    }
    reports_.stopping ();
    gst_element_set_state (source_.get (), GST_STATE_NULL);
    {
      const std::lock_guard guard (lock_);
      due_ = false;
      if (quit_)
        return;
      why_.clear ();
    }
    forget_camera (source_.get ());
    /* Stopped elements forget them. */
    const ObjectPtr<GstClock> clock (gst_element_get_clock (owner_));
    gst_element_set_clock (source_.get (), clock.get ());
    gst_element_set_base_time (
        source_.get (), gst_element_get_base_time (owner_));
    reports_.starting ();
    if (gst_element_sync_state_with_parent (source_.get ()))
      return;
  }
  std::string why;
  {
    const std::lock_guard guard (lock_);
    why = why_;
  }
  reports_.gave_up (why);
}

} // namespace cexp::gst
