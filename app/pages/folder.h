/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The folder of a page. */
#pragma once

#include <string>

#include "base/part.h"

namespace codedexposure::app
{

/** A folder that is written beside its name, and removed unless it is
 * published. Functions throw Failure. */
class PageFolder
{
public:
  PageFolder (const std::string &name, bool replace);
  ~PageFolder ();
  PageFolder (const PageFolder &) = delete;
  PageFolder &operator= (const PageFolder &) = delete;

  const std::string &name () const { return name_; }
  /** Where @p file is written, or a folder, whose name ends in "/". */
  std::string path (const std::string &file) const;
  void write (const std::string &file, const std::string &content) const;
  /** Moves the content to the folder of that name. Files of other names stay
   * there, but pictures of an earlier run go. */
  void publish ();

private:
  const std::string name_;
  Part part_;
};

} // namespace codedexposure::app
