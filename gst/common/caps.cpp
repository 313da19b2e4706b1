/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "caps.h"

#include <algorithm>
#include <numeric>
#include <optional>

namespace codedexposure::gst
{

namespace
{

/* Owns a GValue. */
class Value
{
public:
  Value () = default;
  explicit Value (GType type) { g_value_init (&value_, type); }
  Value (Value &&other) noexcept
      : value_ (std::exchange (other.value_, GValue G_VALUE_INIT))
  {
  }
  ~Value () { g_value_unset (&value_); }
  GValue *get () { return &value_; }

private:
  GValue value_ = G_VALUE_INIT;
};

using MaybeValue = std::optional<Value>;

/* The scale of a size, with the crop of CapsScale. */
struct IntScale {
  Ratio ratio;
  gint64 crop;
};

/* All values from low to high. */
struct IntSpan {
  gint64 low, high;
};

gint
saturate (gint64 value)
{
  return gint (std::min<gint64> (value, G_MAXINT));
}

/* Division gives one size; multiplication gives all sizes that division turns
 * into @value. G_MAXINT stays, because it means "no bound" in caps. */
IntSpan
scale_int (gint64 value, const IntScale &scale)
{
  const auto &[num, den] = scale.ratio;
  if (value == G_MAXINT)
    return {value, value};
  const gint64 from = value - std::max<gint64> (scale.crop, 0);
  const gint64 back = std::max<gint64> (-scale.crop, 0);
  if (from <= 0)
    return {0, 0};
  const gint64 low = from * num / den + back;
  if (num <= den)
    return {low, low};
  return {low, ((from + 1) * num - 1) / den + back};
}

/* The sizes in @span, which are at least 1. */
MaybeValue
int_value (IntSpan span)
{
  const gint low = saturate (std::max<gint64> (span.low, 1));
  const gint high = saturate (span.high);
  if (high < low)
    return std::nullopt;
  Value value (low == high ? G_TYPE_INT : GST_TYPE_INT_RANGE);
  if (low == high)
    g_value_set_int (value.get (), low);
  else
    gst_value_set_int_range (value.get (), low, high);
  return value;
}

MaybeValue
scale_one (const GValue *in, const IntScale &scale)
{
  if (G_VALUE_HOLDS_INT (in))
    return int_value (scale_int (g_value_get_int (in), scale));
  if (GST_VALUE_HOLDS_INT_RANGE (in))
    return int_value ({scale_int (gst_value_get_int_range_min (in), scale).low,
        scale_int (gst_value_get_int_range_max (in), scale).high});
  return std::nullopt;
}

/* A positive fraction in lowest terms, rounded where it does not fit into two
 * ints. */
Value
fraction_value (gint64 num, gint64 den)
{
  const gint64 divisor = std::max<gint64> (std::gcd (num, den), 1);
  num /= divisor;
  den /= divisor;
  while (num > G_MAXINT && den > 1) {
    num = (num + 1) / 2;
    den = (den + 1) / 2;
  }
  while (den > G_MAXINT) {
    num = std::max<gint64> (num / 2, 1);
    den /= 2;
  }
  Value value (GST_TYPE_FRACTION);
  gst_value_set_fraction (value.get (), saturate (num), gint (den));
  return value;
}

/* 0/1, the unknown rate, stays, and so does the largest fraction, which means
 * "no bound". */
Value
scale_fraction (const GValue *in, const Ratio &scale)
{
  const gint64 num = gst_value_get_fraction_numerator (in);
  const gint64 den = gst_value_get_fraction_denominator (in);
  if (num == G_MAXINT && den == 1)
    return fraction_value (num, den);
  return fraction_value (num * scale.num, den * scale.den);
}

MaybeValue
scale_one (const GValue *in, const Ratio &scale)
{
  if (GST_VALUE_HOLDS_FRACTION (in))
    return scale_fraction (in, scale);
  if (!GST_VALUE_HOLDS_FRACTION_RANGE (in))
    return std::nullopt;
  Value low = scale_fraction (gst_value_get_fraction_range_min (in), scale);
  Value high = scale_fraction (gst_value_get_fraction_range_max (in), scale);
  if (gst_value_compare (low.get (), high.get ()) != GST_VALUE_LESS_THAN)
    return low;
  Value value (GST_TYPE_FRACTION_RANGE);
  gst_value_set_fraction_range (value.get (), low.get (), high.get ());
  return value;
}

template <typename Scale>
MaybeValue
scale_list (const GValue *in, const Scale &scale)
{
  MaybeValue all;
  for (guint i = 0; i < gst_value_list_get_size (in); i++) {
    MaybeValue item = scale_one (gst_value_list_get_value (in, i), scale);
    if (!item)
      continue;
    Value merged;
    if (all)
      gst_value_list_merge (merged.get (), all->get (), item->get ());
    all.emplace (std::move (all ? merged : *item));
  }
  return all;
}

/* False if no value of the field is left. A field may be absent. */
template <typename Scale>
bool
scale_field (GstStructure *structure, const char *name, const Scale &scale)
{
  const GValue *in = gst_structure_get_value (structure, name);
  if (!in)
    return true;
  MaybeValue out = GST_VALUE_HOLDS_LIST (in) ? scale_list (in, scale)
                                             : scale_one (in, scale);
  if (!out)
    return false;
  gst_structure_set_value (structure, name, out->get ());
  return true;
}

bool
scale_structure (GstStructure *structure, const CapsScale &scale)
{
  const auto &[rate, width, height, crop_rows] = scale;
  const Ratio aspect{width.den * height.num, width.num * height.den};
  return scale_field (structure, "framerate", rate) &&
         scale_field (structure, "max-framerate", rate) &&
         scale_field (structure, "width", IntScale{width, 0}) &&
         scale_field (structure, "height", IntScale{height, crop_rows}) &&
         scale_field (structure, "pixel-aspect-ratio", aspect);
}

bool
has_rate (const GstStructure *structure)
{
  gint num = 1, den = 1;
  return gst_structure_has_field (structure, "framerate") &&
         !(gst_structure_get_fraction (structure, "framerate", &num, &den) &&
             num == 0);
}

} // namespace

CapsScale
CapsScale::inverse () const
{
  return {rate.inverse (), width.inverse (), height.inverse (), -crop_rows};
}

CapsScale
coded_to_subframes (const Schedule &schedule, bool raised_rate)
{
  return {{raised_rate ? schedule.slots () : 1}, {1, schedule.cell ().width},
      {1, schedule.cell ().height}, schedule.pilot_rows ()};
}

GstCaps *
scale_caps (GstCaps *caps, const CapsScale &scale)
{
  if (gst_caps_is_any (caps))
    return gst_caps_ref (caps);

  GstCaps *scaled = gst_caps_new_empty ();
  for (guint i = 0; i < gst_caps_get_size (caps); i++) {
    GstStructure *structure =
        gst_structure_copy (gst_caps_get_structure (caps, i));
    if (!scale_structure (structure, scale)) {
      gst_structure_free (structure);
      continue;
    }
    GstCapsFeatures *features =
        gst_caps_features_copy (gst_caps_get_features (caps, i));
    scaled = gst_caps_merge_structure_full (scaled, structure, features);
  }
  return scaled;
}

CapsPtr
without_fields (GstCaps *caps, std::initializer_list<const char *> fields)
{
  CapsPtr free (gst_caps_copy (caps));
  for (guint i = 0; i < gst_caps_get_size (free.get ()); i++)
    for (const char *field : fields)
      gst_structure_remove_field (
          gst_caps_get_structure (free.get (), i), field);
  return free;
}

CapsPtr
unbind_caps (GstCaps *caps)
{
  return without_fields (caps,
      {"framerate", "max-framerate", "width", "height", "pixel-aspect-ratio"});
}

CapsPtr
intersect_caps (GstCaps *preferred, GstCaps *other)
{
  return CapsPtr (
      gst_caps_intersect_full (preferred, other, GST_CAPS_INTERSECT_FIRST));
}

CapsPtr
admit_unknown_rate (FrameRate rate, CapsPtr caps)
{
  if (rate.num == 0 || gst_caps_is_any (caps.get ()))
    return caps;
  const CapsPtr said (gst_caps_new_simple ("video/x-raw", "framerate",
      GST_TYPE_FRACTION, rate.num, rate.den, nullptr));
  const CapsPtr at_rate = intersect_caps (caps.get (), said.get ());
  GstCaps *unknown = gst_caps_copy (at_rate.get ());
  gst_caps_set_simple (unknown, "framerate", GST_TYPE_FRACTION, 0, 1, nullptr);
  return CapsPtr (gst_caps_merge (caps.release (), unknown));
}

CapsPtr
fill_in_rate (FrameRate rate, GstCaps *caps)
{
  CapsPtr filled (gst_caps_copy (caps));
  for (guint i = 0; i < gst_caps_get_size (filled.get ()); i++) {
    GstStructure *structure = gst_caps_get_structure (filled.get (), i);
    if (rate.num > 0 && !has_rate (structure))
      gst_structure_set (structure, "framerate", GST_TYPE_FRACTION, rate.num,
          rate.den, nullptr);
  }
  return filled;
}

} // namespace codedexposure::gst
