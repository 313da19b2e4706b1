/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure join: puts the pictures of excerpts together, as one run of
 * decode would have written them. Archives run it. */
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>
#include <nlohmann/json.hpp>

#include "command.h"
#include "common/meta.h"
#include "pipeline/messages.h"
#include "pipeline/pads.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "pipeline/video_output.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/** The pictures of one excerpt, in their order. */
class Part
{
public:
  Part (const std::string &name, bool decode) : name_ (name), job_ ("join", {})
  {
    Chain chain = read_recording (job_, name);
    g_object_set (job_.reader, "decode", gboolean (decode), nullptr);
    chain.to ("appsink", {{"sync", false}, {"max-buffers", 8}});
    sink_ = GST_APP_SINK (chain.last ());
    gst_element_set_state (job_.graph.pipeline (), GST_STATE_PLAYING);
  }
  ~Part () { gst_element_set_state (job_.graph.pipeline (), GST_STATE_NULL); }

  Part (const Part &) = delete;
  Part &operator= (const Part &) = delete;

  const std::string &name () const { return name_; }
  /** Null at the end, and after an error, which need not end the stream. */
  SamplePtr next ()
  {
    constexpr GstClockTime kPatience = 100 * GST_MSECOND;
    SamplePtr sample;
    while (!sample && !gst_app_sink_is_eos (sink_) && !failure ())
      sample.reset (gst_app_sink_try_pull_sample (sink_, kPatience));
    return sample;
  }
  /** Why there are no more; none: that was the end. */
  const std::optional<std::string> &failure ()
  {
    const MessagePtr message =
        next_message (job_.graph.pipeline (), GST_MESSAGE_ERROR);
    if (message && !failure_)
      failure_ = Told (message.get ()).error->message;
    return failure_;
  }
  /** How the pictures were made, among others. */
  std::vector<EventPtr> tags () const
  {
    return tags_at (pad_of (GST_ELEMENT (sink_), "sink").get ());
  }
  /** After next(). */
  GstClockTime duration () const
  {
    gint64 duration = 0;
    gst_element_query_duration (
        GST_ELEMENT (sink_), GST_FORMAT_TIME, &duration);
    return GstClockTime (duration);
  }

private:
  std::string name_;
  Job job_;
  GstAppSink *sink_;
  std::optional<std::string> failure_;
};

/** Of all parts, about; NONE: not known. Files need it to choose their form. */
GstClockTime
duration_of (const std::vector<std::string> &names)
{
  Part first (names.front (), false), last (names.back (), false);
  const SamplePtr begin = first.next (), end = last.next ();
  if (!begin || !end)
    return GST_CLOCK_TIME_NONE;
  return GST_BUFFER_PTS (gst_sample_get_buffer (end.get ())) +
         last.duration () -
         GST_BUFFER_PTS (gst_sample_get_buffer (begin.get ()));
}

/** Pushes the pictures of all parts into a source, one after the other, and
 * checks that each coded frame's pictures are there exactly once. Those for
 * .mkv stay encoded. */
class Feeder
{
public:
  Feeder (GstElement *source, std::vector<std::string> names, bool decode)
      : source_ (source), names_ (std::move (names)), decode_ (decode)
  {
    g_object_set (source, "format", GST_FORMAT_TIME, "block", TRUE, "max-bytes",
        guint64 (64) << 20, "duration", duration_of (names_),
        "handle-segment-change", TRUE, nullptr);
    g_signal_connect (source, "need-data", G_CALLBACK (on_need_data), this);
  }

  Feeder (const Feeder &) = delete;
  Feeder &operator= (const Feeder &) = delete;

  /** After the pipeline has stopped. */
  nlohmann::ordered_json counts () const
  {
    return {{"pictures", pictures_}, {"coded", coded_}, {"slots", slots_},
        {"first_frame", first_}, {"last_frame", frame_},
        {"lost", coded_ > 0 ? frame_ - first_ + 1 - coded_ : 0}};
  }

private:
  static void on_need_data (GstElement *, guint, gpointer self) noexcept
  {
    static_cast<Feeder *> (self)->push_next ();
  }

  void fail_with (const std::string &why)
  {
    GST_ELEMENT_ERROR (
        source_, STREAM, FAILED, ("%s", why.c_str ()), (nullptr));
    gst_app_src_end_of_stream (GST_APP_SRC (source_));
  }

  void push_next ()
  {
    SamplePtr sample;
    bool begins_part = false;
    while (!sample) {
      if (!part_ && at_ == names_.size ()) {
        gst_app_src_end_of_stream (GST_APP_SRC (source_));
        return;
      }
      begins_part |= !part_;
      if (!part_)
        part_ = std::make_unique<Part> (names_[at_++], decode_);
      sample = part_->next ();
      if (sample)
        break;
      if (const auto why = part_->failure ())
        return fail_with (part_->name () + ": " + *why);
      part_.reset ();
    }
    if (const std::string why = check (sample.get ()); !why.empty ())
      return fail_with (part_->name () + " " + why);
    if (pictures_++ == 0)
      return begin (sample.get ());
    if (begins_part)
      pass_tags ();
    gst_app_src_push_buffer (GST_APP_SRC (source_),
        gst_buffer_ref (gst_sample_get_buffer (sample.get ())));
  }

  /* With its segment: the time of the stream may begin with it. */
  void begin (GstSample *first)
  {
    caps_.reset (gst_caps_ref (gst_sample_get_caps (first)));
    gst_app_src_set_caps (GST_APP_SRC (source_), caps_.get ());
    pass_tags ();
    gst_app_src_push_sample (GST_APP_SRC (source_), first);
  }

  /* Each part says how it was made. In the whole, only a change does. */
  void pass_tags ()
  {
    std::vector<EventPtr> tags = part_->tags ();
    std::optional<Provenance> made = provenance_in (tags);
    if (made && made_ && made->first_frame == frame_) {
      Provenance whole = *made;
      whole.first_frame = made_->first_frame;
      whole.first_slot = made_->first_slot;
      if (whole == *made_)
        return;
    }
    made_ = std::move (made);
    for (EventPtr &event : tags)
      gst_element_send_event (source_, event.release ());
  }

  /* What is wrong with the next picture; empty: nothing. */
  std::string check (GstSample *sample)
  {
    const GstBuffer *picture = gst_sample_get_buffer (sample);
    if (caps_ &&
        !gst_caps_is_equal (caps_.get (), gst_sample_get_caps (sample)))
      return "is another kind of video than the parts before it; decode all "
             "parts with the same options";
    if (GST_CLOCK_TIME_IS_VALID (last_) && GST_BUFFER_PTS (picture) <= last_)
      return "begins before the end of the part before it";
    last_ = GST_BUFFER_PTS (picture);
    const auto meta = get_frame_meta (gst_sample_get_buffer (sample));
    if (!meta)
      return "does not number its pictures; decode all parts again";
    const bool begins = meta->subframe <= 0;
    if (coded_ > 0 && begins && meta->frame <= frame_)
      return format ("has pictures of coded frame %" G_GUINT64_FORMAT
                     " for a second time",
          meta->frame);
    if (!begins &&
        (coded_ == 0 || meta->frame != frame_ || meta->subframe != slot_ + 1))
      return format (
          "lacks pictures of coded frame %" G_GUINT64_FORMAT, meta->frame);
    if (begins && coded_ > 0 && slots_ > 0 && slot_ + 1 != slots_)
      return format (
          "follows a coded frame with %d of %d pictures", slot_ + 1, slots_);
    if (begins) {
      if (coded_ == 0)
        first_ = meta->frame;
      else
        slots_ = slot_ + 1;
      coded_++;
    }
    frame_ = meta->frame;
    slot_ = std::max (meta->subframe, 0);
    return {};
  }

  GstElement *source_; // of the pipeline, which stops before this goes
  const std::vector<std::string> names_;
  const bool decode_;
  /* Streaming thread: */
  std::size_t at_ = 0;
  std::unique_ptr<Part> part_;
  CapsPtr caps_;
  std::optional<Provenance> made_; // how, as was passed on
  GstClockTime last_ = GST_CLOCK_TIME_NONE;
  guint64 pictures_ = 0, coded_ = 0, first_ = 0, frame_ = 0;
  int slot_ = 0, slots_ = 0;
};

class Join
{
public:
  void declare (Options &options)
  {
    options.words (parts_);
    options.heading ("");
    options.value ("--output", output_, "OUT", "as of decode");
    options.require ("--output", "OUT");
    options.flag ("--deflate", style_.deflate, "as of decode");
    options.value ("--white", style_.white, "DN", "as of decode",
        whole (1, 65535, "a pixel value"));
    options.value ("--bits", style_.bits, "N", "as of decode", whole (1, 16));
    options.value (
        "--threads", style_.threads, "N", "as of decode", whole (1, 64));
    run_.declare (options);
  }

  Exit run ()
  {
    if (parts_.empty ())
      usage_error ("give the parts");
    start_gstreamer ();
    Job job ("join", run_);
    job.options.json = false;
    for (const std::string &part : parts_)
      job.outputs.reads (part);
    Chain chain = job.graph.begin ("appsrc");
    style_.encoded = form_of (*output_) == VideoForm::mkv;
    Feeder feeder (chain.last (), parts_, !style_.encoded);
    keep_times (chain.to ("queue").last ());
    write_video (job, chain, *output_, style_);
    const Exit exit = play (job).exit;
    if (exit != Exit::done)
      std::filesystem::remove (*output_ + ".part");
    else
      std::printf ("%s\n", feeder.counts ().dump ().c_str ());
    return exit;
  }

private:
  std::vector<std::string> parts_;
  std::optional<Text> output_;
  VideoStyle style_;
  RunOptions run_;
};

} // namespace

Command
join_command ()
{
  return make_command<Join> ({.name = "join",
      .summary = "",
      .usage = "[option...] PART.mkv... --output OUT",
      .description = R"(
Puts lossless videos of excerpts together, as one run of decode would have
written them, and prints what they hold as JSON.
)"});
}

} // namespace codedexposure::app
