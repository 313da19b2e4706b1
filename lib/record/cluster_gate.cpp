/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "record/cluster_gate.h"

#include <algorithm>

#include "record/ebml.h"

namespace codedexposure
{

using namespace ebml;

namespace
{

/* The longest name and length. */
constexpr std::size_t kHeader = 12;

} // namespace

void
ClusterGate::pass (std::size_t size, std::string &to)
{
  to.append (held_, at_, size);
  at_ += size;
}

void
ClusterGate::drop (std::size_t size)
{
  dropped_ += size;
  at_ += size;
}

/* False: more bytes are needed. */
bool
ClusterGate::find_cluster (std::string &head)
{
  const std::size_t found = held_.find (kClusterName, at_);
  /* The name may begin in the last bytes. */
  const std::size_t before =
      found != held_.npos
          ? found - at_
          : held_.size () - at_ -
                std::min (held_.size () - at_, kClusterName.size () - 1);
  in_head_ ? pass (before, head) : drop (before);
  return found != held_.npos;
}

/* Whether elements of a cluster fill its bytes, as far as these have come. */
ClusterGate::Found
ClusterGate::look_into (std::size_t data, std::size_t end) const
{
  Source source = Source::of (held_);
  std::uint64_t at = data;
  while (at < end) {
    if (held_.size () < std::min<std::uint64_t> (at + kHeader, end))
      return Found::part;
    const auto child = source.element_at (at, end);
    if (!child || child->is_open || !is_one_of (kOfCluster, child->id))
      return Found::damaged;
    at = child->end;
  }
  return held_.size () < end ? Found::part : Found::whole;
}

/* The element at the place that was reached, of @p size bytes; of a cluster
 * whose size is not known, only its header. */
ClusterGate::Found
ClusterGate::look (std::size_t &size)
{
  Source source = Source::of (held_);
  const auto element = source.element_at (at_, kUnlimited);
  if (!element)
    return held_.size () - at_ < kHeader ? Found::part : Found::damaged;
  const bool of_cluster = is_open_ && is_one_of (kOfCluster, element->id);
  if (!of_cluster && !is_one_of (kOfSegment, element->id))
    return Found::damaged;
  const bool is_cluster = element->id == kCluster;
  if (element->is_open && !is_cluster)
    return Found::damaged;
  if (!of_cluster)
    is_open_ = is_cluster && element->is_open;
  size = (element->is_open ? element->data : element->end) - at_;
  if (size > kMostHeld)
    return Found::damaged;
  if (is_cluster && !element->is_open)
    return look_into (element->data, element->end);
  return held_.size () - at_ < size ? Found::part : Found::whole;
}

std::string
ClusterGate::take (std::string_view bytes)
{
  held_.erase (0, std::exchange (at_, 0));
  held_ += bytes;
  std::string passed;
  while (at_ < held_.size ()) {
    if (in_head_ || lost_) {
      if (!find_cluster (passed))
        break;
      in_head_ = lost_ = false;
    }
    std::size_t size = 0;
    const Found found = look (size);
    if (found == Found::part)
      break;
    if (found == Found::whole) {
      pass (size, passed);
      continue;
    }
    drop (1);
    lost_ = true;
    is_open_ = false;
  }
  return passed;
}

} // namespace codedexposure
