/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A file or folder that is written beside its name. */
#pragma once

#include <string>

#include "base/result.h"

namespace codedexposure
{

/** NAME.part, a file or a folder beside NAME. It is locked, so only one run
 * writes it, and it gets its name when it is finished. A run that is killed
 * leaves it. Errors are messages for the user. */
class Part
{
public:
  enum Kind { kFile, kFolder };

  /** @p path  where it is written, in place of NAME.part; empty: there. */
  Part (std::string name, Kind kind, std::string path = {});
  /** Leaves NAME.part as it is. */
  ~Part ();
  Part (const Part &) = delete;
  Part &operator= (const Part &) = delete;

  /** Creates NAME.part empty, and the folder it is in. One of a run that was
   * killed is an error if it has content, unless @p replace. */
  Result<void> claim (bool replace);
  /** Gives a file its name; a file of that name is an error, unless @p replace.
   * A folder that is replaced keeps what the new one has not. */
  Result<void> publish (bool replace);
  void discard ();

  bool is_empty () const;
  const std::string &name () const { return name_; }
  const std::string &path () const { return path_; }

private:
  bool create ();
  bool lock ();
  Result<void> keep_others ();
  Error busy () const;
  Error unwritable () const;

  std::string name_, path_;
  Kind kind_;
  int lock_ = -1; // open and locked
};

/** Renames @p from to @p to; a file of that name is an error, unless @p
 * replace. */
Result<void> move_file (
    const std::string &from, const std::string &to, bool replace);

} // namespace codedexposure
