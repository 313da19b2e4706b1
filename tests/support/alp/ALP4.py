# SPDX-License-Identifier: LGPL-2.1-or-later
"""A stand-in for ALP4lib and the library of a ViALUX board.

Written from the public header of ALP-4: it knows the rules that are there, and
writes what a program did to the file that ALP_LOG names, as JSON. Run () ends
the program, as Ctrl-C does.
"""
import ctypes
import json
import os
import signal
import threading

ALP_DEV_DYN_SYNCH_OUT1_GATE = 2023
ALP_BITNUM, ALP_BIN_MODE = 2103, 2104
ALP_BIN_NORMAL, ALP_BIN_UNINTERRUPTED = 2105, 2106
ALP_PICTURE_TIME, ALP_MIN_PICTURE_TIME = 2203, 2211
ALP_PROJ_MODE, ALP_MASTER, ALP_SLAVE = 2300, 2301, 2302


class tAlpDynSynchOutGate(ctypes.Structure):
    _fields_ = [("Period", ctypes.c_ubyte), ("Polarity", ctypes.c_ubyte),
                ("Gate", ctypes.c_ubyte * 16)]


class Library:
    """Functions of the library that ALP4lib does not wrap well."""

    def __init__(self, board):
        self.board = board

    def AlpDevControlEx(self, device, control, gate):
        gate = gate._obj
        if device is not self.board.ALP_ID or not 1 <= gate.Period <= 16:
            return 1005  # parameter invalid
        assert control == ALP_DEV_DYN_SYNCH_OUT1_GATE and not self.board.runs
        self.board.said["gate"] = [gate.Polarity, list(gate.Gate[:gate.Period])]
        return 0


class ALP4:
    def __init__(self, version="4.3", libDir=None):
        self.said = {"version": version, "library": libDir, "calls": []}
        self.ALP_ID = object()
        self.runs = False
        self.controls = {}

    def _call(self, name):
        self.said["calls"].append(name)

    def Initialize(self, DeviceNum=None):
        self.nSizeX, self.nSizeY = map(int, os.environ["ALP_SIZE"].split("x"))
        self._ALPLib = Library(self)
        self._call("Initialize")

    def SeqAlloc(self, nbImg=1, bitDepth=1):
        self.said["pictures"], self.said["bits"] = nbImg, bitDepth

    def SeqControl(self, controlType, value, SequenceId=None):
        self.controls[controlType] = value

    def SeqInquire(self, inquireType, SequenceId=None):
        if inquireType == ALP_MIN_PICTURE_TIME:
            # Without dark phase it is shorter.
            fast = self.controls.get(ALP_BIN_MODE) == ALP_BIN_UNINTERRUPTED
            return 44 if fast else 2 * 44
        assert inquireType == ALP_PICTURE_TIME
        return self.said["period"]

    def SetTiming(self, SequenceId=None, illuminationTime=None, pictureTime=None,
                  synchDelay=None, synchPulseWidth=None, triggerInDelay=None):
        self.said["period"] = pictureTime + int(os.environ.get("ALP_SLOW", 0))

    def SeqPut(self, imgData, SequenceId=None, PicOffset=0, PicLoad=0,
               dataFormat="Python"):
        assert not self.runs and dataFormat == "Python"
        assert len(imgData) == self.said["pictures"] * self.nSizeX * self.nSizeY
        assert set(imgData.tolist()) <= {0, 255}
        imgData.tofile(os.environ["ALP_LOG"] + ".raw")

    def ProjControl(self, controlType, value):
        assert not self.runs
        self.controls[controlType] = value

    def Run(self, SequenceId=None, loop=True):
        self.runs = True
        self.said["mode"] = [self.controls[ALP_BITNUM], self.controls[ALP_BIN_MODE],
                             self.controls[ALP_PROJ_MODE], loop]
        self._call("Run")
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()

    def Halt(self):
        self.runs = False
        self._call("Halt")

    def Free(self):
        assert not self.runs
        self._call("Free")
        with open(os.environ["ALP_LOG"], "w", encoding="utf-8") as log:
            json.dump(self.said, log)
