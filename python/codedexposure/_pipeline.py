# SPDX-License-Identifier: LGPL-2.1-or-later
"""GStreamer: finds the plugin, plays a pipeline, turns messages into exceptions
and warnings."""
from __future__ import annotations

import json
import os
import pathlib
import sys
import warnings

try:
    import gi
    gi.require_version("Gst", "1.0")
    from gi.repository import GLib, GObject, Gst
except (ImportError, ValueError) as missing:
    raise ImportError(
        f"{missing}: codedexposure needs PyGObject and GStreamer for this "
        "interpreter; on Debian, use /usr/bin/python3 and apt-get install "
        "python3-gi gir1.2-gstreamer-1.0") from missing


class Error(Exception):
    """What cannot be read or decoded, in the words of the element."""


class UncountableError(Error, TypeError):
    """Frames that can only be read in a loop. list () asks for their number,
    and takes a TypeError for an answer."""


class RecordingWarning(UserWarning):
    """Frames are lost, damaged or of unknown state, or the recording ended
    early. To raise these as exceptions:
    warnings.simplefilter("error", codedexposure.RecordingWarning)"""


# Each loss is said, not only the first in a line of a script.
warnings.simplefilter("always", RecordingWarning, append=True)


# Of the source tree around this file, if there is one.
_ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("CODEDEXPOSURE_BUILD", _ROOT / "build"))


def _has_plugin(folder: pathlib.Path | None = None) -> bool:
    """Whether GStreamer finds the plugin, if need be in this folder."""
    if folder and (folder / "libgstcodedexposure.so").exists():
        Gst.Registry.get().scan_path(str(folder))
    return bool(Gst.ElementFactory.find("codedexposure-demux"))


def _find_plugin() -> None:
    """In the build tree around this file, where GStreamer looks, or below the
    prefix of PREFIX/lib/python3/dist-packages."""
    Gst.init(None)
    if _has_plugin(BUILD / "gst"):
        return
    if any(_has_plugin(folder) for pattern in ("", "*/")
           for folder in _ROOT.parent.glob(pattern + "gstreamer-1.0")):
        return
    raise ImportError(
        "GStreamer does not find the plugin codedexposure; install it, or set "
        "GST_PLUGIN_PATH to the folder of libgstcodedexposure.so")


_find_plugin()


def quoted(text) -> str:
    """A text as a value in a pipeline."""
    text = str(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{text}"'


def _check(spec, name: str, value) -> None:
    """Raises ValueError for a value that GStreamer would drop."""
    least = getattr(spec, "minimum", None)
    if least is not None and not least <= value <= spec.maximum:
        raise ValueError(
            f"{name} is from {least} to {spec.maximum}, not {value}")
    if spec.value_type.is_a(GObject.TYPE_ENUM):
        choices = [choice.value_nick for choice
                   in type(spec.default_value).__enum_values__.values()]
        if value not in choices:
            raise ValueError(
                f"{name} is {', '.join(choices[:-1])} or {choices[-1]}, not "
                f"{value}")


def element(kind: str, **values) -> str:
    """The element with its properties, as in a pipeline; None: the default. A
    dict is given as the text of its JSON form."""
    made, text = Gst.ElementFactory.make(kind), kind
    for name, value in values.items():
        if value is None:
            continue
        spec = made.find_property(name.replace("_", "-"))
        _check(spec, name, value)
        if isinstance(value, dict):
            value = json.dumps(value)
        text += f" {spec.name}={quoted(value)}"
    return text


_SETUP = "coded-exposure="  # a comment in the tags


class ContainerError(Error):
    """The index or the tags of a file are damaged."""


def _text_of(message, error, debug) -> str:
    source = message.src
    name = source.get_name()
    if error.matches(Gst.ResourceError.quark(), error.code) \
            and source.find_property("location"):
        name = source.get_property("location")
    _, _, detail = (debug or "").partition("\n")
    return f"{name}: {error.message}" + (f"\n    {detail}" if detail else "")


def _error_of(message) -> Error:
    error, debug = message.parse_error()
    factory = getattr(message.src, "get_factory", lambda: None)()
    kind = factory.get_name() if factory else ""
    of_container = (
        kind in ("codedexposure-recorddemux", "filesrc")
        and error.matches(Gst.StreamError.quark(), error.code))
    return (ContainerError if of_container else Error)(
        _text_of(message, error, debug))


# Why dmdsync drops a frame; a duplicate is none that is lost.
_DROPPED = {
    "before-start": "it was exposed before the stream began",
    "not-locked": "its masks were not synchronised",
    "incomplete": "a part of it is missing",
}


def _position(message, name: str) -> str:
    """A time of an element message, as Frame.time counts."""
    time = message.get_structure().get_value(name)
    pad = message.src.get_static_pad("src")
    segment = pad and pad.get_sticky_event(Gst.EventType.SEGMENT, 0)
    if segment:
        sign, position = segment.parse_segment().to_stream_time_full(
            Gst.Format.TIME, time)
        time = position if sign > 0 else time
    return f"{time * 1e-9:.3f} s"


def _loss_in(message) -> str | None:
    """What an element message says of lost or damaged frames."""
    structure = message.get_structure()
    name, value = structure.get_name(), structure.get_value
    of = " of the second camera" if structure.has_field("camera") else ""
    if name == "codedexposure/frames-lost":
        return (f"coded frames{of} were lost before "
                f"{_position(message, 'to')}: {value('count')}")
    if name == "dmdsync/frame-dropped" and value("reason") in _DROPPED:
        return (f"coded frame {value('frame')}{of} was dropped: "
                f"{_DROPPED[value('reason')]}")
    if name == "codedexposure/frames-damaged":
        first = _position(message, "from")
        if structure.has_field("frame"):
            first = f"frame {value('frame')} ({first})"
        return (f"from {first} on, frames{of} are corrupted: {value('reason')}"
                if value("active") else
                f"corrupted frames{of} from {first} on: {value('count')}")
    if name == "codedexposure/frames-missing":
        return (f"from {_position(message, 'from')} on, recorded frames{of} are "
                f"missing: {value('count')}")
    if name == "codedexposure/not-coded":
        return (f"from {_position(message, 'from')} on, the mirrors show "
                f"{value('pattern')} and frames are not decoded")
    if name == "codedexposure/partner-lost" and not value("active"):
        return (f"from {_position(message, 'from')} on, coded frames have no "
                f"complement ({value('reason')}): {value('frames')}")
    if name == "codedexposure/stream-cut":
        return (f"the stream{of} ended without its last line: it was cut off, its "
                "sender was stopped, or it is a segment of a longer recording")
    if name == "codedexposure/stream-incomplete":
        return (f"recorded frames{of} are missing with all that is known of them: "
                f"{value('count')}; the recording is damaged, or this is not "
                "its first part")
    return None


class Player:
    """Plays a pipeline with an appsink named "out", whose samples are iterated.

    Losses and warnings of the elements are RecordingWarnings with @p about,
    errors are exceptions. quiet drops the warnings. part: the coded frames at
    times from the first on and before the second, ns; None: to the end.
    """

    process: int | None = None  # that has played a pipeline

    def __init__(self, description: str, about: str, quiet: bool = False,
                 part: tuple[int, int | None] | None = None):
        # Its threads, which GStreamer counts on, are not in a copy of it.
        if Player.process not in (None, os.getpid()):
            raise Error(
                "this process was forked from one that had already used "
                "codedexposure, whose threads it lacks; start it anew, as "
                'multiprocessing.get_context("spawn") does')
        Player.process = os.getpid()
        self.about = about
        self.quiet = quiet
        self.part = part
        self.was_cut = False  # the stream ended before its last line
        self._error: Error | None = None  # that is raised behind a sample
        try:
            self.pipeline = Gst.parse_launch(description)
        except GLib.Error as error:
            raise Error(error.message) from None
        self.out = self.pipeline.get_by_name("out")
        self.bus = self.pipeline.get_bus()
        self._setups: list[str] = []
        self._pad = self.out.get_static_pad("sink")
        self._probe = self._pad.add_probe(
            Gst.PadProbeType.EVENT_DOWNSTREAM | Gst.PadProbeType.EVENT_FLUSH,
            self._on_event)

    def __enter__(self):
        try:
            if self.part:
                self._seek(*self.part)
        except Error:
            self.__exit__()
            raise
        self.pipeline.set_state(Gst.State.PLAYING)
        return self

    def _seek(self, start: int, stop: int | None) -> None:
        """While the first frame is held, what is said of it included."""
        self.pipeline.set_state(Gst.State.PAUSED)
        while not (message := self.bus.timed_pop_filtered(
                Gst.SECOND, Gst.MessageType.ASYNC_DONE | Gst.MessageType.ERROR)):
            pass
        if message.type == Gst.MessageType.ERROR:
            raise _error_of(message)
        if not self.pipeline.seek(
                1.0, Gst.Format.TIME, Gst.SeekFlags.FLUSH | Gst.SeekFlags.ACCURATE,
                Gst.SeekType.SET, start,
                Gst.SeekType.NONE if stop is None else Gst.SeekType.SET,
                -1 if stop is None else stop):
            raise Error(f"{self.about}: {start * 1e-9} s cannot be sought; read "
                        "the frames in a loop")

    def __exit__(self, *_):
        self.pipeline.set_state(Gst.State.NULL)
        # It would keep both alive, and with them a camera.
        self._pad.remove_probe(self._probe)

    def warn(self, text: str) -> None:
        """A RecordingWarning."""
        if self.quiet:
            return
        # At the line of the caller, outside of this package.
        frame, level = sys._getframe(), 1
        while frame.f_back and frame.f_globals["__name__"].startswith(
                __package__):
            frame, level = frame.f_back, level + 1
        warnings.warn(f"{self.about}: {text}", RecordingWarning, level)

    def _heed(self, message) -> None:
        if message.type == Gst.MessageType.ERROR:
            self._error = _error_of(message)
        elif message.type == Gst.MessageType.WARNING:
            error, debug = message.parse_warning()
            self.warn(_text_of(message, error, debug))
        elif message.type == Gst.MessageType.ELEMENT:
            self.was_cut |= message.get_structure().get_name() \
                == "codedexposure/stream-cut"
            text = _loss_in(message)
            if text:
                self.warn(text)

    def heed_messages(self) -> None:
        """Warns of what the elements have posted, and keeps an error."""
        kinds = (Gst.MessageType.ERROR | Gst.MessageType.WARNING
                 | Gst.MessageType.ELEMENT)
        while message := not self._error and self.bus.pop_filtered(kinds):
            self._heed(message)

    def _on_event(self, _, info):
        event = info.get_event()
        if event.type == Gst.EventType.FLUSH_STOP:
            # Frames that were read before the seek are not of this part, nor
            # is what was said of them.
            while self.bus.pop():
                pass
        elif event.type == Gst.EventType.TAG:
            tags = event.parse_tag()
            for i in range(tags.get_tag_size(Gst.TAG_COMMENT)):
                comment = tags.get_string_index(Gst.TAG_COMMENT, i)[1]
                if comment.startswith(_SETUP):
                    self._setups.append(comment.removeprefix(_SETUP))
        return Gst.PadProbeReturn.OK

    def setups(self) -> list[dict]:
        """Those of the stream so far, one after the other."""
        return [json.loads(setup) for setup in self._setups]

    def __iter__(self):
        # An element that fails may never end the stream, so the wait for a
        # sample is limited and messages are read in between.
        wait = 50 * Gst.MSECOND
        while not self._error:
            ended = self.out.get_property("eos")
            sample = self.out.emit("try-pull-sample", wait)
            # What is said of a sample is posted before it comes, and nothing
            # reads on if it was the only one that was asked for.
            self.heed_messages()
            if sample:
                yield sample
            elif ended:
                break
        if self._error:
            raise self._error
