/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "gstleasedmemory.h"

#include <vector>

namespace cexp::gst
{

/** The bytes of one buffer, theirs or ours. */
class Lease
{
public:
  explicit Lease (GstBuffer *buffer) : source_ (gst_buffer_copy (buffer))
  {
    gst_buffer_map (source_.get (), &theirs_, GST_MAP_READ);
  }
  ~Lease ()
  {
    if (theirs_.memory)
      gst_buffer_unmap (source_.get (), &theirs_);
  }
  Lease (const Lease &) = delete;
  Lease &operator= (const Lease &) = delete;

  gsize size () const { return theirs_.size; }
  gpointer map ()
  {
    const std::lock_guard guard (lock_);
    readers_++;
    return own_.empty () ? theirs_.data : own_.data ();
  }
  void unmap ()
  {
    const std::lock_guard guard (lock_);
    readers_--;
  }
  /** Takes a copy. Returns whether somebody was reading. */
  bool end ()
  {
    const std::lock_guard guard (lock_);
    if (own_.empty ())
      own_.assign (theirs_.data, theirs_.data + theirs_.size);
    return readers_ > 0;
  }

private:
  const BufferPtr source_;
  GstMapInfo theirs_ = {};
  std::mutex lock_; // covers all below
  std::vector<guint8> own_;
  int readers_ = 0;
};

} // namespace cexp::gst

using cexp::gst::Lease;

namespace
{

struct LeasedMemory {
  GstMemory memory;
  std::shared_ptr<Lease> *lease;
};

struct LeasedAllocator {
  GstAllocator allocator;
};
struct LeasedAllocatorClass {
  GstAllocatorClass parent_class;
};

constexpr const char *kType = "CodedExposureLeased";

Lease &
lease_of (GstMemory *memory)
{
  return **reinterpret_cast<LeasedMemory *> (memory)->lease;
}

GstMemory *
new_memory (GstAllocator *allocator, GstMemory *parent,
    const std::shared_ptr<Lease> &lease, gsize offset, gsize size)
{
  auto *leased = g_new0 (LeasedMemory, 1);
  leased->lease = new std::shared_ptr<Lease> (lease);
  gst_memory_init (&leased->memory, GST_MEMORY_FLAG_READONLY, allocator, parent,
      lease->size (), 0, offset, size);
  return &leased->memory;
}

gpointer
map (GstMemory *memory, gsize, GstMapFlags)
{
  return lease_of (memory).map ();
}

void
unmap (GstMemory *memory)
{
  lease_of (memory).unmap ();
}

GstMemory *
share (GstMemory *memory, gssize offset, gssize size)
{
  GstMemory *parent = memory->parent ? memory->parent : memory;
  const gsize length = size < 0 ? memory->size - gsize (offset) : gsize (size);
  return new_memory (memory->allocator, parent,
      *reinterpret_cast<LeasedMemory *> (memory)->lease,
      memory->offset + gsize (offset), length);
}

void
free_memory (GstAllocator *, GstMemory *memory)
{
  auto *leased = reinterpret_cast<LeasedMemory *> (memory);
  delete leased->lease;
  g_free (leased);
}

} // namespace

G_DEFINE_TYPE (LeasedAllocator, leased_allocator, GST_TYPE_ALLOCATOR)

static void
leased_allocator_class_init (LeasedAllocatorClass *klass)
{
  klass->parent_class.free = free_memory;
}

static void
leased_allocator_init (LeasedAllocator *self)
{
  GstAllocator *allocator = &self->allocator;
  allocator->mem_type = kType;
  allocator->mem_map = map;
  allocator->mem_unmap = unmap;
  allocator->mem_share = share;
  GST_OBJECT_FLAG_SET (allocator, GST_ALLOCATOR_FLAG_CUSTOM_ALLOC);
}

namespace cexp::gst
{

namespace
{

GstAllocator *
leased_allocator ()
{
  static GstAllocator *const allocator = [] {
    auto *made = GST_ALLOCATOR (gst_object_ref_sink (
        g_object_new (leased_allocator_get_type (), nullptr)));
    GST_OBJECT_FLAG_SET (made, GST_OBJECT_FLAG_MAY_BE_LEAKED);
    return made;
  }();
  return allocator;
}

} // namespace

LeaseKeeper::LeaseKeeper (std::function<void (const Overdue &)> overdue)
    : overdue_ (std::move (overdue)), thread_ ([this] { work (); })
{
}

LeaseKeeper::~LeaseKeeper ()
{
  recall ();
  {
    const std::lock_guard guard (lock_);
    quit_ = true;
  }
  changed_.notify_all ();
  thread_.join ();
}

void
LeaseKeeper::lend (
    GstBuffer *buffer, guint64 number, std::chrono::nanoseconds time)
{
  const auto lease = std::make_shared<Lease> (buffer);
  gst_buffer_replace_all_memory (buffer,
      new_memory (leased_allocator (), nullptr, lease, 0, lease->size ()));
  {
    const std::lock_guard guard (lock_);
    std::erase_if (
        entries_, [] (const Entry &entry) { return entry.lease.expired (); });
    const auto now = Clock::now ();
    entries_.push_back ({lease, number, now + time, now + 2 * time});
  }
  changed_.notify_all ();
}

void
LeaseKeeper::recall ()
{
  std::deque<Entry> entries;
  {
    const std::lock_guard guard (lock_);
    entries.swap (entries_);
  }
  for (const Entry &entry : entries)
    if (const auto lease = entry.lease.lock ())
      lease->end ();
}

void
LeaseKeeper::work ()
{
  std::unique_lock guard (lock_);
  while (!quit_) {
    if (entries_.empty ()) {
      changed_.wait (guard);
      continue;
    }
    const Entry first = entries_.front ();
    if (Clock::now () < first.end) {
      changed_.wait_until (guard, first.end);
      continue;
    }
    entries_.pop_front ();
    guard.unlock ();
    if (const auto lease = first.lease.lock ()) {
      /* We hold the lease as well, but nobody maps it through us. */
      const bool in_use = lease->end ();
      overdue_ ({first.number, in_use || Clock::now () > first.due});
    }
    guard.lock ();
  }
}

} // namespace cexp::gst
