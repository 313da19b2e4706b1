/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where coded frames are sent. */
#pragma once

#include <netdb.h>

#include "failure.h"
#include "options/options.h"

namespace codedexposure::app
{

class AddressOptions
{
public:
  /** @p host, @p port  what they are, for --help. */
  void declare (
      Options &options, const std::string &host, const std::string &port)
  {
    options.value ("--host", host_, "ADDRESS", host + " [127.0.0.1]");
    options.value (
        "--port", port_, "N", port + " [5000]", whole (1, 65535, "a TCP port"));
  }

  std::string host () const { return host_.value_or ("127.0.0.1"); }
  int port () const { return port_.value_or (5000); }
  /** Throws Failure if no such machine is known. */
  void check () const
  {
    addrinfo *found = nullptr;
    const int error = getaddrinfo (host ().c_str (), nullptr, nullptr, &found);
    if (error != 0)
      usage_error (
          "--host " + host () + " is not known here (" + gai_strerror (error) +
          "); give the name or the address of a machine in this network");
    freeaddrinfo (found);
  }

private:
  std::optional<Text> host_;
  std::optional<int> port_;
};

} // namespace codedexposure::app
