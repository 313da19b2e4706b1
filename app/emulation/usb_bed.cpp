/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "emulation/usb_bed.h"

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <future>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "base/free_with.h"

namespace codedexposure::emulated
{

namespace
{

constexpr std::uint8_t kOut = 0x01, kIn = 0x81;

/** A reference to memory of the program under test. */
using Reference =
    std::unique_ptr<UMockdevIoctlData, FreeWith<umockdev_ioctl_data_unref>>;

/** The memory behind the pointer at @p offset of @p data; null: the program was
 * killed meanwhile. */
Reference
resolve (UMockdevIoctlData *data, std::size_t offset, std::size_t size)
{
  return Reference (umockdev_ioctl_data_resolve (data, offset, size, nullptr));
}

template <typename T>
T *
as (const Reference &memory)
{
  return reinterpret_cast<T *> (memory->data);
}

using ClientRef =
    std::unique_ptr<UMockdevIoctlClient, FreeWith<g_object_unref>>;

ClientRef
ref (UMockdevIoctlClient *client)
{
  return ClientRef (UMOCKDEV_IOCTL_CLIENT (g_object_ref (client)));
}

/** A process that has the node open, for as long as it has. */
class Owner
{
public:
  explicit Owner (UMockdevIoctlClient *client)
  {
    g_weak_ref_init (&client_, client);
  }
  ~Owner () { g_weak_ref_clear (&client_); }
  Owner (const Owner &) = delete;
  Owner &operator= (const Owner &) = delete;

  bool is (const UMockdevIoctlClient *client)
  {
    return get ().get () == client;
  }
  bool gone () { return !get (); }

private:
  ClientRef get ()
  {
    auto *const client =
        static_cast<UMockdevIoctlClient *> (g_weak_ref_get (&client_));
    ClientRef held (client);
    return client != nullptr && umockdev_ioctl_client_get_connected (client)
               ? std::move (held)
               : nullptr;
  }

  GWeakRef client_;
};

std::vector<std::uint8_t>
descriptors (std::uint16_t product)
{
  return {18, 1, 0x10, 0x01, 0, 0, 0, 64, 0x51, 0x04, std::uint8_t (product),
      std::uint8_t (product >> 8), 0, 1, 1, 2, 3, 1,
      // configuration, interface, HID, two interrupt endpoints of 64 bytes
      9, 2, 41, 0, 1, 1, 0, 0x80, 50,         //
      9, 4, 0, 0, 2, 3, 0, 0, 0,              //
      9, 0x21, 0x11, 0x01, 0, 1, 0x22, 36, 0, //
      7, 5, kIn, 3, 64, 0, 1,                 //
      7, 5, kOut, 3, 64, 0, 1};
}

} // namespace

/** What the kernel does for one board. Called on the bed's thread. */
class UsbPort
{
public:
  UsbPort (std::string serial, std::shared_ptr<EmulatedHid> board)
      : serial_ (std::move (serial)), board_ (std::move (board)),
        handler_ (umockdev_ioctl_base_new ())
  {
    g_signal_connect_after (
        handler_, "handle-ioctl", G_CALLBACK (on_ioctl), this);
  }
  ~UsbPort ()
  {
    g_signal_handlers_disconnect_by_data (handler_, this);
    if (GMainContext *const context = context_; context != nullptr)
      g_main_context_unref (context);
    g_object_unref (handler_);
  }

  UMockdevIoctlBase *handler () const { return handler_; }
  std::string sys_path, node;

  void pull ()
  {
    const std::lock_guard guard (lock_);
    board_->unplug ();
    drop_all ();
  }

private:
  friend class UsbBed;
  struct Urb {
    std::unique_ptr<Owner> owner;
    Reference urb, buffer;
    gulong address = 0;
    int sent = 0;
    usbdevfs_urb *get () const { return as<usbdevfs_urb> (urb); }
  };

  static gboolean on_ioctl (
      UMockdevIoctlBase *, UMockdevIoctlClient *client, gpointer self)
  {
    /* A process may be killed in the middle of it. */
    const ClientRef held = ref (client);
    const int result = static_cast<UsbPort *> (self)->handle (client);
    // To poll (), a node in software is always ready: whoever waits for
    // something to reap would ask as fast as it can.
    if (result == -EAGAIN)
      std::this_thread::sleep_for (std::chrono::milliseconds (1));
    if (umockdev_ioctl_client_get_connected (client))
      umockdev_ioctl_client_complete (
          client, std::max (result, -1), -std::min (result, 0));
    return TRUE;
  }

  /** As the kernel: below 0, it is an error. */
  int handle (UMockdevIoctlClient *client)
  {
    const std::lock_guard guard (lock_);
    if (context_ == nullptr)
      context_ = g_main_context_ref_thread_default ();
    drop_orphans ();
    const auto request =
        std::uint32_t (umockdev_ioctl_client_get_request (client));
    auto *const argument = umockdev_ioctl_client_get_arg (client);
    if (board_->gone ())
      drop_all ();
    if (request == USBDEVFS_GET_CAPABILITIES) {
      const Reference value = resolve (argument, 0, sizeof (std::uint32_t));
      if (!value)
        return -EFAULT;
      *as<std::uint32_t> (value) = USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      return 0;
    }
    if (request == USBDEVFS_REAPURBNDELAY)
      return reap (client, argument);
    if (board_->gone ())
      return -ENODEV;
    if (request == USBDEVFS_SUBMITURB)
      return submit (client, argument);
    if (request == USBDEVFS_DISCARDURB)
      return discard (argument);
    return manage (argument, request);
  }

  /** Interfaces and drivers. */
  int manage (UMockdevIoctlData *argument, std::uint32_t request)
  {
    switch (request) {
    case USBDEVFS_GETDRIVER: {
      if (!bound_)
        return -ENODATA;
      const Reference value =
          resolve (argument, 0, sizeof (usbdevfs_getdriver));
      if (!value)
        return -EFAULT;
      std::strcpy (as<usbdevfs_getdriver> (value)->driver, "usbhid");
      return 0;
    }
    case USBDEVFS_IOCTL: {
      const Reference value = resolve (argument, 0, sizeof (usbdevfs_ioctl));
      if (!value)
        return -EFAULT;
      const auto code = std::uint32_t (as<usbdevfs_ioctl> (value)->ioctl_code);
      if (code == USBDEVFS_DISCONNECT && !bound_)
        return -ENODATA;
      bound_ = code == USBDEVFS_CONNECT;
      return 0;
    }
    case USBDEVFS_DISCONNECT_CLAIM:
    case USBDEVFS_CLAIMINTERFACE:
      if (occupied_ || (request == USBDEVFS_CLAIMINTERFACE && bound_))
        return -EBUSY;
      bound_ = false;
      return 0;
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_CLEAR_HALT:
    case USBDEVFS_RESET:
    case USBDEVFS_SETINTERFACE:
    case USBDEVFS_SETCONFIGURATION:
      return 0;
    default:
      return -ENOTTY;
    }
  }

  int submit (UMockdevIoctlClient *client, UMockdevIoctlData *argument)
  {
    Urb urb;
    urb.owner = std::make_unique<Owner> (client);
    urb.urb = resolve (argument, 0, sizeof (usbdevfs_urb));
    if (!urb.urb.get ())
      return -EFAULT;
    urb.address = urb.urb.get ()->client_addr;
    const int length = urb.get ()->buffer_length;
    if (length > 0)
      urb.buffer = resolve (urb.urb.get (), offsetof (usbdevfs_urb, buffer),
          std::size_t (length));
    if (length > 0 && !urb.buffer.get ())
      return -EFAULT;
    if (urb.get ()->type == USBDEVFS_URB_TYPE_CONTROL)
      finish_control (std::move (urb));
    else if (urb.get ()->endpoint == kIn)
      waiting_.push_back (std::move (urb));
    else
      finish_out (std::move (urb));
    serve_waiting ();
    return 0;
  }

  void finish (Urb urb, int status, int length)
  {
    urb.get ()->status = status;
    urb.get ()->actual_length = length;
    done_.push_back (std::move (urb));
  }

  void finish_out (Urb urb)
  {
    const auto *bytes = as<const std::uint8_t> (urb.buffer);
    const int length = urb.get ()->buffer_length;
    int sent = 0;
    while (sent < length && board_->out ({bytes + sent, bytes + sent + 64}))
      sent += 64;
    if (sent < length && !board_->gone () && board_->hesitates ()) {
      urb.sent = sent;
      held_.push_back (std::move (urb)); // until it is discarded
      return;
    }
    const int status = sent == length ? 0 : board_->gone () ? -ENODEV : -EPIPE;
    finish (std::move (urb), status, sent);
  }

  void serve_waiting ()
  {
    while (!waiting_.empty () && !board_->gone ()) {
      const auto packet = board_->in ();
      if (!packet)
        return;
      Urb urb = std::move (waiting_.front ());
      waiting_.erase (waiting_.begin ());
      std::memcpy (
          as<std::uint8_t> (urb.buffer), packet->data (), packet->size ());
      finish (std::move (urb), 0, int (packet->size ()));
    }
  }

  /** Only string descriptors are requested on endpoint 0. */
  void finish_control (Urb urb)
  {
    constexpr int kSetup = 8;
    auto *bytes = as<std::uint8_t> (urb.buffer);
    const bool string = bytes[1] == 6 && bytes[3] == 3;
    std::vector<std::uint8_t> answer{4, 3, 9, 4}; // US English
    if (bytes[2] != 0) {
      answer = {0, 3};
      for (const char c : bytes[2] == 3 ? serial_ : std::string ("DLPC"))
        answer.insert (answer.end (), {std::uint8_t (c), 0});
      answer[0] = std::uint8_t (answer.size ());
    }
    const int length =
        std::min (int (answer.size ()), urb.get ()->buffer_length - kSetup);
    std::memcpy (bytes + kSetup, answer.data (), std::size_t (length));
    finish (std::move (urb), string ? 0 : -EPIPE, string ? length : 0);
  }

  int reap (UMockdevIoctlClient *client, UMockdevIoctlData *argument)
  {
    const auto found = std::find_if (done_.begin (), done_.end (),
        [client] (const Urb &urb) { return urb.owner->is (client); });
    if (found == done_.end ())
      return board_->gone () ? -ENODEV : -EAGAIN;
    const Urb urb = std::move (*found);
    done_.erase (found);
    const Reference slot = resolve (argument, 0, sizeof (gpointer));
    if (!slot.get ())
      return -EFAULT;
    umockdev_ioctl_data_set_ptr (slot.get (), 0, urb.urb.get ());
    return 0;
  }

  int discard (UMockdevIoctlData *argument)
  {
    const auto address = *reinterpret_cast<const gulong *> (argument->data);
    for (auto *const urbs : {&waiting_, &held_})
      for (std::size_t i = 0; i < urbs->size (); i++)
        if ((*urbs)[i].address == address) {
          Urb urb = std::move ((*urbs)[i]);
          urbs->erase (urbs->begin () + std::ptrdiff_t (i));
          const int sent = urb.sent;
          finish (std::move (urb), -ENOENT, sent);
          return 0;
        }
    return -EINVAL;
  }

  /** Discards the pending transfers of a process that ended. */
  void drop_orphans ()
  {
    const auto orphaned = [] (const Urb &urb) { return urb.owner->gone (); };
    std::erase_if (waiting_, orphaned);
    std::erase_if (held_, orphaned);
    std::erase_if (done_, orphaned);
  }

  void drop_all ()
  {
    for (auto *const urbs : {&waiting_, &held_}) {
      for (Urb &urb : *urbs)
        finish (std::move (urb), -ENODEV, 0);
      urbs->clear ();
    }
  }

  const std::string serial_;
  const std::shared_ptr<EmulatedHid> board_;
  UMockdevIoctlBase *const handler_;
  std::atomic<GMainContext *> context_ = nullptr; // of the bed's thread
  std::mutex lock_; // covers everything below, and the board
  bool bound_ = true;
  bool occupied_ = false;
  std::vector<Urb> waiting_; // for packets from the board
  std::vector<Urb> held_;    // until the host gives them up
  std::vector<Urb> done_;
};

UsbBed::UsbBed () : bed_ (umockdev_testbed_new ()) {}

UsbBed::~UsbBed ()
{
  /* No event tells of it: without the library that is preloaded, this process
   * has none. */
  for (const auto &[name, port] : ports_) {
    port->pull ();
    umockdev_testbed_detach_ioctl (bed_, port->node.c_str (), nullptr);
  }
  g_object_unref (bed_);
}

void
UsbBed::plug (const std::string &port, std::uint16_t product,
    const std::string &serial, std::shared_ptr<EmulatedHid> board)
{
  auto made = std::make_unique<UsbPort> (serial, std::move (board));
  const std::string number = "00" + port.substr (port.find ('-') + 1);
  made->node = "/dev/bus/usb/001/" + number;
  made->sys_path = "/sys/devices/usb1/" + port;
  std::string hex;
  for (const std::uint8_t byte : descriptors (product)) {
    char text[3];
    std::snprintf (text, sizeof text, "%02x", byte);
    hex += text;
  }
  char product_text[8];
  std::snprintf (product_text, sizeof product_text, "%04x", product);
  const std::string text =
      "P: /devices/usb1/" + port + "\nN: bus/usb/001/" + number +
      "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: BUSNUM=001\nE: DEVNUM=" +
      number + "\nE: DEVNAME=" + made->node + "\nE: PRODUCT=451/" +
      product_text +
      "/100\nA: busnum=1\nA: devnum=" + port.substr (port.find ('-') + 1) +
      "\nA: speed=12\nA: bConfigurationValue=1\nA: idVendor=0451\n"
      "A: idProduct=" +
      product_text + "\nH: descriptors=" + hex + "\n";
  GError *error = nullptr;
  umockdev_testbed_attach_ioctl (
      bed_, made->node.c_str (), made->handler (), &error);
  if (error == nullptr)
    umockdev_testbed_add_from_string (bed_, text.c_str (), &error);
  if (error != nullptr)
    g_error ("cannot plug %s: %s", port.c_str (), error->message);
  ports_[port] = std::move (made);
}

void
UsbBed::unplug (const std::string &port)
{
  const auto found = ports_.find (port);
  UsbPort &gone = *found->second;
  gone.pull ();
  umockdev_testbed_detach_ioctl (bed_, gone.node.c_str (), nullptr);
  umockdev_testbed_uevent (bed_, gone.sys_path.c_str (), "remove");
  umockdev_testbed_remove_device (bed_, gone.sys_path.c_str ());
  pulled_.push_back (std::move (found->second));
  ports_.erase (found);
}

void
UsbBed::forget_pulled ()
{
  pulled_.clear ();
}

bool
UsbBed::kernel_driver_bound (const std::string &port) const
{
  const std::lock_guard guard (ports_.at (port)->lock_);
  return ports_.at (port)->bound_;
}

bool
UsbBed::running (const std::string &port) const
{
  const std::lock_guard guard (ports_.at (port)->lock_);
  return ports_.at (port)->board_->running ();
}

bool
UsbBed::idle (const std::string &port) const
{
  // What comes last on the bed's thread runs when nobody has asked for
  // anything that is not answered.
  const auto answered = std::make_shared<std::promise<void>> ();
  using Held = std::shared_ptr<std::promise<void>>;
  GSource *const last = g_idle_source_new ();
  g_source_set_priority (last, G_PRIORITY_LOW);
  g_source_set_callback (
      last,
      [] (gpointer held) -> gboolean {
        (*static_cast<Held *> (held))->set_value ();
        return G_SOURCE_REMOVE;
      },
      new Held (answered),
      [] (gpointer held) { delete static_cast<Held *> (held); });
  g_source_attach (last, ports_.at (port)->context_);
  constexpr auto kPatience = std::chrono::milliseconds (100);
  const auto seen = answered->get_future ().wait_for (kPatience);
  g_source_destroy (last);
  g_source_unref (last);
  return seen == std::future_status::ready;
}

void
UsbBed::occupy (const std::string &port)
{
  const std::lock_guard guard (ports_.at (port)->lock_);
  ports_.at (port)->occupied_ = true;
}

} // namespace codedexposure::emulated
