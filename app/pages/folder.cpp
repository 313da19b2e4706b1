/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "folder.h"

#include <cstdio>
#include <filesystem>

#include "base/file.h"
#include "failure.h"
#include "pipeline/pictures.h"

namespace codedexposure::app
{

namespace fs = std::filesystem;

namespace
{

std::string
without_slash (std::string name)
{
  while (name.size () > 1 && name.ends_with ("/"))
    name.pop_back ();
  return name;
}

/* Pictures that the new ones would not replace. */
void
remove_pictures (const fs::path &folder)
{
  std::error_code ignored;
  const PictureNames names{folder, "", "%06d", ".png"};
  if (!fs::exists (folder / names.table (), ignored))
    return;
  for (const auto &entry : fs::directory_iterator (folder, ignored))
    if (names.include (entry.path ().filename ()))
      fs::remove (entry.path (), ignored);
}

void
check_folder (const std::string &folder, bool replace)
{
  std::error_code ignored;
  if (!fs::exists (folder, ignored))
    return;
  if (!fs::is_directory (folder, ignored))
    fail (folder + " is a file; name a folder");
  if (!replace && !fs::is_empty (folder, ignored))
    fail (folder + " is not empty; choose another folder, or set --force to "
                   "replace what an earlier run has written");
}

} // namespace

PageFolder::PageFolder (const std::string &name, bool replace)
    : name_ (without_slash (name)), part_ (name_, Part::kFolder)
{
  check_folder (name_, replace);
  value_of (part_.claim (replace));
}

PageFolder::~PageFolder ()
{
  part_.discard ();
}

std::string
PageFolder::path (const std::string &file) const
{
  return part_.path () + "/" + file;
}

void
PageFolder::write (const std::string &file, const std::string &content) const
{
  if (const auto written = write_file (path (file), content); !written)
    fail (name_ + "/" + file + " " + written.error ().message);
}

void
PageFolder::publish ()
{
  std::error_code error;
  const fs::path from = part_.path (), to = name_;
  const fs::path page = "index.html";
  fs::create_directories (to, error);
  // A signal may end this program at any moment: all files get their names at
  // once, or those of an earlier page are replaced and the page comes last.
  if (fs::is_empty (to, error) && std::rename (from.c_str (), to.c_str ()) == 0)
    return;
  for (auto entry = fs::recursive_directory_iterator (from, error);
       !error && entry != fs::recursive_directory_iterator (); ++entry) {
    const fs::path name = entry->path ().lexically_relative (from);
    if (entry->is_directory ()) {
      fs::create_directories (to / name, error);
      remove_pictures (to / name);
    } else if (name != page)
      fs::rename (entry->path (), to / name, error);
  }
  if (!error)
    fs::rename (from / page, to / page, error);
  if (error)
    fail ("cannot write " + name_ + ": " + error.message () +
          "; choose a folder that you can write to");
}

} // namespace codedexposure::app
