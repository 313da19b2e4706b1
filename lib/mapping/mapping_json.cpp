/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The versioned JSON form of mappings: docs/formats.md. */
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "base/file.h"
#include "base/text.h"
#include "schedule/json_forms.h"

namespace codedexposure
{

namespace
{

constexpr std::string_view kFormat = "coded-exposure-mapping";
constexpr int kVersion = 1;
constexpr std::size_t kTriangle =
    Mapping::kParameters * (Mapping::kParameters + 1) / 2;

Result<Extent>
read_extent (const Json &value, const std::string &key)
{
  const auto numbers = read_integers (value, key, Mapping::kMaxSize);
  if (!numbers)
    return numbers.error ();
  if (numbers->size () != 2)
    return expected (key, "two whole numbers, width and height", value);
  return Extent{numbers->front (), numbers->back ()};
}

/** The lower triangle, row by row. */
Result<Mapping::Covariance>
read_covariance (const Json &value)
{
  const auto numbers = read_reals (value, "covariance", kTriangle);
  if (!numbers)
    return numbers.error ();
  Mapping::Covariance covariance = {};
  auto number = numbers->begin ();
  for (std::size_t i = 0; i < Mapping::kParameters; i++)
    for (std::size_t j = 0; j <= i; j++)
      covariance[i * Mapping::kParameters + j] =
          covariance[j * Mapping::kParameters + i] = *number++;
  return covariance;
}

Result<Displacement>
read_displacement (const Json &value)
{
  const std::string key = "displacement";
  if (!value.is_object ())
    return expected (key, "an object", value);
  if (const auto checked =
          check_keys (value, " in displacement", {"columns", "rows", "x", "y"});
      !checked)
    return checked.error ();
  for (const char *needed : {"columns", "rows", "x", "y"})
    if (!value.contains (needed))
      return Error{
          "key 'displacement." + std::string (needed) +
              "' is missing; a displacement has columns, rows, x and y",
          ErrorCode::parse};

  Displacement grid;
  for (const auto &[name, field] :
      {std::pair ("columns", &grid.columns), std::pair ("rows", &grid.rows)}) {
    const auto count =
        read_integer (value[name], key + "." + name, Mapping::kMaxNodes);
    if (!count)
      return count.error ();
    *field = int (*count);
  }
  const std::size_t nodes =
      std::size_t (grid.columns) * std::size_t (grid.rows);
  for (const auto &[name, field] :
      {std::pair ("x", &grid.x), std::pair ("y", &grid.y)}) {
    auto numbers = read_reals (value[name], key + "." + name, nodes);
    if (!numbers)
      return numbers.error ();
    *field = std::move (*numbers);
  }
  return grid;
}

OrderedJson
displacement_json (const Displacement &grid)
{
  OrderedJson root;
  root["columns"] = grid.columns;
  root["rows"] = grid.rows;
  root["x"] = grid.x;
  root["y"] = grid.y;
  return root;
}

} // namespace

Result<Mapping>
read_mapping (const Json &root)
{
  if (const auto checked = check_head (root, kFormat, kVersion, "mapping");
      !checked)
    return checked.error ();
  if (const auto checked = check_keys (root, "",
          {"format", "version", "camera", "mirrors", "homography", "covariance",
              "displacement", "psf_sigma"});
      !checked)
    return checked.error ();
  for (const char *key : {"camera", "mirrors", "homography"})
    if (!root.contains (key))
      return Error{
          "key '" + std::string (key) +
              "' is missing; a mapping needs at least format, version, "
              "camera, mirrors and homography",
          ErrorCode::parse};

  Mapping::Parts parts;
  for (const auto &[name, field] : {std::pair ("camera", &parts.camera),
           std::pair ("mirrors", &parts.mirrors)}) {
    const auto size = read_extent (root[name], name);
    if (!size)
      return size.error ();
    *field = *size;
  }
  const auto numbers =
      read_reals (root["homography"], "homography", parts.homography.size ());
  if (!numbers)
    return numbers.error ();
  std::copy (numbers->begin (), numbers->end (), parts.homography.begin ());
  if (root.contains ("covariance")) {
    const auto covariance = read_covariance (root["covariance"]);
    if (!covariance)
      return covariance.error ();
    parts.covariance = *covariance;
  }
  if (root.contains ("displacement")) {
    auto grid = read_displacement (root["displacement"]);
    if (!grid)
      return grid.error ();
    parts.displacement = std::move (*grid);
  }
  if (root.contains ("psf_sigma")) {
    if (!root["psf_sigma"].is_number ())
      return expected ("psf_sigma", "a number of pixels", root["psf_sigma"]);
    parts.psf_sigma = root["psf_sigma"].get<double> ();
  }
  return Mapping::make (std::move (parts));
}

Result<Mapping>
Mapping::from_json (std::string_view json)
try {
  const std::string what = "mapping JSON: ";
  if (json.size () > kMaxJsonSize)
    return Error{what + "more than " + std::to_string (kMaxJsonSize) +
                     " bytes; no mapping is that long",
        ErrorCode::parse};
  const auto root = parse_strictly (json, "mapping");
  if (!root)
    return root.error ().with_prefix (what);
  auto mapping = read_mapping (*root);
  if (!mapping)
    return mapping.error ().with_prefix (what);
  return mapping;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

std::string
Mapping::to_json () const
{
  OrderedJson root;
  root["format"] = kFormat;
  root["version"] = kVersion;
  root["camera"] = {camera ().width, camera ().height};
  root["mirrors"] = {mirrors ().width, mirrors ().height};
  root["homography"] = homography ();
  if (covariance ()) {
    OrderedJson triangle = OrderedJson::array ();
    for (std::size_t i = 0; i < kParameters; i++)
      for (std::size_t j = 0; j <= i; j++)
        triangle.push_back ((*covariance ())[i * kParameters + j]);
    root["covariance"] = std::move (triangle);
  }
  if (displacement ())
    root["displacement"] = displacement_json (*displacement ());
  if (psf_sigma () != 0.0)
    root["psf_sigma"] = psf_sigma ();
  return root.dump ();
}

Result<Mapping>
Mapping::load (const std::string &path)
try {
  const auto text = read_file (path, kMaxJsonSize);
  if (!text)
    return text.error ().with_prefix (
        "mapping file " + in_quotes (path, 200) + ": ");
  auto mapping = from_json (*text);
  if (!mapping)
    return mapping.error ().with_prefix (
        "file " + in_quotes (path, 200) + ": ");
  return mapping;
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Result<void>
Mapping::save (const std::string &path) const
try {
  std::ofstream file (path, std::ios::binary | std::ios::trunc);
  if (!file || !(file << to_json () << '\n') || !file.flush ())
    return Error{"the mapping cannot be written to " + in_quotes (path, 200) +
                     ": " + std::strerror (errno),
        ErrorCode::io};
  return {};
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

} // namespace codedexposure
