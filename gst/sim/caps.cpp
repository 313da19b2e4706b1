/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Input frames and coded frames: the rate of one from that of the other.
 *
 * A coded frame takes N slots times a whole number of input frames. The caps
 * of both sides give that number: every rate up to an Nth of the input's is
 * offered, the largest that divides it is taken.
 */
#include "common/caps.h"
#include "sim.h"

#define GST_CAT_DEFAULT codedexposure_sim_debug

namespace codedexposure::gst::sim
{

namespace
{

/* A coded frame of more input frames than this is a mistake. */
constexpr int kMaxInputs = 65536;

ScheduleRef
schedule_of (GstCodedExposureSim *self)
{
  const ObjectLock lock (self);
  const SimState &st = state (self);
  if (st.schedule)
    return st.schedule;
  if (const auto &read = st.settings.schedule.read; read && *read)
    return {read, &read->value ()};
  return std::make_shared<const Schedule> ();
}

/* The largest (@sign > 0) or smallest fraction that @value, of any kind, holds.
 */
void
extreme_fraction (const GValue *value, int sign, GValue *found)
{
  if (GST_VALUE_HOLDS_LIST (value)) {
    for (guint i = 0; i < gst_value_list_get_size (value); i++)
      extreme_fraction (gst_value_list_get_value (value, i), sign, found);
    return;
  }
  const GValue *end = value;
  if (GST_VALUE_HOLDS_FRACTION_RANGE (value))
    end = sign > 0 ? gst_value_get_fraction_range_max (value)
                   : gst_value_get_fraction_range_min (value);
  const int better = sign > 0 ? GST_VALUE_GREATER_THAN : GST_VALUE_LESS_THAN;
  if (gst_value_get_fraction_numerator (found) == 0 ||
      gst_value_compare (end, found) == better)
    g_value_copy (end, found);
}

/* Opens the frame rate of @structure towards those that more input frames a
 * coded frame give: downwards on the source pad, upwards on the sink pad. An
 * unknown rate, 0/1, stays. */
void
widen_rate (GstStructure *structure, GstPadDirection made_for)
{
  const GValue *rate = gst_structure_get_value (structure, "framerate");
  if (!rate)
    return;
  GValue end = G_VALUE_INIT;
  g_value_init (&end, GST_TYPE_FRACTION);
  gst_value_set_fraction (&end, 0, 1);
  extreme_fraction (rate, made_for == GST_PAD_SRC ? 1 : -1, &end);
  const int num = gst_value_get_fraction_numerator (&end);
  const int den = gst_value_get_fraction_denominator (&end);
  g_value_unset (&end);

  if (num == 0)
    return;
  if (made_for == GST_PAD_SRC)
    gst_structure_set (structure, "framerate", GST_TYPE_FRACTION_RANGE, 0, 1,
        num, den, nullptr);
  else if (num < G_MAXINT || den > 1)
    gst_structure_set (structure, "framerate", GST_TYPE_FRACTION_RANGE, num,
        den, G_MAXINT, 1, nullptr);
}

/* Whether @structure can have the frame rate @num / @den. */
bool
allows_rate (const GstStructure *structure, int num, int den)
{
  const StructurePtr rate (
      gst_structure_new (gst_structure_get_name (structure), "framerate",
          GST_TYPE_FRACTION, num, den, nullptr));
  return gst_structure_can_intersect (structure, rate.get ());
}

/* How many input frames make a coded frame: a whole multiple of the slots. */
Result<int>
count_inputs (
    const GstVideoInfo &in, const GstVideoInfo &out, const Schedule &schedule)
{
  if (in.fps_n <= 0)
    return Error{
        "The input has no frame rate, and an exposure cannot be cut into slots "
        "without; put 'videorate ! video/x-raw,framerate=100/1' before "
        "codedexposure-sim."};
  const int slots = schedule.slots ();
  int num = 0, den = 1;
  if (out.fps_n > 0 &&
      gst_util_fraction_multiply (
          in.fps_n, in.fps_d, out.fps_d, out.fps_n, &num, &den) &&
      den == 1 && num % slots == 0 && num <= kMaxInputs)
    return num;

  const auto rate = [] (int n, int d) {
    return std::to_string (n) + "/" + std::to_string (d);
  };
  std::string remedy = "change the input's rate with videorate.";
  if (gst_util_fraction_multiply (in.fps_n, in.fps_d, 1, slots, &num, &den))
    remedy = "ask for " + rate (num, den) +
             " coded frames/s or a whole fraction of it, or " + remedy;
  return Error{rate (in.fps_n, in.fps_d) + " input frames/s do not fill the " +
               std::to_string (slots) + " slots of '" + schedule.text () +
               "' evenly at " + rate (out.fps_n, out.fps_d) +
               " coded frames/s; " + remedy};
}

/* What of each input frame falls into no slot, in active times of a slot. */
std::vector<double>
light_between (
    const SlotPlan &slots, const std::vector<std::vector<LightShare>> &shares)
{
  const double all = double (slots.frame_period ()) / double (slots.active ()) /
                     double (shares.size ());
  std::vector<double> between;
  for (const auto &of_input : shares) {
    double left = all;
    for (const LightShare &share : of_input)
      left -= share.slots;
    /* Shares are rounded, and so is the period. */
    between.push_back (left > 1e-5 ? left : 0.0);
  }
  return between;
}

Result<Plan>
plan_for (
    const GstVideoInfo &in, const GstVideoInfo &out, const Schedule &schedule)
{
  const Result<int> inputs = count_inputs (in, out, schedule);
  if (!inputs)
    return inputs.error ();
  if (const auto within = schedule.check_size (in.width, in.height); !within)
    return Error{"The schedule does not suit the frames: " +
                 within.error ().message + "."};
  const Result<SlotPlan> slots = SlotPlan::fit (
      schedule.timing (), schedule.slots (), {out.fps_n, out.fps_d});
  if (!slots)
    return Error{"The schedule '" + schedule.text () +
                 "' cannot be shown: " + slots.error ().message + "."};
  auto shares = share_light (*slots, *inputs);
  std::vector<double> between = light_between (*slots, shares);
  return Plan{in, out, *inputs, std::move (shares), std::move (between)};
}

/* Posted once, although a source offers the same caps again before it gives up.
 */
void
refuse (GstCodedExposureSim *self, const std::string &why)
{
  if (std::exchange (state (self).stream.refused, why) != why)
    POST_ERROR (self, STREAM, FORMAT, why);
}

} // namespace

GstCaps *
transform_caps (GstBaseTransform *trans, GstPadDirection direction,
    GstCaps *caps, GstCaps *filter)
{
  auto *self = as<GstCodedExposureSim> (trans);
  const CapsScale scale{.rate = {1, schedule_of (self)->slots ()}};
  const GstPadDirection made_for =
      direction == GST_PAD_SINK ? GST_PAD_SRC : GST_PAD_SINK;
  CapsPtr made (
      scale_caps (caps, made_for == GST_PAD_SRC ? scale : scale.inverse ()));
  if (!gst_caps_is_any (made.get ())) {
    made.reset (gst_caps_make_writable (made.release ()));
    for (guint i = 0; i < gst_caps_get_size (made.get ()); i++)
      widen_rate (gst_caps_get_structure (made.get (), i), made_for);
  }
  return (filter ? intersect_caps (filter, made.get ()) : std::move (made))
      .release ();
}

GstCaps *
fixate_caps (GstBaseTransform *trans, GstPadDirection direction, GstCaps *caps,
    GstCaps *othercaps)
{
  const int slots = schedule_of (as<GstCodedExposureSim> (trans))->slots ();
  othercaps = gst_caps_make_writable (gst_caps_truncate (othercaps));
  GstStructure *other = gst_caps_get_structure (othercaps, 0);
  int num = 0, den = 1;
  gst_structure_get_fraction (
      gst_caps_get_structure (caps, 0), "framerate", &num, &den);

  /* A pad that is not linked yet is no reason to refuse. */
  const bool bound = gst_pad_is_linked (GST_BASE_TRANSFORM_SRC_PAD (trans));
  if (direction == GST_PAD_SINK && num > 0)
    for (int inputs = slots; inputs <= kMaxInputs; inputs += slots) {
      int coded_num, coded_den;
      if (!gst_util_fraction_multiply (
              num, den, 1, inputs, &coded_num, &coded_den))
        break;
      if (!bound || allows_rate (other, coded_num, coded_den)) {
        gst_structure_set (other, "framerate", GST_TYPE_FRACTION, coded_num,
            coded_den, nullptr);
        break;
      }
    }
  return gst_caps_fixate (othercaps);
}

bool
make_plan (
    GstCodedExposureSim *self, const GstVideoInfo &in, const GstVideoInfo &out)
{
  Stream &stream = state (self).stream;
  stream.plan.reset ();
  Result<Plan> made = plan_for (in, out, *stream.schedule);
  if (!made) {
    refuse (self, made.error ().message);
    return false;
  }
  GST_INFO_OBJECT (self, "%d input frames in a coded frame", made->inputs);
  stream.plan = *std::move (made);
  stream.refused.clear ();
  const guint64 held = stream.plan->inputs - 1;
  const GstClockTime latency =
      gst_util_uint64_scale (GST_SECOND, held * in.fps_d, in.fps_n);
  set_latency (self, state (self).latency, [latency] { return latency; });
  return true;
}

void
explain_refusal (GstCodedExposureSim *self, GstCaps *incaps)
{
  auto *trans = GST_BASE_TRANSFORM (self);
  const CapsPtr possible (
      transform_caps (trans, GST_PAD_SINK, incaps, nullptr));
  const CapsPtr wanted (
      gst_pad_peer_query_caps (GST_BASE_TRANSFORM_SRC_PAD (trans), nullptr));
  if (gst_caps_can_intersect (possible.get (), wanted.get ()))
    return;
  const auto text = [] (const CapsPtr &caps) {
    return std::string (CharPtr (gst_caps_to_string (caps.get ())).get ());
  };
  refuse (self, "Downstream takes \"" + text (wanted) +
                    "\", but the coded frames of this input can only be \"" +
                    text (possible) + "\".");
}

gboolean
set_info (GstVideoFilter *filter, GstCaps *, GstVideoInfo *in_info, GstCaps *,
    GstVideoInfo *out_info)
{
  auto *self = as<GstCodedExposureSim> (filter);
  drop_exposure (self, Drop::kCaps);
  state (self).stream.bench.reset ();
  /* The tag has the size and the rate. */
  state (self).stream.tag_due = true;
  return make_plan (self, *in_info, *out_info);
}

} // namespace codedexposure::gst::sim
