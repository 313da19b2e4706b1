/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The commands that DLPC350 and DLPC900 have in common, as bytes. */
#pragma once

#include <cstdint>

#include "dmd/hid_packet.h"

namespace codedexposure::dlp
{

constexpr HidCommand kVersion{0x0205, "read the firmware version"};
constexpr HidCommand kHardwareStatus{0x1A0A, "read the hardware status"};
constexpr HidCommand kMainStatus{0x1A0C, "read the main status"};
constexpr HidCommand kDisplayMode{0x1A1B, "set the display mode"};
constexpr HidCommand kTriggerOut2{0x1A1E, "set up trigger output 2"};
constexpr HidCommand kRun{0x1A24, "start or stop the patterns"};
constexpr HidCommand kTriggerIn1{0x1A35, "set up trigger input 1"};

constexpr std::uint8_t kRunStop = 0;
constexpr std::uint8_t kRunStart = 2;
/** Main status. */
constexpr std::uint8_t kParked = 1 << 0;
constexpr std::uint8_t kSequencerRuns = 1 << 1;
/** Hardware status. */
constexpr std::uint8_t kInitialised = 1 << 0;
constexpr std::uint8_t kSecondController = 1 << 4;

} // namespace codedexposure::dlp
