/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "structure.h"

#include <algorithm>
#include <sstream>

namespace codedexposure::gst
{

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
