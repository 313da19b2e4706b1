/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/usb_bus.h"

#include <algorithm>
#include <array>
#include <optional>

#include <libusb.h>

#include "base/free_with.h"
#include "base/text.h"
#include "base/try.h"
#include "dmd/drivers.h"

namespace codedexposure
{

namespace
{

constexpr int kInterface = 0;
constexpr int kMaxPorts = 7;

using Context = std::shared_ptr<libusb_context>;
using Device = std::shared_ptr<libusb_device>;
using Handle = std::unique_ptr<libusb_device_handle, FreeWith<libusb_close>>;

Error
usb_error (const std::string &what, int code)
{
  std::string text = what + ": " + libusb_strerror (libusb_error (code));
  if (code == LIBUSB_ERROR_ACCESS)
    text += "; install the udev rule 60-codedexposure-dmd.rules and connect "
            "the board again";
  if (code == LIBUSB_ERROR_BUSY)
    text += "; another program uses the board, such as TI's";
  return Error{text, code == LIBUSB_ERROR_TIMEOUT     ? ErrorCode::timeout
                     : code == LIBUSB_ERROR_NO_DEVICE ? ErrorCode::not_found
                     : code == LIBUSB_ERROR_NO_MEM    ? ErrorCode::out_of_memory
                     : code == LIBUSB_ERROR_ACCESS    ? ErrorCode::denied
                     : code == LIBUSB_ERROR_BUSY      ? ErrorCode::busy
                                                      : ErrorCode::io};
}

Result<Context>
make_context ()
{
  libusb_context *context = nullptr;
  if (const int code = libusb_init (&context); code != 0)
    return usb_error ("cannot use the USB", code);
  return Context (context, libusb_exit);
}

std::string
port_of (libusb_device *device)
{
  std::array<std::uint8_t, kMaxPorts> ports{};
  const int depth =
      libusb_get_port_numbers (device, ports.data (), int (ports.size ()));
  std::string text = std::to_string (libusb_get_bus_number (device));
  for (int i = 0; i < depth; i++) {
    text.push_back (i == 0 ? '-' : '.');
    text += std::to_string (ports[std::size_t (i)]);
  }
  return text;
}

struct Found {
  Device device;
  UsbBoard board;
  libusb_device_descriptor descriptor;
};

/** A device that is one of the boards; its serial number is not read yet. */
std::optional<Found>
recognise (libusb_device *device)
{
  libusb_device_descriptor descriptor{};
  if (libusb_get_device_descriptor (device, &descriptor) != 0 ||
      descriptor.idVendor != kUsbVendor ||
      (descriptor.idProduct != kUsbDlpc350 &&
          descriptor.idProduct != kUsbDlpc900))
    return std::nullopt;
  const auto controller = descriptor.idProduct == kUsbDlpc350
                              ? Controller::dlpc350
                              : Controller::dlpc900;
  return Found{Device (libusb_ref_device (device), libusb_unref_device),
      UsbBoard{controller, port_of (device), "", ""}, descriptor};
}

Result<Handle>
open_handle (const Found &found, const std::string &what)
{
  libusb_device_handle *raw = nullptr;
  if (const int code = libusb_open (found.device.get (), &raw); code != 0)
    return usb_error (what, code);
  return Handle (raw);
}

void
read_serial (Found &found)
{
  const auto handle = open_handle (found, "cannot open it");
  if (!handle) {
    found.board.trouble = handle.error ().message;
    return;
  }
  std::array<unsigned char, 256> text{};
  if (found.descriptor.iSerialNumber == 0)
    return;
  const int length = libusb_get_string_descriptor_ascii (handle->get (),
      found.descriptor.iSerialNumber, text.data (), int (text.size ()));
  found.board.serial = printable (
      std::string (text.begin (), text.begin () + std::max (length, 0)));
}

Result<std::vector<Found>>
find_boards (const Context &context)
{
  libusb_device **list = nullptr;
  const ssize_t count = libusb_get_device_list (context.get (), &list);
  if (count < 0)
    return usb_error ("cannot list the USB", int (count));
  std::vector<Found> found;
  for (ssize_t i = 0; i < count; i++)
    if (auto board = recognise (list[i]))
      found.push_back (*std::move (board));
  libusb_free_device_list (list, 1);
  std::sort (found.begin (), found.end (), [] (const Found &a, const Found &b) {
    return a.board.port < b.board.port;
  });
  return found;
}

/** The two endpoints of the interface and their type. */
struct Endpoints {
  std::uint8_t out = 0;
  std::uint8_t in = 0;
  bool interrupt = true;
};

Result<Endpoints>
find_endpoints (libusb_device *device)
{
  libusb_config_descriptor *config = nullptr;
  if (const int code = libusb_get_active_config_descriptor (device, &config);
      code != 0)
    return usb_error ("cannot read its descriptor", code);
  Endpoints endpoints;
  for (int i = 0; i < config->bNumInterfaces; i++) {
    if (config->interface[i].num_altsetting < 1)
      continue;
    const libusb_interface_descriptor &face =
        config->interface[i].altsetting[0];
    if (face.bInterfaceNumber != kInterface)
      continue;
    for (int e = 0; e < face.bNumEndpoints; e++) {
      const libusb_endpoint_descriptor &endpoint = face.endpoint[e];
      const bool in = (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0;
      (in ? endpoints.in : endpoints.out) = endpoint.bEndpointAddress;
      endpoints.interrupt =
          (endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) ==
          LIBUSB_TRANSFER_TYPE_INTERRUPT;
    }
  }
  libusb_free_config_descriptor (config);
  if (endpoints.in == 0 || endpoints.out == 0)
    return Error{"its interface 0 has no endpoints in both directions",
        ErrorCode::device};
  return endpoints;
}

class UsbPipe : public PacketPipe
{
public:
  UsbPipe (Context context, Handle handle, Endpoints endpoints)
      : context_ (std::move (context)), handle_ (std::move (handle)),
        endpoints_ (endpoints)
  {
  }
  ~UsbPipe () override
  {
    libusb_release_interface (handle_.get (), kInterface);
  }

  /** One transfer for the whole message: its packets follow each other on the
   * wire without waiting for this process. */
  Result<void> write (ByteView packets, Milliseconds timeout) override
  {
    Bytes bytes (packets.begin (), packets.end ());
    int sent = 0;
    const int code = transfer (endpoints_.out, bytes, sent, timeout);
    if (code == 0 && sent == int (bytes.size ()))
      return {};
    // Half a message: the device must not take the next one for its rest.
    if (code == LIBUSB_ERROR_PIPE)
      libusb_clear_halt (handle_.get (), endpoints_.out);
    return failure (code, "it took " + std::to_string (sent) + " of " +
                              std::to_string (bytes.size ()) + " bytes");
  }

  Result<Bytes> read (Milliseconds timeout) override
  {
    Bytes packet (kHidPacketSize);
    int received = 0;
    const int code = transfer (endpoints_.in, packet, received, timeout);
    if (code == LIBUSB_ERROR_TIMEOUT && received == 0)
      return Bytes{};
    if (code == LIBUSB_ERROR_PIPE)
      libusb_clear_halt (handle_.get (), endpoints_.in);
    if (code != 0 && code != LIBUSB_ERROR_TIMEOUT)
      return failure (code, "no reply can be read").error ();
    packet.resize (std::size_t (received));
    return packet;
  }

  bool gone () const override { return gone_; }

private:
  int transfer (
      std::uint8_t endpoint, Bytes &bytes, int &done, Milliseconds timeout)
  {
    if (gone_)
      return LIBUSB_ERROR_NO_DEVICE;
    const auto run =
        endpoints_.interrupt ? libusb_interrupt_transfer : libusb_bulk_transfer;
    // For libusb, 0 means no timeout.
    return run (handle_.get (), endpoint, bytes.data (), int (bytes.size ()),
        &done, unsigned (std::max<std::int64_t> (1, timeout.count ())));
  }

  Result<void> failure (int code, const std::string &what)
  {
    gone_ |= code == LIBUSB_ERROR_NO_DEVICE;
    return usb_error (what, code);
  }

  const Context context_;
  const Handle handle_;
  const Endpoints endpoints_;
  bool gone_ = false;
};

Result<std::unique_ptr<PacketPipe>>
open_pipe (const Context &context, const Found &found)
{
  const std::string what = "cannot open the board at USB " + found.board.port;
  ASSIGN_OR_RETURN (Handle handle, open_handle (found, what));
  ASSIGN_OR_RETURN (const Endpoints endpoints,
      with_prefix (find_endpoints (found.device.get ()), what + ": "));
  // The kernel's HID driver binds to these boards.
  libusb_set_auto_detach_kernel_driver (handle.get (), 1);
  if (const int code = libusb_claim_interface (handle.get (), kInterface);
      code != 0)
    return usb_error (what, code);
  return std::unique_ptr<PacketPipe> (
      std::make_unique<UsbPipe> (context, std::move (handle), endpoints));
}

std::string
listed (const std::vector<Found> &boards)
{
  std::string text;
  for (const Found &found : boards)
    text +=
        (text.empty () ? "usb:" : ", usb:") + found.board.port +
        (found.board.serial.empty () ? "" : " (" + found.board.serial + ")");
  return text;
}

Result<Found>
choose (std::vector<Found> boards, const std::string &which)
{
  if (boards.empty ())
    return Error{"no DMD is connected by USB; connect and switch on a "
                 "LightCrafter 4500, 6500 or 9000 and look with lsusb",
        ErrorCode::not_found};
  std::vector<Found> chosen;
  for (Found &found : boards) {
    read_serial (found);
    if (which.empty () || which == found.board.port ||
        which == found.board.serial)
      chosen.push_back (found);
  }
  if (chosen.size () == 1)
    return chosen.front ();
  if (chosen.empty ())
    return Error{"no DMD " + in_quotes (which) + " is connected; found " +
                     listed (boards),
        ErrorCode::not_found};
  return Error{"several DMDs match 'usb:" + printable (which) +
               "'; choose one by its port: " + listed (chosen)};
}

} // namespace

Result<std::vector<UsbBoard>>
list_usb_boards ()
{
  ASSIGN_OR_RETURN (const Context context, make_context ());
  ASSIGN_OR_RETURN (std::vector<Found> found, find_boards (context));
  std::vector<UsbBoard> boards;
  for (Found &each : found) {
    read_serial (each);
    boards.push_back (each.board);
  }
  return boards;
}

Result<std::unique_ptr<Dmd>>
open_usb_dmd (std::string_view device)
{
  ASSIGN_OR_RETURN (const DmdOptions options, DmdOptions::parse (device));
  ASSIGN_OR_RETURN (const Context context, make_context ());
  ASSIGN_OR_RETURN (std::vector<Found> boards, find_boards (context));
  ASSIGN_OR_RETURN (
      const Found found, choose (std::move (boards), options.which));
  ASSIGN_OR_RETURN (auto pipe, open_pipe (context, found));
  auto link = std::make_unique<HidLink> (
      std::move (pipe), "usb:" + found.board.port, found.board.serial);
  return found.board.controller == Controller::dlpc350
             ? open_dlpc350 (std::move (link), options)
             : open_dlpc900 (std::move (link), options);
}

} // namespace codedexposure
