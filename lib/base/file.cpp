/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>

#include "base/text.h"

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

Result<void>
write_file (const std::string &path, const std::string &content)
{
  namespace fs = std::filesystem;
  /* A file that is there stays as it is until the new one is complete; what is
   * no file, such as /dev/stdout, cannot be replaced. A link stays, too. */
  std::error_code failed;
  const bool known = fs::is_regular_file (path, failed);
  const bool replace = known || !fs::exists (fs::symlink_status (path, failed));
  const std::string target =
      known ? fs::canonical (path, failed).native () : path;
  const std::string beside = replace ? target + ".new" : target;
  std::ofstream file (beside, std::ios::binary | std::ios::trunc);
  bool written = file && file << content && file.flush ();
  if (written && replace) {
    file.close ();
    if (known)
      fs::permissions (beside, fs::status (target).permissions (), failed);
    written = file && std::rename (beside.c_str (), target.c_str ()) == 0;
  }
  if (!written) {
    Error error{"cannot be written to " + in_quotes (path, 200) + ": " +
                    std::strerror (errno),
        ErrorCode::io};
    if (replace)
      fs::remove (beside, failed);
    return error;
  }
  return {};
}

Result<void>
finish_output ()
{
  errno = 0;
  if (std::fflush (stdout) == 0 && std::ferror (stdout) == 0)
    return {};
  const std::string why =
      errno == 0 ? "" : ": " + std::generic_category ().message (errno);
  return Error{
      "the output cannot be written" + why +
          "; it is not complete: make room, or send it to another file",
      ErrorCode::io};
}

} // namespace codedexposure
