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
#include "slam/snapshot/sqlite_file.h"
#include "tests/io/temporary_folder.h"
#include "tests/snapshot/sample_snapshots.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using testing::MakeSnapshot;

TEST(Recording, ReadsAnySnapshotAlone) {
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

TEST(Recording, AppliesEditsOnReading) {
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

TEST(Recording, StoresDifferencesAndReadsInAnyOrder) {
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

TEST(Recording, ReadsLastSnapshotWhenOthersAreBroken) {
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

TEST(Recording, RefusesPatchesWithoutBase) {
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

TEST(Recording, AppendsSnapshots) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter(path, {}).Add(MakeSnapshot(0));
  AppendToRecording(path, MakeSnapshot(5));
  const RecordingReader reader(path);
  ASSERT_EQ(reader.Size(), 2);
  EXPECT_EQ(EncodeSnapshot(*reader.Last()), EncodeSnapshot(MakeSnapshot(5)));
}

TEST(Recording, RefusesOtherVersions) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter(path, {"s", "v", "c"}).Add(MakeSnapshot(0));
  for (const std::string version : {"10", "12", "two"}) {
    ExecuteIn(path, "UPDATE meta SET value = '" + version + "' WHERE key = 'version'");
    const std::string expected =
        "map.sqmap: has version " + version + " of the recording format, but this program reads version 11";
    EXPECT_THAT(InputErrorOf([&] { RecordingReader reader(path); }), HasSubstr(expected));
    EXPECT_THAT(InputErrorOf([&] { AppendToRecording(path, MakeSnapshot(1)); }), HasSubstr(expected));
  }
}

TEST(Recording, StaysReadableWhenWriterIsKilled) {
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

TEST(Recording, AllowsReadingWhileWriting) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter writer(path, {});
  writer.Add(MakeSnapshot(0));
  EXPECT_EQ(RecordingReader(path).Last()->sequence_number, 0);
  writer.Add(MakeSnapshot(1));
  EXPECT_EQ(RecordingReader(path).Last()->sequence_number, 1);
}

TEST(Recording, LetsWriterCloseWhileBeingRead) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter writer(path, {});
  writer.Add(MakeSnapshot(0));
  {
    const RecordingReader reader(path);
    writer.Add(MakeSnapshot(1));
    EXPECT_NO_THROW(writer.Close());
    EXPECT_EQ(reader.Last()->sequence_number, 0);
  }
  EXPECT_EQ(RecordingReader(path).Last()->sequence_number, 1);
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "map.sqmap-wal"));
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "map.sqmap-shm"));
}

// Returns a recording as a program leaves it that is killed in the middle of a change.
std::filesystem::path RecordingOfAKilledProgram(const std::filesystem::path& folder) {
  const auto path = folder / "map.sqmap";
  const auto killed = folder / "killed.sqmap";
  RecordingWriter writer(path, {});
  for (int i = 0; i < 5; ++i) {
    writer.Add(MakeSnapshot(i, 20000));
  }
  writer.Close();
  const auto db = sqlite::Open(path, SQLITE_OPEN_READWRITE);
  sqlite::Execute(db.get(), path,
                  "PRAGMA cache_size = 1; BEGIN; UPDATE snapshots SET data = zeroblob(1000000)");
  std::filesystem::copy(path, killed);
  std::filesystem::copy(path.string() + "-journal", killed.string() + "-journal");
  return killed;
}

TEST(Recording, UndoesChangeOfKilledProgram) {
  const TemporaryFolder folder;
  const auto path = RecordingOfAKilledProgram(folder.Path());
  const RecordingReader reader(path);
  ASSERT_EQ(reader.Size(), 5);
  EXPECT_EQ(reader.Last()->points.size(), 20000u);
  EXPECT_FALSE(std::filesystem::exists(path.string() + "-journal"));
}

TEST(Recording, ReportsChangeThatCannotBeUndone) {
  const TemporaryFolder folder;
  const auto path = RecordingOfAKilledProgram(folder.Path());
  EXPECT_THAT(InputErrorOf([&] { sqlite::OpenRecording(path, SQLITE_OPEN_READONLY); }),
              HasSubstr("killed.sqmap: a program was killed while it changed this file"));
}

TEST(Recording, KeepsSnapshotsWhenDiskIsFull) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  rlimit old_limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  std::string message;
  int next = 1;
  {
    RecordingWriter writer(path, {});
    writer.Add(MakeSnapshot(0));
    const rlimit limit{200000, old_limit.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
    message = InputErrorOf([&] {
      for (; next < 1000; ++next) {
        writer.Add(MakeSnapshot(next, 5000));
      }
    });
    setrlimit(RLIMIT_FSIZE, &old_limit);
    writer.Add(MakeSnapshot(next, 100));  // there is room again
  }
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(message, HasSubstr("map.sqmap: "));
  const RecordingReader reader(path);
  ASSERT_EQ(reader.Size(), next + 1);
  for (int i = 0; i <= next; ++i) {
    EXPECT_EQ(reader.Read(i)->sequence_number, i);
  }
}

TEST(Recording, ListsFramesWithoutReadingSnapshots) {
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

TEST(Recording, ReportsMissingSnapshots) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "map.sqmap";
  RecordingWriter(path, {}).Close();
  EXPECT_THAT(InputErrorOf([&] { RecordingReader(path).Last(); }),
              HasSubstr("map.sqmap: contains no snapshot"));
}

TEST(Recording, RefusesOtherFiles) {
  const TemporaryFolder folder;
  EXPECT_THAT(InputErrorOf([&] { RecordingReader(folder.Path() / "none"); }), HasSubstr("does not exist"));
  const auto text = folder.Write("a.sqmap",
                                 "words, and more of them than a header takes................"
                                 "..............................................................");
  EXPECT_THAT(InputErrorOf([&] { RecordingReader reader(text); }), HasSubstr("is not a recording of a map"));
  EXPECT_THAT(InputErrorOf([&] { RecordingReader reader(folder.Write("b.sqmap", "")); }),
              HasSubstr("is not a recording"));
}

}  // namespace
}  // namespace sqslam
