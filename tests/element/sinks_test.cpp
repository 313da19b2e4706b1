/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is in the files of sinks after a flush, and after the end of the stream.
 */
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "harness.h"

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

} // namespace
