#include "slam/snapshot/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <numeric>
#include <random>
#include <vector>

#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/snapshot_codec.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

MapSnapshot MakeSnapshot(int number, int points = 100) {
  MapSnapshot snapshot;
  snapshot.sequence_number = number;
  snapshot.frame_index = 10 * number;
  snapshot.timestamp = 0.1 * number;
  snapshot.image_path = "/images/" + std::to_string(number) + ".png";
  snapshot.camera = {640, 480, 500.0, 501.0, 320.0, 240.0, {0.1, 0.2, 0.3, 0.4, 0.5}, 25.0};
  snapshot.T_map_camera = Rigid3d{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {1.0, 2.0, number * 1.0}};
  snapshot.keyframes = {{3, 30, 1.0, *snapshot.T_map_camera}};
  for (int i = 0; i < points; ++i) {
    snapshot.points.push_back({{0.1F * i, 0.2F, -0.3F}, {static_cast<std::uint8_t>(i), 2, 3}, i % 5 - 1});
    snapshot.points.back().anomaly = 0.0078125F * static_cast<float>(i % 128);
    snapshot.points.back().rejected_by = i % 7 - 1;
  }
  SnapshotObject object{4, "cup", 0.5, 6, 7, 0.25, {}};
  object.superquadric.shape = {{0.1, 0.2, 0.3}, 0.4, 0.5};
  object.fit = {0.7, 0.02, 0.55, Eigen::Matrix<double, 9, 9>::Identity()};
  object.fit.covariance(3, 8) = 0.5;
  snapshot.objects = {object};
  snapshot.detections = {{{"cup", 0.75, {1.0, 2.0, 3.0, 4.0}}, 4}};
  snapshot.gravity_known = true;
  snapshot.support_height = 0.75;
  snapshot.progress = SnapshotProgress{250, 7.5, 80.25, {.loops = 2, .merges = 1}};
  snapshot.covisibility = {{3, 8, 120}, {3, 9, 15}};
  return snapshot;
}

TEST(SnapshotCodec, EveryFieldComesBack) {
  const MapSnapshot snapshot = MakeSnapshot(3);
  const MapSnapshot read = DecodeSnapshot(EncodeSnapshot(snapshot));
  EXPECT_EQ(read.sequence_number, 3);
  EXPECT_EQ(read.frame_index, 30);
  EXPECT_EQ(read.timestamp, snapshot.timestamp);
  EXPECT_EQ(read.image_path, snapshot.image_path);
  EXPECT_EQ(read.camera.fy, 501.0);
  EXPECT_EQ(read.camera.fps, 25.0);
  EXPECT_EQ(read.camera.distortion, snapshot.camera.distortion);
  EXPECT_EQ(read.T_map_camera->Matrix(), snapshot.T_map_camera->Matrix());
  ASSERT_EQ(read.keyframes.size(), 1u);
  EXPECT_EQ(read.keyframes[0].id, 3);
  EXPECT_EQ(read.keyframes[0].frame_index, 30);
  EXPECT_EQ(read.keyframes[0].T_map_camera.Matrix(), snapshot.T_map_camera->Matrix());
  ASSERT_EQ(read.points.size(), 100u);
  EXPECT_TRUE(read.points[42].p_map.isApprox(snapshot.points[42].p_map, 2e-5F));
  EXPECT_EQ(read.points[42].rgb, snapshot.points[42].rgb);
  EXPECT_EQ(read.points[42].object_id, snapshot.points[42].object_id);
  EXPECT_EQ(read.points[42].anomaly, 0.328125F);
  EXPECT_EQ(read.points[42].rejected_by, -1);
  EXPECT_EQ(read.points[45].rejected_by, 2);
  ASSERT_EQ(read.objects.size(), 1u);
  EXPECT_EQ(read.objects[0].label, "cup");
  EXPECT_EQ(read.objects[0].observations, 6);
  EXPECT_EQ(read.objects[0].points, 7);
  EXPECT_EQ(read.objects[0].yaw, 0.25);
  EXPECT_EQ(read.objects[0].superquadric.shape.half_size, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(read.objects[0].superquadric.shape.e2, 0.5);
  EXPECT_EQ(read.objects[0].fit.box_agreement, 0.7);
  EXPECT_EQ(read.objects[0].fit.reliability, 0.55);
  EXPECT_EQ(read.objects[0].fit.point_rms, 0.02);
  EXPECT_EQ(read.objects[0].fit.covariance, snapshot.objects[0].fit.covariance);
  ASSERT_EQ(read.detections.size(), 1u);
  EXPECT_EQ(read.detections[0].detection.box.height, 4.0);
  EXPECT_EQ(read.detections[0].object_id, 4);
  EXPECT_TRUE(read.gravity_known);
  EXPECT_EQ(read.support_height, 0.75);
  ASSERT_TRUE(read.progress.has_value());
  EXPECT_EQ(read.progress->tracked_points, 250);
  EXPECT_EQ(read.progress->tracking_ms, 7.5);
  EXPECT_EQ(read.progress->mapping_ms, 80.25);
  EXPECT_EQ(read.progress->counters.loops, 2);
  EXPECT_EQ(read.progress->counters.merges, 1);
  ASSERT_EQ(read.covisibility.size(), 2u);
  EXPECT_EQ(read.covisibility[0].first, 3);
  EXPECT_EQ(read.covisibility[0].second, 8);
  EXPECT_EQ(read.covisibility[0].points, 120);
  EXPECT_FALSE(DecodeSnapshot(EncodeSnapshot(MapSnapshot{})).T_map_camera.has_value());
}

// As the program wrote it when points had neither anomaly nor rejected_by: a cup with two points, one its
// own.
std::string SnapshotOfVersion2() {
  constexpr std::string_view kHex =
      "400400000000000078016366800039280da11ed8b30219897a0579e90d4c0c0c0f18a1b20ef50e60560094662881f019"
      "f2a0b4259406abc24bc08cc4a1e8833d440246333840f81c601ae826206800a901610720db0e481d00d20e5c1a224672"
      "362c40e1ff4000b206c46606e2e4d202200907982e8059868b7e007514dc0834064c1f9af02877340406690880f2004a"
      "d6788137df313008388072132334efbcb00700232521df";
  std::string bytes;
  for (std::size_t i = 0; i < kHex.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(std::string(kHex.substr(i, 2)), nullptr, 16));
  }
  return bytes;
}

void ExpectSnapshotOfVersion2(const MapSnapshot& snapshot) {
  EXPECT_EQ(snapshot.frame_index, 30);
  ASSERT_EQ(snapshot.points.size(), 2u);
  EXPECT_EQ(snapshot.points[0].p_map, Eigen::Vector3f(1.0F, 2.0F, -3.0F));
  EXPECT_EQ(snapshot.points[0].object_id, 4);
  EXPECT_EQ(snapshot.points[1].object_id, -1);
  for (const SnapshotPoint& point : snapshot.points) {
    EXPECT_EQ(point.anomaly, 0.0F);
    EXPECT_EQ(point.rejected_by, -1);
  }
  ASSERT_EQ(snapshot.objects.size(), 1u);
  EXPECT_EQ(snapshot.objects[0].superquadric.shape.e2, 0.5);
  ASSERT_EQ(snapshot.detections.size(), 1u) << "what comes after the points is read from its place";
  EXPECT_EQ(snapshot.detections[0].detection.box.height, 4.0);
  EXPECT_EQ(snapshot.support_height, 0.75);
}

TEST(SnapshotCodec, RecordedPositionsComeBackExactly) {
  MapSnapshot snapshot;
  const Eigen::Vector3d p(1.0 / 3.0, -1234.5678, 1e-7);
  snapshot.points.resize(2);
  snapshot.points[1].p_map = RecordedPosition(p);
  EXPECT_TRUE((snapshot.points[1].p_map.cast<double>() - p).cwiseQuotient(p).cwiseAbs().maxCoeff() < 1.6e-5);
  EXPECT_EQ(DecodeSnapshot(EncodeSnapshot(snapshot)).points[1].p_map, snapshot.points[1].p_map);
}

TEST(SnapshotCodec, Version2IsReadWithDefaults) {
  const std::string raw = UnpackBytes(SnapshotOfVersion2(), "a snapshot");
  ExpectSnapshotOfVersion2(DecodeSnapshot(raw, 2));
  EXPECT_EQ(EncodeSnapshot(DecodeSnapshot(raw, 2), 2), raw);
  EXPECT_THROW(DecodeSnapshot(raw), InputError);
}

// What a snapshot of version 7 lacks: what older programs did not write stands at the end.
std::string WithoutTail(const MapSnapshot& snapshot, std::uint64_t tail) {
  const std::string raw = EncodeSnapshot(snapshot, 7);
  return raw.substr(0, raw.size() - tail);
}

constexpr std::uint64_t kEmptyList = sizeof(std::uint32_t);  // its length
constexpr std::uint64_t kReliabilities = sizeof(double);     // of one object

// As the program wrote it when snapshots said nothing of the run's progress: also without the byte which says
// that there is none.
TEST(SnapshotCodec, Version3IsReadWithoutProgress) {
  MapSnapshot snapshot = MakeSnapshot(1);
  snapshot.progress.reset();
  snapshot.covisibility.clear();
  const std::string old = WithoutTail(snapshot, kReliabilities + kEmptyList + 1);
  const MapSnapshot read = DecodeSnapshot(old, 3);
  EXPECT_EQ(read.points.at(42).anomaly, 0.328125F);
  EXPECT_EQ(read.support_height, 0.75);
  EXPECT_FALSE(read.progress.has_value());
  EXPECT_THROW(DecodeSnapshot(old), InputError);
}

TEST(SnapshotCodec, Version4IsReadWithoutCovisibility) {
  MapSnapshot snapshot = MakeSnapshot(1);
  snapshot.covisibility.clear();
  const std::string old = WithoutTail(snapshot, kReliabilities + kEmptyList);
  const MapSnapshot read = DecodeSnapshot(old, 4);
  EXPECT_EQ(read.progress->counters.merges, 1);
  EXPECT_TRUE(read.covisibility.empty());
  EXPECT_THROW(DecodeSnapshot(old), InputError);
}

TEST(SnapshotCodec, Version5IsReadAsReliable) {
  const MapSnapshot snapshot = MakeSnapshot(1);
  const MapSnapshot read = DecodeSnapshot(WithoutTail(snapshot, kReliabilities), 5);
  EXPECT_EQ(read.covisibility.size(), snapshot.covisibility.size());
  EXPECT_TRUE(IsReliable(read.objects.at(0)));
}

TEST(SnapshotCodec, BrokenBytesAreRefused) {
  const std::string bytes = EncodeSnapshot(MakeSnapshot(1));
  EXPECT_THROW(DecodeSnapshot(bytes.substr(0, 4)), InputError);
  EXPECT_THROW(DecodeSnapshot(bytes.substr(0, bytes.size() / 2)), InputError);
  EXPECT_THROW(DecodeSnapshot(bytes + 'x'), InputError);
}

TEST(Recording, AnySnapshotCanBeReadAlone) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  {
    RecordingWriter writer(path, {"/data/kitchen", "1.2.3", "seed: 1\n"});
    for (int i = 0; i < 20; ++i) {
      writer.Add(MakeSnapshot(i));
    }
  }
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "map.sqmap-wal"));
  const RecordingReader reader(path);
  EXPECT_EQ(reader.Info().sequence_path, "/data/kitchen");
  EXPECT_EQ(reader.Info().program_version, "1.2.3");
  EXPECT_EQ(reader.Info().config, "seed: 1\n");
  ASSERT_EQ(reader.Size(), 20);
  EXPECT_EQ(reader.FrameIndex(13), 130);
  EXPECT_EQ(reader.Read(13)->sequence_number, 13);
  EXPECT_EQ(reader.Read(2)->frame_index, 20);
  EXPECT_EQ(reader.Last()->sequence_number, 19);
  EXPECT_THROW(reader.Read(20), InputError);
  EXPECT_THROW(RecordingWriter(path, {}), InputError);
}

TEST(Recording, WhatIsReadCanBeEditedOnTheWay) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter(path, {"s", "v", "c"}).Add(MakeSnapshot(0));
  const RecordingReader edited(path, [](MapSnapshotPtr snapshot) {
    auto changed = std::make_shared<MapSnapshot>(*snapshot);
    changed->objects.front().label = "mug";
    return changed;
  });
  EXPECT_EQ(edited.Read(0)->objects.front().label, "mug");
  EXPECT_EQ(edited.Last()->objects.front().label, "mug");
  EXPECT_EQ(RecordingReader(path).Last()->objects.front().label, "cup");
}

// A map of 1000 points of which each snapshot moves 20.
MapSnapshot MakeGrowing(int number) {
  MapSnapshot snapshot = MakeSnapshot(number, 0);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> coordinate(-1.0F, 1.0F);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3f p(coordinate(random), coordinate(random), coordinate(random));
    snapshot.points.push_back({(i / 20 < number ? 1.01F : 1.0F) * p, {1, 2, 3}, -1});
  }
  return snapshot;
}

void ExecuteIn(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
}

TEST(Recording, StoresWhatChangesAndReadsInAnyOrder) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  constexpr int kSnapshots = 50;
  {
    RecordingWriter writer(path, {});
    for (int i = 0; i < kSnapshots; ++i) {
      writer.Add(MakeGrowing(i));
    }
  }
  const auto complete = PackPatch(EncodeSnapshot(MakeGrowing(0)), {}).size();
  EXPECT_LT(std::filesystem::file_size(path), kSnapshots * complete / 3);
  const RecordingReader reader(path);
  std::vector<int> order(kSnapshots);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::shuffle(order, std::mt19937(1));
  for (const int i : order) {
    EXPECT_EQ(EncodeSnapshot(*reader.Read(i)), EncodeSnapshot(MakeGrowing(i))) << i;
  }
}

TEST(Recording, ItsLastSnapshotNeedsNoOther) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  {
    RecordingWriter writer(path, {});
    for (int i = 0; i < 5; ++i) {
      writer.Add(MakeGrowing(i));
    }
  }
  ExecuteIn(path, "UPDATE snapshots SET data = x'00' WHERE id = 1");
  const RecordingReader reader(path);
  EXPECT_EQ(reader.Read(0)->sequence_number, 0);
  EXPECT_THAT(InputErrorOf([&] { reader.Read(3); }), HasSubstr("map.sqmap: snapshot 3: its state is broken"));
  EXPECT_EQ(reader.Last()->sequence_number, 4);
}

TEST(Recording, PatchesThatLeadNowhereAreRefused) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  {
    RecordingWriter writer(path, {});
    for (int i = 0; i < 4; ++i) {
      writer.Add(MakeGrowing(i));
    }
  }
  ExecuteIn(path, "UPDATE snapshots SET base = 2 WHERE id = 2");
  EXPECT_THAT(InputErrorOf([&] { RecordingReader(path).Read(2); }),
              HasSubstr("map.sqmap: snapshot 2: is a patch of snapshot 2"));
  ExecuteIn(path, "UPDATE snapshots SET base = NULL WHERE id = 2");
  EXPECT_THAT(InputErrorOf([&] { RecordingReader(path).Read(2); }), HasSubstr("is broken"));
  ExecuteIn(path, "UPDATE snapshots SET base = 1 WHERE id = 2; UPDATE snapshots SET id = 7 WHERE id = 1");
  EXPECT_THAT(InputErrorOf([&] { RecordingReader(path).Read(2); }),
              HasSubstr("snapshot 1, which is missing"));
  EXPECT_EQ(RecordingReader(path).Read(0)->sequence_number, 0);
}

// Snapshots that are added to a recording of an older program have its format.
TEST(Recording, OfVersion7CanBeAppendedTo) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter(path, {}).Close();
  ExecuteIn(path,
            "ALTER TABLE snapshots DROP COLUMN base; UPDATE meta SET value = '7' WHERE key = 'version';"
            "INSERT INTO snapshots (id, frame_index, timestamp, data) VALUES (0, 0, 0, x'00')");
  AppendToRecording(path, MakeSnapshot(5));
  const RecordingReader reader(path);
  ASSERT_EQ(reader.Size(), 2);
  EXPECT_EQ(EncodeSnapshot(*reader.Last()), EncodeSnapshot(MakeSnapshot(5)));
}

// Gives a recording of one snapshot another version, and the snapshot other bytes where there are some.
void Rewrite(const std::filesystem::path& path, const std::string& version, const std::string& data) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(db, ("UPDATE meta SET value='" + version + "' WHERE key='version'").c_str(), nullptr,
                         nullptr, nullptr),
            SQLITE_OK);
  sqlite3_stmt* update = nullptr;
  sqlite3_prepare_v2(db, "UPDATE snapshots SET data=?", -1, &update, nullptr);
  sqlite3_bind_blob(update, 1, data.data(), static_cast<int>(data.size()), SQLITE_STATIC);
  EXPECT_EQ(data.empty() ? SQLITE_DONE : sqlite3_step(update), SQLITE_DONE);
  sqlite3_finalize(update);
  sqlite3_close(db);
}

TEST(Recording, OfVersion2IsReadableAndOfUnknownOnesRefused) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter(path, {"s", "v", "c"}).Add(MakeSnapshot(0));
  Rewrite(path, "2", SnapshotOfVersion2());
  ExpectSnapshotOfVersion2(*RecordingReader(path).Last());
  for (const char* version : {"1", "9", "two"}) {
    Rewrite(path, version, "");
    EXPECT_THAT(InputErrorOf([&] { RecordingReader reader(path); }),
                HasSubstr(std::string("version ") + version + ", expected a map.sqmap of version 2 to 8"));
  }
}

TEST(Recording, IsReadableAfterTheWriterWasKilled) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    RecordingWriter writer(path, {"s", "v", "c"});
    for (int i = 0;; ++i) {
      writer.Add(MakeSnapshot(i, 2000));
      const char byte = 0;
      if (::write(pipe_ends[1], &byte, 1) != 1) {
        ::_exit(1);
      }
    }
  }
  for (int i = 0; i < 5; ++i) {
    char byte = 0;
    ASSERT_EQ(::read(pipe_ends[0], &byte, 1), 1);
  }
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  const RecordingReader reader(path);
  ASSERT_GE(reader.Size(), 5);
  for (int i = 0; i < reader.Size(); ++i) {
    EXPECT_EQ(reader.Read(i)->sequence_number, i);
    EXPECT_EQ(reader.Read(i)->points.size(), 2000u);
  }
}

TEST(Recording, CanBeReadWhileItIsWritten) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter writer(path, {});
  writer.Add(MakeSnapshot(0));
  EXPECT_EQ(RecordingReader(path).Last()->sequence_number, 0);
  writer.Add(MakeSnapshot(1));
  EXPECT_EQ(RecordingReader(path).Last()->sequence_number, 1);
}

TEST(Recording, AFullDiskIsReportedAndKeepsWhatWasAdded) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  rlimit old_limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  std::string message;
  {
    RecordingWriter writer(path, {});
    writer.Add(MakeSnapshot(0));
    const rlimit limit{200000, old_limit.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
    message = InputErrorOf([&] {
      for (int i = 1; i < 1000; ++i) {
        writer.Add(MakeSnapshot(i, 5000));
      }
    });
    setrlimit(RLIMIT_FSIZE, &old_limit);
  }
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(message, HasSubstr("map.sqmap: "));
  EXPECT_EQ(RecordingReader(path).Read(0)->sequence_number, 0);
}

TEST(Recording, TellsFramesAndTimesWithoutReading) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter(path, {}).Add(MakeSnapshot(3));
  const RecordingReader reader(path, [](const MapSnapshotPtr&) -> MapSnapshotPtr {
    ADD_FAILURE() << "read";
    return nullptr;
  });
  EXPECT_EQ(reader.FrameIndex(0), 30);
  EXPECT_EQ(reader.Timestamp(0), MakeSnapshot(3).timestamp);
}

TEST(Recording, WithoutASnapshotThereIsNoLastOne) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter(path, {}).Close();
  EXPECT_THAT(InputErrorOf([&] { RecordingReader(path).Last(); }), HasSubstr("map.sqmap: holds no snapshot"));
}

TEST(Recording, OtherFilesAreRefused) {
  const TemporaryFolder folder;
  EXPECT_THAT(InputErrorOf([&] { RecordingReader(folder.Path() / "none"); }), HasSubstr("does not exist"));
  const auto text = folder.Write("a.sqmap",
                                 "words, and more of them than a header takes................"
                                 "..............................................................");
  EXPECT_THAT(InputErrorOf([&] { RecordingReader reader(text); }), HasSubstr("no recording of a map"));
  EXPECT_THAT(InputErrorOf([&] { RecordingReader reader(folder.Write("b.sqmap", "")); }),
              HasSubstr("no recording"));
}

}  // namespace
}  // namespace sqslam
