#include "slam/run/recorder.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <chrono>
#include <thread>

#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {

constexpr int kSnapshots = 40;  // more than may wait at a time

MapSnapshotPtr Snapshot(int frame) {
  auto map = std::make_shared<MapSnapshot>(HandMadeMap());
  map->frame_index = frame;
  return map;
}

TEST(Recorder, WritesSameBytesAsUnthreadedWriter) {
  const TemporaryFolder folder;
  const std::filesystem::path direct = folder.Path() / "direct.sqmap";
  const std::filesystem::path queued = folder.Path() / "queued.sqmap";
  RecordingWriter writer(direct, {"desk", "1", ""});
  Recorder recorder(queued, {"desk", "1", ""});
  for (int i = 0; i < kSnapshots; ++i) {
    writer.Add(*Snapshot(i));
    recorder.Add(Snapshot(i));
  }
  EXPECT_EQ(recorder.Newest()->frame_index, kSnapshots - 1);
  writer.Close();
  recorder.Close();
  EXPECT_EQ(ReadFile(queued, "a recording"), ReadFile(direct, "a recording"));
}

// As a kill would leave it: the recording is read while it is still open.
TEST(Recorder, WritesNewestMapDuringRun) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.Path() / "map.sqmap";
  Recorder recorder(path, {});
  recorder.Add(Snapshot(0));
  const Camera camera{640, 480, 500.0, 500.0, 320.0, 240.0, {}, 30.0};
  recorder.Keep({camera, "words", "the map of then"});
  recorder.Add(Snapshot(1));
  recorder.Keep({camera, "words", "the map of now"});
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  std::string state;
  while (state != "the map of now" && std::chrono::steady_clock::now() < deadline) {
    try {
      state = ReadSavedMap(path).state;
    } catch (const InputError&) {  // not there yet
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_EQ(state, "the map of now");
  recorder.Close();
  EXPECT_EQ(RecordingReader(path).Size(), 2);
  EXPECT_EQ(ReadSavedMap(path).state, "the map of now");
}

TEST(Recorder, WritesPendingMapsWhenRunFails) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.Path() / "map.sqmap";
  {
    Recorder recorder(path, {});
    for (int i = 0; i < 3; ++i) {
      recorder.Add(Snapshot(i));
    }
  }
  EXPECT_EQ(RecordingReader(path).Size(), 3);
}

TEST(Recorder, RethrowsFailureOnCloseWithoutBlocking) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.Path() / "map.sqmap";
  Recorder recorder(path, {});
  sqlite3* db = nullptr;  // somebody takes the table away
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, "DROP TABLE snapshots", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(db);
  for (int i = 0; i < kSnapshots; ++i) {
    recorder.Add(Snapshot(i));
  }
  while (!recorder.Failed()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_THROW(recorder.Close(), InputError);
}

}  // namespace
}  // namespace sqslam
