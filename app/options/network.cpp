/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "network.h"

#include <netdb.h>

#include "failure.h"

namespace codedexposure::app
{

void
AddressOptions::check () const
{
  addrinfo *found = nullptr;
  const int error = getaddrinfo (host ().c_str (), nullptr, nullptr, &found);
  if (error != 0)
    usage_error (
        "--host " + host () + " is not known here (" + gai_strerror (error) +
        "); give the name or the address of a machine in this network");
  freeaddrinfo (found);
}

} // namespace codedexposure::app
