/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync and its DMD: opening, upload, parking. */
#include "dmdsync.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace codedexposure::gst::sync
{

namespace
{

constexpr const char *kUpload = "upload";

/* Where an upload is that takes @predicted in all, or more. */
std::string
progress_text (const SyncState &st, int sent, int total, Nanoseconds predicted)
{
  constexpr Nanoseconds kTenth = GST_SECOND / 10;
  const std::string masks = "masks of " + st.schedule.text ();
  const std::string &dmd = st.runner->info ().name;
  if (sent == total)
    return "The " + masks + " are on " + dmd;
  const Nanoseconds left = predicted / total * (total - sent) / kTenth * kTenth;
  const std::string time =
      left > 0 ? ", " + time_text (left) + " or more left" : "";
  return std::to_string (std::int64_t (sent) * 100 / total) + " % of the " +
         masks + " sent to " + dmd + time;
}

/* Reports come from the runner's thread. */
DmdRunner::Reports
reports (GstDmdSync *self)
{
  DmdRunner::Reports reports;
  const auto predicted = std::make_shared<Nanoseconds> (0);
  reports.predicted = [predicted] (Nanoseconds time) { *predicted = time; };
  reports.progress = [self, predicted] (int sent, int total) {
    SyncState &st = state (self);
    const std::string text = progress_text (st, sent, total, *predicted);
    st.uploading = sent < total;
    post_progress (self,
        sent == 0      ? GST_PROGRESS_TYPE_START
        : sent < total ? GST_PROGRESS_TYPE_CONTINUE
                       : GST_PROGRESS_TYPE_COMPLETE,
        kUpload, text);
  };
  reports.failed = [self] (const Error &error) {
    if (state (self).uploading.exchange (false))
      post_progress (self, GST_PROGRESS_TYPE_ERROR, kUpload, error.message);
    POST_ERROR (self, RESOURCE, WRITE, "The DMD failed: " + error.message);
  };
  reports.not_parked = [self] {
    POST_WARNING (self, RESOURCE, WRITE,
        state (self).runner->info ().name +
            " did not answer when it was told to stop, and may show masks on: "
            "try \"codedexposure dmd stop\", or switch it off.");
  };
  return reports;
}

} // namespace

bool
read_schedule (GstDmdSync *self)
{
  SyncState &st = state (self);
  const auto named = read_again (self, st.settings.schedule);
  if (!check_named (self, "schedule", named))
    return false;
  locked (self, [&] { st.schedule = named.read->value (); });
  return true;
}

bool
open_device (GstDmdSync *self)
{
  SyncState &st = state (self);
  const std::string device = settings_of (self).device;
  if (device.empty () || device == kExternal)
    return true;
  if (settings_of (self).beam == Beam::kOff)
    return refuse_settings (self,
        "beam=off with the DMD \"" + device +
            "\": a second camera drives none; leave device empty, and set it "
            "on the dmdsync of the first camera.");

  Result<std::unique_ptr<Dmd>> dmd = open_dmd (device);
  if (!dmd) {
    POST_ERROR (self, RESOURCE, OPEN_READ_WRITE,
        "Cannot open the DMD \"" + device + "\": " + dmd.error ().message);
    return false;
  }
  auto runner = std::make_shared<DmdRunner> (*std::move (dmd), reports (self));
  locked (self, [&] { st.runner = std::move (runner); });
  GST_INFO_OBJECT (self, "opened %s", device.c_str ());
  return true;
}

bool
read_bench (GstDmdSync *self)
{
  SyncState &st = state (self);
  const auto named = read_again (self, st.settings.bench);
  if (!check_named (self, "bench", named))
    return false;
  const auto &given = named.read;
  if (given && given->value ().dmd && st.runner)
    if (const auto same = BenchProfile::check_device (
            "DMD", *given->value ().dmd, {.serial = st.runner->info ().serial});
        !same)
      return refuse_settings (
          self, "The bench profile does not fit: " + same.error ().message);
  const bool off_beam = settings_of (self).beam == Beam::kOff;
  locked (self, [&] {
    st.bench = given ? std::optional (given->value ().of_beam (off_beam))
                     : std::nullopt;
  });
  if (st.bench)
    if (const auto old = st.bench->why_doubtful (now_utc ()))
      POST_WARNING (self, RESOURCE, SETTINGS, *old);
  return true;
}

std::shared_ptr<DmdRunner>
runner_of (GstDmdSync *self)
{
  const ObjectLock lock (self);
  return state (self).runner;
}

void
close_device (GstElement *self)
{
  std::shared_ptr<DmdRunner> runner;
  const ObjectLock lock (self);
  runner.swap (state (self).runner);
}

void
park (GstElement *self)
{
  SyncState &st = state (self);
  if (!st.runner)
    return;
  st.runner->halt ();
  locked (self, [&] { st.pattern.reset (); });
  if (st.uploading.exchange (false))
    post_progress (
        self, GST_PROGRESS_TYPE_CANCELED, kUpload, "Upload cancelled");
}

} // namespace codedexposure::gst::sync
