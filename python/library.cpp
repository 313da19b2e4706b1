/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Extractor and Fuser for numpy arrays, without a pipeline. */
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "extract/extractor.h"
#include "fuse/fuser.h"
#include "schedule/schedule.h"

namespace
{

namespace py = pybind11;
using namespace codedexposure;

/* Arrays with gaps between their pixels are copied. */
template <typename Pixel>
using Frame = py::array_t<Pixel, py::array::c_style>;

template <typename Value>
Value
unwrap (Result<Value> result)
{
  if (!result)
    throw py::value_error (result.error ().message);
  return std::move (*result);
}

void
unwrap (const Result<void> &result)
{
  if (!result)
    throw py::value_error (result.error ().message);
}

template <typename Pixel>
ImageView<const Pixel>
view_of (const Frame<Pixel> &frame)
{
  if (frame.ndim () != 2)
    throw py::value_error ("a frame has 2 dimensions, height and width; give "
                           "one frame at a time");
  return {frame.data (), int (frame.shape (1)), int (frame.shape (0)),
      frame.strides (0)};
}

/* Shape (n, height, width), and a view of each picture. */
template <typename Pixel>
struct Pictures {
  py::array_t<Pixel> array;
  std::vector<ImageView<Pixel>> views;

  Pictures (int n, Extent size) : array ({n, size.height, size.width})
  {
    for (int k = 0; k < n; k++)
      views.push_back ({array.mutable_data (k, 0, 0), size.width, size.height,
          std::ptrdiff_t (array.strides (1))});
  }
};

template <typename Call>
auto
without_gil (Call call)
{
  const py::gil_scoped_release release;
  return call ();
}

/* One of the values up to @last, whose names are @names. */
template <typename Value>
Value
named (const std::string &name, std::string_view (*name_of) (Value), Value last,
    const std::string &what, const std::string &names)
{
  for (int i = 0; i <= int (last); i++)
    if (name_of (Value (i)) == name)
      return Value (i);
  throw py::value_error (what + " '" + name + "' is not " + names);
}

template <typename Pixel>
Extractor<Pixel>
make_extractor (const std::string &schedule, int width, int height,
    const std::string &method, int bits)
{
  ExtractOptions options;
  options.method = named (method, method_name, Method::kDecode, "method",
      "auto, rank, select or decode");
  options.bits = bits;
  return unwrap (Extractor<Pixel>::make (
      unwrap (Schedule::parse (schedule)), width, height, options));
}

template <typename Pixel>
py::array_t<Pixel>
extract (const Extractor<Pixel> &extractor, const Frame<Pixel> &coded)
{
  const auto in = view_of (coded);
  Pictures<Pixel> out (extractor.subframes (), extractor.subframe_size ());
  unwrap (without_gil ([&] { return extractor.run (in, out.views); }));
  return out.array;
}

template <typename Pixel>
Fuser<Pixel>
make_fuser (const std::string &schedule, int width, int height,
    const std::string &quality, int bits, int lookahead, double full_well,
    double read_noise)
{
  FuseOptions options;
  options.quality = named (quality, quality_name, FuseQuality::kLearned,
      "quality", "fast, balanced, best or learned");
  options.bits = bits;
  options.lookahead = lookahead;
  options.noise.full_well = full_well;
  options.noise.read_noise = read_noise;
  return unwrap (Fuser<Pixel>::make (
      unwrap (Schedule::parse (schedule)), width, height, options));
}

template <typename Pixel>
void
take (Fuser<Pixel> &fuser, const Frame<Pixel> &coded)
{
  const auto in = view_of (coded);
  unwrap (without_gil ([&] { return fuser.take (in); }));
}

template <typename Pixel>
py::array_t<Pixel>
fuse (Fuser<Pixel> &fuser)
{
  Pictures<Pixel> out (fuser.slots (), fuser.size ());
  unwrap (without_gil ([&] { return fuser.fuse (out.views); }));
  return out.array;
}

template <typename Pixel>
void
bind (py::module_ &module, const std::string &depth)
{
  using namespace py::literals;
  const std::string extractor = "Extractor" + depth, fuser = "Fuser" + depth;
  py::class_<Extractor<Pixel>> (module, extractor.c_str (),
      "Splits coded frames of one size into subframes. Errors are ValueError.")
      .def (py::init (&make_extractor<Pixel>), "schedule"_a, "width"_a,
          "height"_a, "method"_a = "auto", "bits"_a = 0,
          "schedule is a preset; bits are significant bits, 0: all")
      .def ("__call__", &extract<Pixel>, "coded"_a,
          "The subframes of a coded frame of shape (height, width), shape (N, "
          "height, width)");
  py::class_<Fuser<Pixel>> (module, fuser.c_str (),
      "Fuses a stream of coded frames of one size to full-size frames. Errors "
      "are ValueError.")
      .def (py::init (&make_fuser<Pixel>), "schedule"_a, "width"_a, "height"_a,
          "quality"_a = "fast", "bits"_a = 0, "lookahead"_a = 0,
          "full_well"_a = 0.0, "read_noise"_a = 0.0,
          "The arguments of fuse_array; lookahead is 0 or 1 later frames")
      .def ("take", &take<Pixel>, "coded"_a,
          "Queues the coded frame that follows the last one")
      .def ("fuse", &fuse<Pixel>,
          "The frames of the oldest queued coded frame, shape (N, height, "
          "width)")
      .def_property_readonly (
          "pending", &Fuser<Pixel>::pending, "Queued coded frames")
      .def ("forget", &Fuser<Pixel>::forget,
          "Starts anew: the next frame does not continue the previous ones");
}

} // namespace

PYBIND11_MODULE (library, module)
{
  module.doc () = "The C++ library for frames in arrays, without a pipeline";
  bind<std::uint8_t> (module, "8");
  bind<std::uint16_t> (module, "16");
}
