/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/alp.h"

#include <array>
#include <string_view>
#include <utility>

#include "base/try.h"
#include "dmd/bitmap.h"

namespace codedexposure
{

namespace
{

/* Names in capitals between @ are replaced. */
constexpr std::string_view kScript = R"py(#!/usr/bin/env python3
"""Shows the masks of a coded exposure on a ViALUX board, until Ctrl-C.

@WHAT@.

Needs the ALP-4 library that comes with the board, numpy, and ALP4lib:
    pip install ALP4lib
The first gated output of the board gives the camera a pulse at the start of
each exposure.
"""
import argparse
import ctypes
import pathlib
import time

import ALP4
import numpy

PLANES = pathlib.Path(__file__).with_name(@PLANES@)
WIDTH, HEIGHT = @WIDTH@, @HEIGHT@  # mirrors
PICTURES = @PICTURES@  # bit planes, one for each mask
SLOTS = @SLOTS@  # pictures of an exposure
PERIOD = @PERIOD@  # of a picture, us


def read_planes():
    """Return the pictures, a byte for each mirror: 0 is off, 255 is on."""
    planes = numpy.fromfile(PLANES, numpy.uint8)
    if planes.size * 8 != PICTURES * WIDTH * HEIGHT:
        raise SystemExit(f"{PLANES} is not the file that belongs to this program; "
                         "render both again")
    return numpy.unpackbits(planes) * 255


def load(board):
    """Send the pictures, and set their times."""
    if (board.nSizeX, board.nSizeY) != (WIDTH, HEIGHT):
        raise SystemExit(f"the board has {board.nSizeX}x{board.nSizeY} mirrors, "
                         f"and these masks {WIDTH}x{HEIGHT}; render them with "
                         f"--dmd alp:{board.nSizeX}x{board.nSizeY}")
    pictures = read_planes()
    board.SeqAlloc(nbImg=PICTURES, bitDepth=1)
    board.SeqControl(ALP4.ALP_BITNUM, 1)
    board.SeqControl(ALP4.ALP_BIN_MODE, ALP4.ALP_BIN_UNINTERRUPTED)
    least = board.SeqInquire(ALP4.ALP_MIN_PICTURE_TIME)
    if least > PERIOD:
        raise SystemExit(f"the board shows a picture for {least} us or more, and "
                         f"these masks for {PERIOD} us; use fewer slots or a "
                         "lower frame rate")
    board.SetTiming(pictureTime=PERIOD)
    got = board.SeqInquire(ALP4.ALP_PICTURE_TIME)
    if got != PERIOD:
        raise SystemExit(f"the board took {got} us for a picture, not {PERIOD}")
    board.SeqPut(pictures)


def trigger_camera(board):
    """One pulse for all pictures of an exposure, at the first of them."""
    gate = ALP4.tAlpDynSynchOutGate()
    gate.Period = SLOTS
    gate.Polarity = 1
    gate.Gate[0] = 1
    # Not by DevControlEx (), which fails in some versions of ALP4lib.
    failed = board._ALPLib.AlpDevControlEx(
        board.ALP_ID, ALP4.ALP_DEV_DYN_SYNCH_OUT1_GATE, ctypes.byref(gate))
    if failed:
        raise SystemExit(f"the board did not take the pulses: error {failed}")
    board.ProjControl(ALP4.ALP_PROJ_MODE, ALP4.ALP_MASTER)


def main():
    options = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--version", default="4.3",
                         help="of the library of the board [4.3]")
    options.add_argument("--library", metavar="FOLDER",
                         help="where the library is [as Windows says]")
    given = options.parse_args()
    board = ALP4.ALP4(version=given.version, libDir=given.library)
    board.Initialize()
    try:
        load(board)
        trigger_camera(board)
        board.Run(loop=True)
        print(f"{PICTURES} masks of {PERIOD} us, {SLOTS} an exposure; stop with "
              "Ctrl-C", flush=True)
        while True:
            time.sleep(1)
    except KeyboardInterrupt:
        print("stopped")
    finally:
        board.Halt()
        board.Free()


if __name__ == "__main__":
    main()
)py";

/* As a Python literal. */
std::string
in_python (const std::string &text)
{
  std::string literal = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      literal += '\\';
    literal += c == '\n' ? "\\n" : std::string (1, c);
  }
  return literal + "\"";
}

} // namespace

Result<AlpSequence>
alp_sequence (
    const DmdInfo &info, const Schedule &schedule, const SlotPlan &plan)
{
  RETURN_IF_ERROR (check_limits (info, schedule, plan));
  ASSIGN_OR_RETURN (
      const PatternTime time, fit_equal_patterns (plan, *info.patterns));
  return AlpSequence{schedule.masks (), schedule.slots (), int (time.exposure)};
}

void
append_bit_plane (Bytes &planes, const MirrorRows<std::uint8_t> &mirrors)
{
  const auto row_bytes = std::size_t (mirrors.width () + 7) / 8;
  for (int y = 0; y < mirrors.height (); y++)
    append_bits (planes, mirrors, y, row_bytes);
}

std::string
alp_script (const AlpSequence &sequence, Extent size, const std::string &planes,
    const std::string &what)
{
  const std::array<std::pair<std::string_view, std::string>, 7> values{
      {{"WHAT", what}, {"PLANES", in_python (planes)},
          {"WIDTH", std::to_string (size.width)},
          {"HEIGHT", std::to_string (size.height)},
          {"PICTURES", std::to_string (sequence.pictures)},
          {"SLOTS", std::to_string (sequence.slots)},
          {"PERIOD", std::to_string (sequence.period)}}};
  std::string script;
  std::string_view rest = kScript;
  for (auto at = rest.find ('@'); at != rest.npos; at = rest.find ('@')) {
    const auto end = rest.find ('@', at + 1);
    script += rest.substr (0, at);
    for (const auto &[name, value] : values)
      if (rest.substr (at + 1, end - at - 1) == name)
        script += value;
    rest.remove_prefix (end + 1);
  }
  return script + std::string (rest);
}

} // namespace codedexposure
