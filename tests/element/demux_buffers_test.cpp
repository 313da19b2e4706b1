/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: memory, strides, pools and metas. */
#include <atomic>
#include <set>
#include <thread>

#include "downstream.h"
#include "harness.h"

#include "common/meta.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr char kLine[] = "codedexposure-demux schedule=sequential:2x2";
constexpr int kWidth = 30, kHeight = 20;
constexpr GstClockTime kPeriod = 40 * GST_MSECOND;

Image<std::uint8_t>
picture ()
{
  return draw<std::uint8_t> (
      kWidth, kHeight, [] (int x, int y) { return (7 * x + 13 * y) % 250; });
}

Image<std::uint8_t>
subframe (int k)
{
  return draw<std::uint8_t> (kWidth / 2, kHeight / 2, [&] (int x, int y) {
    return picture ().at (2 * x + k % 2, 2 * y + k / 2);
  });
}

GstFlowReturn
push (ElementHarness &demux, int frame = 0)
{
  return demux.push (frame_of (picture (), GstClockTime (frame) * kPeriod));
}

/* ------------------------------------------------ a pool of odd layout -- */

constexpr gsize kOddOffset = 5;
constexpr int kOddExtra = 7;

struct OddPool {
  GstBufferPool parent;
};
struct OddPoolClass {
  GstBufferPoolClass parent_class;
};
G_DEFINE_TYPE (OddPool, odd_pool, GST_TYPE_BUFFER_POOL)

const gchar **
odd_pool_options (GstBufferPool *)
{
  static const gchar *options[] = {GST_BUFFER_POOL_OPTION_VIDEO_META, nullptr};
  return options;
}

/* Rows with an odd stride after a few bytes of other data. */
GstFlowReturn
odd_pool_alloc (
    GstBufferPool *pool, GstBuffer **buffer, GstBufferPoolAcquireParams *)
{
  GstStructure *config = gst_buffer_pool_get_config (pool);
  GstCaps *caps = nullptr;
  gst_buffer_pool_config_get_params (config, &caps, nullptr, nullptr, nullptr);
  const GstVideoInfo info = info_of (caps);
  gst_structure_free (config);
  gsize offsets[GST_VIDEO_MAX_PLANES] = {kOddOffset};
  gint strides[GST_VIDEO_MAX_PLANES] = {info.width + kOddExtra};
  *buffer = gst_buffer_new_allocate (
      nullptr, kOddOffset + gsize (strides[0]) * gsize (info.height), nullptr);
  gst_buffer_add_video_meta_full (*buffer, GST_VIDEO_FRAME_FLAG_NONE,
      GST_VIDEO_INFO_FORMAT (&info), guint (info.width), guint (info.height), 1,
      offsets, strides);
  return GST_FLOW_OK;
}

void
odd_pool_class_init (OddPoolClass *klass)
{
  klass->parent_class.get_options = odd_pool_options;
  klass->parent_class.alloc_buffer = odd_pool_alloc;
}

void
odd_pool_init (OddPool *)
{
}

ObjectPtr<GstBufferPool>
new_odd_pool ()
{
  return ObjectPtr<GstBufferPool> (GST_BUFFER_POOL (
      gst_object_ref_sink (g_object_new (odd_pool_get_type (), nullptr))));
}

class DemuxBuffers : public ::testing::Test
{
protected:
  DemuxBuffers () : demux (kLine), downstream (demux.get ())
  {
    demux.set_caps (gray_caps (kWidth, kHeight));
  }
  void expect_subframes (const std::string &pad = "")
  {
    const CapsPtr caps = demux.pad_caps (pad);
    for (int k = 0; k < 4; k++) {
      const BufferPtr buffer = demux.pull (pad);
      ASSERT_TRUE (buffer);
      EXPECT_EQ (
          image_of<std::uint8_t> (buffer.get (), caps.get ()), subframe (k));
    }
  }
  ElementHarness demux;
  Downstream downstream;
};

TEST_F (DemuxBuffers, ComeFromThePoolOfDownstreamInItsOwnLayout)
{
  downstream.pool = new_odd_pool ();
  ASSERT_EQ (push (demux), GST_FLOW_OK);
  const CapsPtr caps = demux.pad_caps ();
  for (int k = 0; k < 4; k++) {
    const BufferPtr buffer = demux.pull ();
    ASSERT_TRUE (buffer);
    EXPECT_EQ (buffer->pool, downstream.pool.get ());
    const GstVideoMeta *layout = gst_buffer_get_video_meta (buffer.get ());
    ASSERT_TRUE (layout);
    EXPECT_EQ (layout->stride[0], kWidth / 2 + kOddExtra);
    EXPECT_EQ (
        image_of<std::uint8_t> (buffer.get (), caps.get ()), subframe (k));
  }
}

TEST_F (DemuxBuffers, HaveTheDefaultLayoutWherePeersReadNoVideoMeta)
{
  downstream.video_meta = false;
  ASSERT_EQ (push (demux), GST_FLOW_OK);
  const CapsPtr caps = demux.pad_caps ();
  const GstVideoInfo info = info_of (caps.get ());
  for (int k = 0; k < 4; k++) {
    const BufferPtr buffer = demux.pull ();
    ASSERT_TRUE (buffer);
    EXPECT_FALSE (gst_buffer_get_video_meta (buffer.get ()));
    EXPECT_EQ (
        gst_buffer_get_size (buffer.get ()), GST_VIDEO_INFO_SIZE (&info));
    EXPECT_EQ (
        image_of<std::uint8_t> (buffer.get (), caps.get ()), subframe (k));
  }
}

TEST_F (DemuxBuffers, ComeFromAnotherPoolWhereDownstreamsIsTooSmall)
{
  downstream.pool.reset (gst_video_buffer_pool_new ());
  downstream.min = 1;
  downstream.max = 4;
  for (int frame = 0; frame < 3; frame++)
    ASSERT_EQ (push (demux, frame), GST_FLOW_OK);
  const BufferPtr buffer = demux.pull ();
  EXPECT_NE (buffer->pool, downstream.pool.get ());
}

/* A sink keeps the last buffer that it has shown until it shows another. */
TEST_F (DemuxBuffers, NeedNotWaitForOneThatDownstreamKeeps)
{
  downstream.pool.reset (gst_video_buffer_pool_new ());
  downstream.max = 4;
  BufferPtr kept;
  for (int frame = 0; frame < 3; frame++) {
    ASSERT_EQ (push (demux, frame), GST_FLOW_OK);
    const CapsPtr caps = demux.pad_caps ();
    for (int k = 0; k < 4; k++) {
      BufferPtr picture = demux.pull ();
      ASSERT_TRUE (picture);
      EXPECT_EQ (
          image_of<std::uint8_t> (picture.get (), caps.get ()), subframe (k));
      if (!kept)
        kept = std::move (picture);
    }
  }
  EXPECT_EQ (kept->pool, downstream.pool.get ());
}

TEST_F (DemuxBuffers, AskDownstreamOnceAndAgainWhenItWantsThat)
{
  for (int frame = 0; frame < 3; frame++)
    ASSERT_EQ (push (demux, frame), GST_FLOW_OK);
  EXPECT_EQ (downstream.queries, 1);

  downstream.pool.reset (gst_video_buffer_pool_new ());
  gst_harness_push_upstream_event (demux.get (), gst_event_new_reconfigure ());
  while (demux.pull ())
    ;
  ASSERT_EQ (push (demux, 3), GST_FLOW_OK);
  EXPECT_EQ (downstream.queries, 2);
  EXPECT_EQ (demux.pull ()->pool, downstream.pool.get ());

  demux.set_caps (gray_caps (kWidth, kHeight, "50/1"));
  ASSERT_EQ (push (demux, 4), GST_FLOW_OK);
  EXPECT_EQ (downstream.queries, 3);
}

TEST_F (DemuxBuffers, PoolIsGivenBackAtTheEndOfTheRun)
{
  downstream.pool.reset (gst_video_buffer_pool_new ());
  ASSERT_EQ (push (demux), GST_FLOW_OK);
  EXPECT_TRUE (gst_buffer_pool_is_active (downstream.pool.get ()));
  gst_element_set_state (demux.element (), GST_STATE_READY);
  EXPECT_FALSE (gst_buffer_pool_is_active (downstream.pool.get ()));
  EXPECT_GT (GST_OBJECT_REFCOUNT (downstream.pool.get ()), 1)
      << "the buffers that wait in the test still need it";
  while (demux.pull ())
    ;
  EXPECT_EQ (GST_OBJECT_REFCOUNT (downstream.pool.get ()), 1);
}

/* -------------------------------------------------------------- sharing -- */

const guint8 *
address_of (const BufferPtr &buffer)
{
  GstMapInfo map;
  EXPECT_TRUE (gst_buffer_map (buffer.get (), &map, GST_MAP_READ));
  const guint8 *data = map.data;
  gst_buffer_unmap (buffer.get (), &map);
  return data;
}

TEST_F (DemuxBuffers, PadOfOneSubframeSharesTheMemoryOfSrc)
{
  demux.request ("subframe_2");
  ASSERT_EQ (push (demux), GST_FLOW_OK);
  demux.pull ();
  demux.pull ();
  const BufferPtr all = demux.pull ();
  const BufferPtr one = demux.pull ("subframe_2");
  ASSERT_TRUE (all && one);
  EXPECT_EQ (address_of (all), address_of (one));
  EXPECT_EQ (GST_BUFFER_DURATION (all.get ()), kPeriod / 4);
  EXPECT_EQ (GST_BUFFER_DURATION (one.get ()), kPeriod);
  EXPECT_FALSE (GST_BUFFER_IS_DISCONT (all.get ()));
  EXPECT_TRUE (GST_BUFFER_IS_DISCONT (one.get ()));
}

TEST_F (DemuxBuffers, PadOfOneSubframeGetsACopyWhereItCouldNotReadTheLayout)
{
  downstream.pool = new_odd_pool ();
  Downstream plain (demux.request ("subframe_2"));
  plain.video_meta = false;
  Downstream able (demux.request ("subframe_3"));
  BufferPtr frame = frame_of (picture (), 0);
  GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED);
  gst_buffer_add_video_region_of_interest_meta (
      frame.get (), "cell", 4, 8, 10, 6);
  ASSERT_EQ (demux.push (std::move (frame)), GST_FLOW_OK);

  const CapsPtr caps = demux.pad_caps ();
  const BufferPtr packed = demux.pull ("subframe_2");
  ASSERT_TRUE (packed);
  EXPECT_FALSE (gst_buffer_get_video_meta (packed.get ()));
  EXPECT_EQ (image_of<std::uint8_t> (packed.get (), caps.get ()), subframe (2));
  EXPECT_EQ (GST_BUFFER_PTS (packed.get ()), kPeriod / 2);
  EXPECT_EQ (get_frame_meta (packed.get ())->subframe, 2);
  EXPECT_TRUE (
      GST_BUFFER_FLAG_IS_SET (packed.get (), GST_BUFFER_FLAG_CORRUPTED));

  EXPECT_EQ (
      gst_buffer_get_video_region_of_interest_meta (packed.get ())->x, 2u);

  const BufferPtr shared = demux.pull ("subframe_3");
  ASSERT_TRUE (shared);
  EXPECT_EQ (gst_buffer_get_video_meta (shared.get ())->stride[0],
      kWidth / 2 + kOddExtra);
  EXPECT_EQ (image_of<std::uint8_t> (shared.get (), caps.get ()), subframe (3));
}

TEST (DemuxMemory, CodedFrameIsPassedOnInItsOwnMemory)
{
  ElementHarness demux (kLine);
  demux.request ("coded");
  demux.set_caps (gray_caps (kWidth, kHeight));
  for (int frame = 0; frame < 2; frame++) {
    BufferPtr coded = frame_of (picture (), GstClockTime (frame) * kPeriod);
    GST_BUFFER_OFFSET (coded.get ()) = 77;
    const guint8 *address = address_of (coded);
    ASSERT_EQ (demux.push (std::move (coded)), GST_FLOW_OK);
    const BufferPtr out = demux.pull ("coded");
    ASSERT_TRUE (out);
    EXPECT_EQ (address_of (out), address);
    EXPECT_EQ (GST_BUFFER_OFFSET (out.get ()), 77u);
    EXPECT_EQ (GST_BUFFER_PTS (out.get ()), GstClockTime (frame) * kPeriod);
  }
}

/* They are written together and must not evict each other from the cache. */
TEST (DemuxMemory, SubframesStartAtDifferentPlacesOfAPage)
{
  ElementHarness demux (kLine);
  demux.set_caps (gray_caps (512, 512, "25/1"));
  ASSERT_EQ (demux.push (frame_of (draw<std::uint8_t> (512, 512,
                                       [] (int x, int y) { return x ^ y; }),
                 0)),
      GST_FLOW_OK);
  std::set<std::uintptr_t> places;
  for (int k = 0; k < 4; k++) {
    const BufferPtr out = demux.pull ();
    GstMapInfo map;
    ASSERT_TRUE (gst_buffer_map (out.get (), &map, GST_MAP_READ));
    const auto at = reinterpret_cast<std::uintptr_t> (map.data);
    gst_buffer_unmap (out.get (), &map);
    EXPECT_EQ (at % 64, 0u);
    places.insert (at % 4096);
  }
  EXPECT_EQ (places.size (), 4u);
}

TEST (DemuxMemory, OnlyWantedSubframesTakeBuffers)
{
  ElementHarness demux (kLine, "sink", nullptr);
  GstHarness *one = demux.request ("subframe_3");
  Downstream downstream (one);
  downstream.pool.reset (gst_video_buffer_pool_new ());
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (push (demux), GST_FLOW_OK);
  const BufferPtr buffer = demux.pull ("subframe_3");
  ASSERT_TRUE (buffer);
  EXPECT_EQ (buffer->pool, downstream.pool.get ());
  const CapsPtr caps = demux.pad_caps ("subframe_3");
  EXPECT_EQ (image_of<std::uint8_t> (buffer.get (), caps.get ()), subframe (3));
  EXPECT_EQ (counter_of (demux.element (), "subframes-out"), 1u);
}

/* Otherwise, a slow sink would let memory grow. */
TEST (DemuxMemory, ALoneSubframeWaitsForItsPool)
{
  ElementHarness demux (kLine, "sink", nullptr);
  Downstream downstream (demux.request ("subframe_2"));
  downstream.pool.reset (gst_video_buffer_pool_new ());
  downstream.max = 1;
  demux.set_caps (gray_caps (kWidth, kHeight));
  ASSERT_EQ (push (demux), GST_FLOW_OK);
  BufferPtr kept = demux.pull ("subframe_2");
  ASSERT_TRUE (kept);
  std::atomic<bool> pushed = false;
  std::thread other ([&] {
    EXPECT_EQ (push (demux, 1), GST_FLOW_OK);
    pushed = true;
  });
  for (int i = 0; i < 20 && !pushed; i++)
    g_usleep (1000);
  EXPECT_FALSE (pushed);
  kept.reset ();
  other.join ();
  EXPECT_EQ (demux.pull ("subframe_2")->pool, downstream.pool.get ());
}

/* ---------------------------------------------------------------- input -- */

template <typename Pixel>
BufferPtr
padded_frame (const Image<Pixel> &image, gint stride, gsize offset)
{
  const gsize rows = gsize (image.height ());
  BufferPtr buffer (gst_buffer_new_allocate (
      nullptr, offset + gsize (stride) * rows, nullptr));
  gst_buffer_memset (buffer.get (), 0, 0xAA, gsize (-1));
  for (gsize y = 0; y < rows; y++)
    gst_buffer_fill (buffer.get (), offset + y * gsize (stride),
        image.view ().row (int (y)), gsize (image.width ()) * sizeof (Pixel));
  gsize offsets[GST_VIDEO_MAX_PLANES] = {offset};
  gint strides[GST_VIDEO_MAX_PLANES] = {stride};
  gst_buffer_add_video_meta_full (buffer.get (), GST_VIDEO_FRAME_FLAG_NONE,
      sizeof (Pixel) == 1 ? GST_VIDEO_FORMAT_GRAY8 : GST_VIDEO_FORMAT_GRAY16_LE,
      guint (image.width ()), guint (image.height ()), 1, offsets, strides);
  GST_BUFFER_PTS (buffer.get ()) = 0;
  return buffer;
}

TEST_F (DemuxBuffers, InputMayHaveAnyStrideAndOffset)
{
  ASSERT_EQ (
      demux.push (padded_frame (picture (), kWidth + 11, 3)), GST_FLOW_OK);
  expect_subframes ();
}

TEST (DemuxMemory, DeepInputMayHaveAnyStride)
{
  ElementHarness demux (kLine);
  demux.set_caps (gray_caps (6, 4, "25/1", "GRAY16_LE"));
  const auto deep =
      draw<std::uint16_t> (6, 4, [] (int x, int y) { return 5000 * x + y; });
  ASSERT_EQ (demux.push (padded_frame (deep, 12 + 6, 4)), GST_FLOW_OK);
  const CapsPtr caps = demux.pad_caps ();
  for (int k = 0; k < 4; k++)
    EXPECT_EQ (image_of<std::uint16_t> (demux.pull ().get (), caps.get ()),
        draw<std::uint16_t> (3, 2, [&] (int x, int y) {
          return deep.at (2 * x + k % 2, 2 * y + k / 2);
        }));
}

TEST_F (DemuxBuffers, InputThatIsTooShortIsAnErrorWithTheNumbers)
{
  BufferPtr frame (gst_buffer_new_allocate (nullptr, 100, nullptr));
  GST_BUFFER_PTS (frame.get ()) = 0;
  EXPECT_EQ (demux.push (std::move (frame)), GST_FLOW_ERROR);
  const std::string text = demux.error ();
  EXPECT_NE (text.find ("100 bytes"), std::string::npos) << text;
  EXPECT_NE (text.find ("30x20"), std::string::npos) << text;
}

/* ------------------------------------------------------- the other way -- */

class DemuxOffers : public ::testing::Test
{
protected:
  DemuxOffers ()
      : demux (kLine), caps (caps_of (gray_caps (kWidth, kHeight))),
        query (gst_query_new_allocation (caps.get (), TRUE))
  {
  }
  bool offers_video_meta ()
  {
    EXPECT_TRUE (gst_pad_peer_query (demux.get ()->srcpad, query.get ()));
    return gst_query_find_allocation_meta (
        query.get (), GST_VIDEO_META_API_TYPE, nullptr);
  }
  ElementHarness demux;
  CapsPtr caps;
  QueryPtr query;
};

TEST_F (DemuxOffers, VideoMetaAndAPoolToUpstream)
{
  EXPECT_TRUE (offers_video_meta ());
  EXPECT_FALSE (gst_query_find_allocation_meta (
      query.get (), GST_VIDEO_CROP_META_API_TYPE, nullptr));
  ASSERT_EQ (gst_query_get_n_allocation_pools (query.get ()), 1u);
  GstBufferPool *raw = nullptr;
  guint size = 0;
  gst_query_parse_nth_allocation_pool (
      query.get (), 0, &raw, &size, nullptr, nullptr);
  const ObjectPtr<GstBufferPool> pool (raw);
  const GstVideoInfo info = info_of (caps.get ());
  EXPECT_EQ (size, GST_VIDEO_INFO_SIZE (&info));
  EXPECT_TRUE (gst_buffer_pool_set_active (pool.get (), TRUE));
  gst_buffer_pool_set_active (pool.get (), FALSE);
}

TEST_F (DemuxOffers, NoVideoMetaThatThePeerOfCodedCouldNotRead)
{
  Downstream recorder (demux.request ("coded"));
  recorder.video_meta = false;
  EXPECT_FALSE (offers_video_meta ());
}

TEST_F (DemuxOffers, VideoMetaThatThePeerOfCodedReads)
{
  Downstream recorder (demux.request ("coded"));
  EXPECT_TRUE (offers_video_meta ());
}

/* ---------------------------------------------------------------- metas -- */

TEST_F (DemuxBuffers, EverySubframeIsDescribedOnce)
{
  BufferPtr frame = frame_of (picture (), 0);
  set_frame_meta (frame.get (), {.frame = 7, .locked = true});
  ASSERT_EQ (demux.push (std::move (frame)), GST_FLOW_OK);
  for (int k = 0; k < 4; k++) {
    const BufferPtr buffer = demux.pull ();
    ASSERT_TRUE (buffer);
    EXPECT_EQ (gst_buffer_get_n_meta (
                   buffer.get (), gst_meta_get_info (kFrameMetaName)->api),
        1u);
    const auto meta = get_frame_meta (buffer.get ());
    ASSERT_TRUE (meta);
    EXPECT_EQ (meta->frame, 7u);
    EXPECT_EQ (meta->subframe, k);
    EXPECT_EQ (meta->locked, true);
  }
}

TEST_F (DemuxBuffers, MetasOfTheFrameAreOnEverySubframe)
{
  static const gchar *tags[] = {"video", nullptr};
  if (!gst_meta_get_info ("CameraTemperature"))
    gst_meta_register_custom (
        "CameraTemperature", tags, nullptr, nullptr, nullptr);
  BufferPtr frame = padded_frame (picture (), kWidth + 2, 0);
  GstCustomMeta *temperature =
      gst_buffer_add_custom_meta (frame.get (), "CameraTemperature");
  gst_structure_set (gst_custom_meta_get_structure (temperature), "celsius",
      G_TYPE_INT, 41, nullptr);
  const CapsPtr clock = caps_of ("timestamp/x-camera-device");
  gst_buffer_add_reference_timestamp_meta (
      frame.get (), clock.get (), 123456789, GST_CLOCK_TIME_NONE);
  gst_buffer_add_video_region_of_interest_meta (
      frame.get (), "cell", 4, 8, 10, 6);
  auto *crop = gst_buffer_add_video_crop_meta (frame.get ());
  crop->width = 8;
  ASSERT_EQ (demux.push (std::move (frame)), GST_FLOW_OK);

  for (int k = 0; k < 4; k++) {
    const BufferPtr buffer = demux.pull ();
    ASSERT_TRUE (buffer);
    GstCustomMeta *kept =
        gst_buffer_get_custom_meta (buffer.get (), "CameraTemperature");
    ASSERT_TRUE (kept);
    int celsius = 0;
    gst_structure_get_int (
        gst_custom_meta_get_structure (kept), "celsius", &celsius);
    EXPECT_EQ (celsius, 41);
    const auto *reference =
        gst_buffer_get_reference_timestamp_meta (buffer.get (), clock.get ());
    ASSERT_TRUE (reference);
    EXPECT_EQ (reference->timestamp, 123456789u);
    const auto *region =
        gst_buffer_get_video_region_of_interest_meta (buffer.get ());
    ASSERT_TRUE (region);
    EXPECT_EQ (region->x, 2u);
    EXPECT_EQ (region->y, 4u);
    EXPECT_EQ (region->w, 5u);
    EXPECT_EQ (region->h, 3u);
    EXPECT_FALSE (gst_buffer_get_video_crop_meta (buffer.get ()));
    const auto *layout = gst_buffer_get_video_meta (buffer.get ());
    ASSERT_TRUE (layout);
    EXPECT_EQ (int (layout->width), kWidth / 2);
    EXPECT_EQ (
        gst_buffer_get_n_meta (buffer.get (), GST_VIDEO_META_API_TYPE), 1u);
  }
}

} // namespace
