/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/file.h"

#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>

namespace codedexposure
{

Result<std::string>
read_file (const std::string &path, std::size_t limit)
{
  const auto failure = [] (const char *what) {
    return Error{
        std::string (what) + ": " + std::generic_category ().message (errno),
        errno == ENOENT ? ErrorCode::not_found : ErrorCode::io};
  };
  const std::unique_ptr<std::FILE, int (*) (std::FILE *)> file (
      std::fopen (path.c_str (), "rb"), std::fclose);
  if (!file)
    return failure ("it cannot be opened");

  std::string content (limit + 1, '\0');
  content.resize (
      std::fread (content.data (), 1, content.size (), file.get ()));
  if (std::ferror (file.get ()) != 0)
    return failure ("it cannot be read");
  return content;
}

} // namespace codedexposure
