#include "slam/snapshot/saved_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

class SavedMapTest : public ::testing::Test {
 protected:
  SavedMapTest() {
    RecordingWriter(path_, {"sequence", "version", "config"}).Add(MapSnapshot());
    map_.camera = {640, 480, 500.0, 510.0, 320.0, 240.0, {0.1}, 30.0, 12.0};
    map_.vocabulary = "00c0ffee";
    map_.state = std::string(100000, 'm') + std::string("\0\1\2", 3);
  }
  void Execute(const std::string& sql) const {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
  }
  void ExpectRefused(const std::string& message) const {
    try {
      ReadSavedMap(path_);
      FAIL() << "expected: " << message;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("map.sqmap: "));
      EXPECT_THAT(error.what(), HasSubstr(message));
    }
  }

  const TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.Path() / "map.sqmap";
  SavedMap map_;
};

TEST_F(SavedMapTest, ReadsBackUnchanged) {
  SaveMapInRecording(path_, map_);
  const SavedMap read = ReadSavedMap(path_);
  EXPECT_TRUE(read.state == map_.state);
  EXPECT_EQ(read.vocabulary, map_.vocabulary);
  EXPECT_EQ(read.camera.fy, map_.camera.fy);
  EXPECT_EQ(read.camera.distortion, map_.camera.distortion);
  EXPECT_EQ(read.camera.readout_ms, map_.camera.readout_ms);
  EXPECT_EQ(RecordingReader(path_).Size(), 1) << "snapshots stay";
}

// A map of a long run takes several rows of the recording.
TEST_F(SavedMapTest, SpansSeveralRowsWhenLarge) {
  map_.camera.lens = LensModel::kFisheye;
  map_.state.clear();
  for (int i = 0; map_.state.size() < 9'000'000; ++i) {
    map_.state += std::to_string(i);
  }
  SaveMapInRecording(path_, map_);
  const SavedMap read = ReadSavedMap(path_);
  EXPECT_TRUE(read.state == map_.state);
  EXPECT_EQ(read.camera.lens, LensModel::kFisheye);
}

TEST_F(SavedMapTest, KeepsFisheyeLens) {
  map_.camera.lens = LensModel::kFisheye;
  SaveMapInRecording(path_, map_);
  EXPECT_EQ(ReadSavedMap(path_).camera.lens, LensModel::kFisheye);
}

TEST_F(SavedMapTest, ReplacesEarlierMap) {
  SaveMapInRecording(path_, map_);
  SavedMap grown = map_;
  grown.state += grown.state;
  SaveMapInRecording(path_, grown);
  EXPECT_TRUE(ReadSavedMap(path_).state == grown.state);
  SaveMapInRecording(path_, map_);
  EXPECT_TRUE(ReadSavedMap(path_).state == map_.state);
}

TEST_F(SavedMapTest, ReportsRunWithoutMap) { ExpectRefused("holds no map to continue"); }

TEST_F(SavedMapTest, RefusesDamagedMap) {
  SaveMapInRecording(path_, map_);
  Execute("UPDATE live_map SET data = substr(data, 1, length(data) - 5)");
  ExpectRefused("its live map is broken");
  Execute("UPDATE live_map SET data = x'0011'");
  ExpectRefused("its live map is broken");
  Execute("DELETE FROM live_map");
  ExpectRefused("holds no map to continue");
}

}  // namespace
}  // namespace sqslam
