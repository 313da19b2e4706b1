/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is in the files of sinks after a flush, and after the end of the stream.
 */
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "common/tag.h"
#include "harness.h"
#include "preset.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;
namespace fs = std::filesystem;

std::string
content (const std::string &path)
{
  std::ifstream file (path, std::ios::binary);
  return {std::istreambuf_iterator<char> (file), {}};
}

class Sink : public ::testing::Test
{
protected:
  Sink ()
  {
    std::string name = ::testing::TempDir () + "/sinks_XXXXXX";
    folder_ = mkdtemp (name.data ());
  }
  ~Sink () override { fs::remove_all (folder_); }

  void begin (const std::string &element, const std::string &file)
  {
    path = folder_ + "/" + file;
    sink.emplace (element + " location=" + path, "sink", nullptr);
  }
  void push_segment (GstFormat format)
  {
    GstSegment segment;
    gst_segment_init (&segment, format);
    sink->push_event (gst_event_new_segment (&segment));
  }
  void flush (GstFormat format)
  {
    sink->push_event (gst_event_new_flush_start ());
    sink->push_event (gst_event_new_flush_stop (TRUE));
    push_segment (format);
  }
  void end () { sink->push_event (gst_event_new_eos ()); }
  void run_again ()
  {
    gst_element_set_state (sink->element (), GST_STATE_READY);
    gst_element_set_state (sink->element (), GST_STATE_PLAYING);
  }

  std::string path;
  std::optional<ElementHarness> sink;

private:
  std::string folder_;
};

class FileSink : public Sink
{
protected:
  GstFlowReturn push (const std::string &text)
  {
    return sink->push (
        BufferPtr (gst_buffer_new_memdup (text.data (), text.size ())));
  }
};

TEST_F (FileSink, AFlushBeginsTheFileAnew)
{
  begin ("codedexposure-filesink", "file");
  sink->set_caps ("video/x-matroska");
  EXPECT_EQ (push ("a long recording"), GST_FLOW_OK);
  flush (GST_FORMAT_BYTES);
  EXPECT_EQ (content (path), "");
  EXPECT_EQ (push ("short"), GST_FLOW_OK);
  end ();
  EXPECT_EQ (content (path), "short");
  EXPECT_EQ (sink->error (), "");
}

TEST_F (FileSink, AnotherRunBeginsTheFileAnew)
{
  begin ("codedexposure-filesink", "file");
  sink->set_caps ("video/x-matroska");
  EXPECT_EQ (push ("a long recording"), GST_FLOW_OK);
  run_again ();
  push_segment (GST_FORMAT_BYTES);
  EXPECT_EQ (push ("short"), GST_FLOW_OK);
  end ();
  EXPECT_EQ (content (path), "short");
}

TEST_F (FileSink, AFinishedFileIsKept)
{
  begin ("codedexposure-filesink", "file");
  sink->set_caps ("video/x-matroska");
  EXPECT_EQ (push ("a long recording"), GST_FLOW_OK);
  end ();
  flush (GST_FORMAT_BYTES);
  EXPECT_EQ (push ("short"), GST_FLOW_ERROR);
  EXPECT_EQ (content (path), "a long recording");
  EXPECT_NE (sink->error ().find (path + " is finished"), std::string::npos);
  EXPECT_EQ (text_property (sink->element (), "problem"), "");
}

/** Pictures in a form of stack. */
class StackSink : public Sink,
                  public ::testing::WithParamInterface<const char *>
{
protected:
  static constexpr int kSide = 8;
  static constexpr guint64 kPictures = 120; // more than a shard

  void SetUp () override
  {
    const std::unique_ptr<GstElementFactory, ObjectUnref> factory (
        gst_element_factory_find ("codedexposure-stack"));
    if (!factory)
      GTEST_SKIP () << "this build writes no stacks";
    begin ("codedexposure-stack", std::string ("stack") + GetParam ());
    if (sink->error () != "")
      GTEST_SKIP () << "this build lacks a library";
    sink->set_caps (gray_caps (kSide, kSide));
    StreamSetup setup;
    setup.schedule = schedule_of ("sequential:2x2");
    sink->push_event (setup_to_event (setup));
  }
  GstFlowReturn push (guint64 number)
  {
    const auto picture =
        draw<std::uint8_t> (kSide, kSide, [] (int, int) { return 7; });
    return sink->push (frame_of (picture, number * GST_MSECOND));
  }
  void push_all (guint64 count)
  {
    for (guint64 k = 0; k < count; k++)
      ASSERT_EQ (push (k), GST_FLOW_OK);
  }
  bool is_folder () const { return fs::is_directory (path); }
  /** The file that describes the pictures. */
  std::string head () const
  {
    return content (is_folder () ? path + "/zarr.json" : path);
  }
  bool has_origin () const
  {
    return head ().find (R"("sequential")") != std::string::npos ||
           head ().find ("&quot;sequential&quot;") != std::string::npos;
  }
  /** Bytes of all pictures. */
  std::uintmax_t size () const
  {
    if (!is_folder ())
      return fs::file_size (path);
    std::uintmax_t bytes = 0;
    for (const auto &entry : fs::recursive_directory_iterator (path + "/0/c"))
      bytes += entry.is_regular_file () ? entry.file_size () : 0;
    return bytes;
  }
};

TEST_P (StackSink, AFinishedFileIsKept)
{
  push_all (kPictures);
  end ();
  const std::uintmax_t before = size ();
  const std::string said = head ();
  flush (GST_FORMAT_TIME);
  EXPECT_EQ (push (0), GST_FLOW_ERROR);
  EXPECT_NE (sink->error ().find (path + " is finished"), std::string::npos);
  gst_element_set_state (sink->element (), GST_STATE_NULL);
  EXPECT_EQ (size (), before);
  EXPECT_EQ (head (), said);
  EXPECT_EQ (text_property (sink->element (), "problem"), "");
}

TEST_P (StackSink, AFileThatCannotBeBegunIsClosed)
{
  fs::create_directories (path + "/0/zarr.json.next"); // a file has this name
  const auto open_files = [] {
    return std::ranges::distance (fs::directory_iterator ("/proc/self/fd"));
  };
  const auto before = open_files ();
  EXPECT_EQ (push (0), GST_FLOW_ERROR);
  EXPECT_EQ (open_files (), before);
}

TEST_P (StackSink, AFlushBeginsTheFileAnew)
{
  push_all (20);
  end ();
  const std::uintmax_t expected = size ();
  SetUp ();
  push_all (kPictures);
  flush (GST_FORMAT_TIME);
  push_all (20);
  end ();
  EXPECT_EQ (size (), expected);
  EXPECT_TRUE (has_origin ());
  EXPECT_EQ (sink->error (), "");
}

TEST_P (StackSink, AnotherRunBeginsTheFileAnew)
{
  push_all (20);
  end ();
  const std::uintmax_t expected = size ();
  SetUp ();
  push_all (kPictures);
  run_again ();
  push_segment (GST_FORMAT_TIME);
  push_all (20);
  end ();
  EXPECT_EQ (size (), expected);
}

TEST_P (StackSink, AStreamThatBreaksOffIsNotComplete)
{
  for (const bool whole : {false, true}) {
    SetUp ();
    push_all (20);
    if (whole)
      end ();
    gst_element_set_state (sink->element (), GST_STATE_READY);
    EXPECT_EQ (head ().find ("unfinished: the stream stopped before its end") ==
                   std::string::npos,
        whole);
    EXPECT_EQ (sink->error (), "");
  }
}

const auto name_of = [] (const auto &info) {
  std::string name = info.param;
  std::erase (name, '.');
  return name;
};

INSTANTIATE_TEST_SUITE_P (
    Of, StackSink, ::testing::Values (".ome.tif", ".h5", ".ome.zarr"), name_of);

} // namespace
