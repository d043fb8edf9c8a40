#include "slam/io/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "slam/io/snapshot_codec.h"
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
  }
  SnapshotObject object{4, "cup", 0.5, 6, 7, 0.25, {}};
  object.superquadric.shape = {{0.1, 0.2, 0.3}, 0.4, 0.5};
  object.fit = {0.7, 0.02, Eigen::Matrix<double, 9, 9>::Identity()};
  object.fit.covariance(3, 8) = 0.5;
  snapshot.objects = {object};
  snapshot.detections = {{{"cup", 0.75, {1.0, 2.0, 3.0, 4.0}}, 4}};
  snapshot.gravity_known = true;
  snapshot.support_height = 0.75;
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
  EXPECT_EQ(read.points[42].p_map, snapshot.points[42].p_map);
  EXPECT_EQ(read.points[42].rgb, snapshot.points[42].rgb);
  EXPECT_EQ(read.points[42].object_id, snapshot.points[42].object_id);
  ASSERT_EQ(read.objects.size(), 1u);
  EXPECT_EQ(read.objects[0].label, "cup");
  EXPECT_EQ(read.objects[0].observations, 6);
  EXPECT_EQ(read.objects[0].points, 7);
  EXPECT_EQ(read.objects[0].yaw, 0.25);
  EXPECT_EQ(read.objects[0].superquadric.shape.half_size, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(read.objects[0].superquadric.shape.e2, 0.5);
  EXPECT_EQ(read.objects[0].fit.box_agreement, 0.7);
  EXPECT_EQ(read.objects[0].fit.point_rms, 0.02);
  EXPECT_EQ(read.objects[0].fit.covariance, snapshot.objects[0].fit.covariance);
  ASSERT_EQ(read.detections.size(), 1u);
  EXPECT_EQ(read.detections[0].detection.box.height, 4.0);
  EXPECT_EQ(read.detections[0].object_id, 4);
  EXPECT_TRUE(read.gravity_known);
  EXPECT_EQ(read.support_height, 0.75);
  EXPECT_FALSE(DecodeSnapshot(EncodeSnapshot(MapSnapshot{})).T_map_camera.has_value());
}

TEST(SnapshotCodec, BrokenBytesAreRefused) {
  const std::string bytes = EncodeSnapshot(MakeSnapshot(1));
  EXPECT_THROW(DecodeSnapshot(bytes.substr(0, 4)), InputError);
  EXPECT_THROW(DecodeSnapshot(bytes.substr(0, bytes.size() / 2)), InputError);
  std::string huge = bytes;
  huge[6] = '\x7F';
  EXPECT_THROW(DecodeSnapshot(huge), InputError);
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
