/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The stream tags, each a GST_TAG_COMMENT: "coded-exposure={...}" on coded
 * frames carries their schedule and, if known, their mapping;
 * "coded-exposure-decoded={...}" on pictures says how they were made. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>

#include "base/result.h"
#include "record/provenance.h"
#include "schedule/schedule.h"
#include "setup/stream_setup.h"

namespace codedexposure::gst
{

/** The setup of frames that leave an element by @p src, whose caps have their
 * size and rate. */
StreamSetup setup_at (
    GstPad *src, const Schedule &schedule, std::optional<Mapping> mapping = {});
/** A TAG event with schedule and mapping; Transfer: full. */
GstEvent *setup_to_event (const StreamSetup &setup);

/** Schedule and mapping in @p tags: none if no comment has them, an error if
 * they cannot be read. */
std::optional<Result<StreamSetup>> setup_from_tags (const GstTagList *tags);

/** The TAG event @p event with @p setup in place of the setup and the
 * provenance in its tags; Transfer: full, of both. */
GstEvent *replace_setup (GstEvent *event, const StreamSetup &setup);

/** The TAG event @p event with all @p setups but the last, in their order, if
 * they are not too many: a recording whose schedule, mapping or bench profile
 * changes has them as comments "coded-exposure-setup={...}" beside the last
 * one, so that a frame in the middle is decoded by its own. Transfer: full, of
 * both.
 */
GstEvent *add_setups (GstEvent *event, const std::vector<StreamSetup> &setups);
/** Those in @p tags that can be read. */
std::vector<StreamSetup> setups_from_tags (const GstTagList *tags);

/** The TAG event @p event without setup and provenance; null if nothing is left
 * of it. Transfer: full, of both. */
GstEvent *remove_setup_and_provenance (GstEvent *event);

/** A TAG event, "coded-exposure-decoded={...}"; Transfer: full. */
GstEvent *provenance_to_event (const Provenance &provenance);
/** Whether replace_by_provenance () changes the TAG event @p event: global tags
 * without a setup stay as they are. */
bool takes_provenance (GstEvent *event);
/** The TAG event @p event with @p provenance in place of setup and provenance;
 * Transfer: full, of both. */
GstEvent *replace_by_provenance (GstEvent *event, const Provenance &provenance);
/** The provenance in @p tags; as setup_from_tags (). */
std::optional<Result<Provenance>> provenance_from_tags (const GstTagList *tags);

/** Follows, in @p bits, the significant bits that the tags of a stream say of
 * its frames; 0: not known. @p event: any, in turn. */
void follow_tagged_bits (GstEvent *event, int &bits);

/** What else to do with recordings of the two beams, after "or". */
constexpr const char kDecodeTwo[] =
    "use \"codedexposure decode FIRST.mkv --fuse QUALITY --second "
    "SECOND.mkv\", whose SECOND.mkv has the beam of the mirrors that are off.";

/** If the tags of @p event say that its frames were decoded before: a message
 * of an element that takes coded frames only, there @p where: " of pad off". */
std::optional<std::string> why_not_coded (
    GstEvent *event, const char *where = "");
/** Posts it as an error of @p element. */
void refuse_decoded (gpointer element, GstEvent *event);

} // namespace codedexposure::gst
