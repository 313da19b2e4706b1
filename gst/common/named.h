/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties whose text names a preset or a file. */
#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "element.h"
#include "wire.h"

namespace codedexposure::gst
{

/** The text of a property, and what was read from it. */
template <typename T>
struct Named {
  Named () = default;
  /** Parses @p name or reads the file of this name; logs a warning on failure.
   */
  explicit Named (std::string name) : text (std::move (name))
  {
    if (!text.empty ())
      read = std::make_shared<const Result<T>> (read_named (text));
    if (read && !*read)
      GST_WARNING ("%s", read->error ().message.c_str ());
  }

  std::string text;
  std::shared_ptr<const Result<T>> read; ///< null where the text is empty

private:
  static Result<T> read_named (const std::string &text)
  {
    if (text.starts_with ('{'))
      return T::from_json (text);
    if constexpr (requires { T::load (text); })
      return T::load (text);
    else
      return T::parse (text);
  }
};

/** Posts an error of the property @p name of @p element, which is also an
 * option of the program codedexposure, and returns false, if what it names
 * cannot be read. */
template <typename T>
bool
check_named (gpointer element, const char *name, const Named<T> &named)
{
  return !named.read || *named.read ||
         refuse_settings (
             element, std::string ("The ") + name + " property (or --" + name +
                          ") cannot be read: " + named.read->error ().message);
}

/** Reads the file of a setting of @p element again, because it may have
 * changed. Takes the object lock. */
template <typename T>
Named<T>
read_again (gpointer element, Named<T> &named)
{
  Named<T> fresh (locked (element, [&named] { return named.text; }));
  const ObjectLock lock (element);
  return named = std::move (fresh);
}

template <typename T>
struct Wire<Named<T>> {
  static void set (GValue *value, const Named<T> &named)
  {
    Wire<std::string>::set (value, named.text);
  }
  static Named<T> get (const GValue *value)
  {
    return Named<T> (Wire<std::string>::get (value));
  }
  static GParamSpec *spec (const char *name, const char *nick,
      const char *blurb, const Named<T> &standard, GParamFlags flags)
  {
    return Wire<std::string>::spec (name, nick, blurb, standard.text, flags);
  }
};

} // namespace codedexposure::gst
