# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tests of the Python package share: the package, recordings of the
simulated bench, and what the scripts make of them."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.setdefault("CODEDEXPOSURE_BUILD",
                                           str(ROOT / "build")))
os.environ.setdefault("GST_PLUGIN_PATH_1_0", str(BUILD / "gst"))
os.environ.setdefault("GST_REGISTRY_1_0", str(BUILD / "registry.bin"))
sys.path.insert(0, str(ROOT / "python"))

try:
    import gi  # pylint: disable=unused-import
    import numpy  # pylint: disable=unused-import
except ImportError as missing:
    print(f"skipped: {missing}; apt-get install python3-gi python3-numpy")
    sys.exit(77)

SCRATCH = pathlib.Path(tempfile.mkdtemp())


def clean():
    shutil.rmtree(SCRATCH)


def run(name, *arguments, status=0):
    """Runs a command of the program, which ends with this status."""
    done = subprocess.run([BUILD / "app/codedexposure", name, *arguments],
                          cwd=SCRATCH, capture_output=True, text=True,
                          check=False)
    assert done.returncode == status, done.stderr


def play(pipeline):
    subprocess.run([BUILD / "tests/pipeline/play", pipeline], cwd=SCRATCH,
                   check=True, capture_output=True)


def simulate(name, *options):
    """12 coded frames of 96x64 pixels, unless options say otherwise."""
    run("simulate", "--frames", "12", "--size", "96x64", "--scene", "pour",
        *options, "--output", name)


def decoded(name, *options, status=0):
    """The pixels that codedexposure decode writes, one frame after the other."""
    run("decode", name, *options, "--force", "--output", "fast.mkv",
        status=status)
    play("filesrc location=fast.mkv ! matroskademux ! avdec_ffv1 ! "
         "filesink location=fast.raw")
    return (SCRATCH / "fast.raw").read_bytes()


def pixels(frames):
    """The same of frames of the package."""
    return b"".join(frame.image.tobytes() for frame in frames)
