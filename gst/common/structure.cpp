/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "structure.h"

#include <algorithm>
#include <sstream>

namespace codedexposure::gst
{

bool
get_count (const GValue *value, guint64 &count)
{
  GValue whole = G_VALUE_INIT;
  g_value_init (&whole, G_TYPE_INT64);
  const GType type = G_VALUE_TYPE (value);
  const bool counts =
      (type == G_TYPE_INT || type == G_TYPE_UINT || type == G_TYPE_INT64) &&
      g_value_transform (value, &whole) && g_value_get_int64 (&whole) >= 0;
  if (counts)
    count = guint64 (g_value_get_int64 (&whole));
  return counts;
}

std::vector<GQuark>
field_names (const char *members)
{
  std::vector<GQuark> names;
  std::istringstream text (members);
  for (std::string name; std::getline (text >> std::ws, name, ',');) {
    name.erase (0, name.rfind ('.') + 1);
    std::ranges::replace (name, '_', '-');
    names.push_back (g_quark_from_string (name.c_str ()));
  }
  return names;
}

} // namespace codedexposure::gst
