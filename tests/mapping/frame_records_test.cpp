#include "slam/mapping/frame_records.h"

#include <gtest/gtest.h>

#include "slam/snapshot/byte_archive.h"

namespace sqslam {
namespace {

constexpr int kFrames = 5000;

OpenFrame FrameAt(std::int64_t index) {
  const auto number = static_cast<double>(index);
  OpenFrame frame;
  frame.timestamp = 0.1 * number;
  frame.pose.reference = index / 10;
  frame.pose.T_camera_reference = {Eigen::Quaterniond(0.5, 0.1 * number, 0.2, -0.3),
                                   {number, 1.0 / 3.0, -2.0}};
  frame.pose.scale = 1.0 / (1.0 + number);
  frame.matches.resize(3);
  return frame;
}

std::string BytesOf(const FrameRecord& frame) {
  ByteWriter writer;
  writer(frame);
  return writer.Take();
}

// Every second frame; all but the newest ten are settled.
FrameRecords RecordFrames() {
  FrameRecords frames;
  for (std::int64_t i = 0; i < kFrames; ++i) {
    frames.Record(2 * i, FrameAt(2 * i));
    frames.SettleBelow(2 * (i - 9));
  }
  return frames;
}

std::vector<std::int64_t> IndicesOf(const FrameRecords& frames) {
  std::vector<std::int64_t> indices;
  frames.ForEach([&](std::int64_t index, const FrameRecord&) { indices.push_back(index); });
  return indices;
}

TEST(FrameRecords, FindsEveryRecordedFrame) {
  const FrameRecords frames = RecordFrames();
  EXPECT_EQ(frames.Size(), kFrames);
  EXPECT_EQ(frames.Open().size(), 10U);
  for (std::int64_t i = 0; i < kFrames; ++i) {
    const auto found = frames.Find(2 * i);
    ASSERT_TRUE(found) << i;
    EXPECT_EQ(BytesOf(*found), BytesOf(FrameAt(2 * i)));
    EXPECT_FALSE(frames.Contains(2 * i + 1));
  }
  EXPECT_EQ(frames.Oldest().first, 0);
  EXPECT_EQ(frames.Newest().first, 2 * kFrames - 2);
  EXPECT_EQ(frames.FromOn(3).first, 4);
  EXPECT_EQ(frames.FromOn(2 * kFrames).first, 2 * kFrames - 2);
}

TEST(FrameRecords, KeepsOrderWhenFramesComeLate) {
  FrameRecords frames = RecordFrames();
  frames.Record(7, FrameAt(7));
  frames.Record(20, FrameAt(21));  // anew
  frames.SettleBelow(2 * kFrames);
  EXPECT_EQ(frames.Size(), kFrames + 1);
  EXPECT_EQ(BytesOf(*frames.Find(20)), BytesOf(FrameAt(21)));
  EXPECT_EQ(frames.FromOn(5).first, 6);
  EXPECT_EQ(frames.FromOn(7).first, 7);
  EXPECT_TRUE(std::ranges::is_sorted(IndicesOf(frames)));
}

TEST(FrameRecords, AbsorbsFramesOfAnotherSubmap) {
  FrameRecords frames = RecordFrames();
  FrameRecords others;
  for (const std::int64_t index : {3, 5, 8, 2 * kFrames + 1}) {
    others.Record(index, FrameAt(index + 1));
    others.SettleBelow(6);
  }
  frames.Absorb(std::move(others));
  EXPECT_EQ(frames.Size(), kFrames + 3);
  EXPECT_EQ(BytesOf(*frames.Find(5)), BytesOf(FrameAt(6)));
  EXPECT_EQ(BytesOf(*frames.Find(8)), BytesOf(FrameAt(8)));  // its own
  EXPECT_TRUE(std::ranges::is_sorted(IndicesOf(frames)));
}

TEST(FrameRecords, RestoresRenumberedFrames) {
  FrameRecords frames = RecordFrames();
  frames.Renumber(100, 5.0, 7);
  ByteWriter writer;
  frames.Save(writer);
  ByteReader reader(writer.Bytes(), "frames");
  FrameRecords restored;
  restored.Load(reader);
  ByteWriter again;
  restored.Save(again);
  EXPECT_EQ(again.Bytes(), writer.Bytes());
  const FrameRecord frame = restored.Find(102).value();
  EXPECT_EQ(frame.pose.reference, FrameAt(2).pose.reference + 7);
  EXPECT_EQ(frame.timestamp, FrameAt(2).timestamp + 5.0);
}

}  // namespace
}  // namespace sqslam
