/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The versioned JSON form of mappings: docs/formats.md. */
#include "mapping/json.h"

#include "base/try.h"

namespace codedexposure
{

namespace
{

const JsonHead kHead{"mapping", "coded-exposure-mapping", 1};

/** The lower triangle, row by row. */
Mapping::Covariance
read_covariance (const Json &value, const std::string &key)
{
  constexpr std::size_t n = Mapping::kParameters;
  std::array<double, n *(n + 1) / 2> triangle;
  numbers_into (triangle) (value, key);
  Mapping::Covariance covariance = {};
  auto number = triangle.begin ();
  for (std::size_t i = 0; i < n; i++)
    for (std::size_t j = 0; j <= i; j++)
      covariance[i * n + j] = covariance[j * n + i] = *number++;
  return covariance;
}

Displacement
read_displacement (const Json &value, const std::string &key)
{
  Displacement grid;
  const auto nodes_into = [&grid] (std::vector<double> &to) {
    return [&] (const Json &list, const std::string &name) {
      to.resize (std::size_t (grid.columns) * std::size_t (grid.rows));
      numbers_into (to) (list, name);
    };
  };
  read_keys (value, key, "a displacement has columns, rows, x and y",
      {{"columns", integer_into (grid.columns, Mapping::kMaxNodes), true},
          {"rows", integer_into (grid.rows, Mapping::kMaxNodes), true},
          {"x", nodes_into (grid.x), true}, {"y", nodes_into (grid.y), true}});
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

Mapping
read_mapping (const Json &root)
{
  Mapping::Parts parts;
  read_versioned (root, kHead,
      "a mapping needs at least format, version, camera, mirrors and "
      "homography",
      {
          {"camera", size_into (parts.camera, Mapping::kMaxSize), true},
          {"mirrors", size_into (parts.mirrors, Mapping::kMaxSize), true},
          {"homography", numbers_into (parts.homography), true},
          {"covariance",
              [&parts] (const Json &value, const std::string &key) {
                parts.covariance = read_covariance (value, key);
              }},
          {"displacement",
              [&parts] (const Json &value, const std::string &key) {
                parts.displacement = read_displacement (value, key);
              }},
          {"psf_sigma", number_into (parts.psf_sigma, "a number of pixels")},
      });
  return or_throw (Mapping::make (std::move (parts)));
}

Result<Mapping>
Mapping::from_json (std::string_view json)
{
  return read_json<Mapping> (json, kHead.what, kMaxJsonSize, read_mapping);
}

std::string
Mapping::to_json () const
{
  OrderedJson root;
  root["format"] = kHead.format;
  root["version"] = kHead.version;
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
  return json_text (root);
}

Result<Mapping>
Mapping::load (const std::string &path)
{
  return load_json (path, "mapping file", kMaxJsonSize, from_json);
}

Result<void>
Mapping::save (const std::string &path) const
try {
  return with_prefix (write_file (path, to_json () + '\n'), "the mapping ");
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

} // namespace codedexposure
