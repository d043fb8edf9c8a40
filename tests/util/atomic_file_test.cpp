#include "slam/util/atomic_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::vector<std::string> FileNames(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  return names;
}

// The id of a process that has ended.
int DeadProcess() {
  const int child = ::fork();
  if (child == 0) {
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  return child;
}

TEST(AtomicFile, ReplacesFileAndLeavesNothingElse) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder.Path() / "a.txt", "old");
  WriteFileAtomically(folder.Path() / "a.txt", "new");
  EXPECT_EQ(ReadFile(folder.Path() / "a.txt", ""), "new");
  EXPECT_THAT(FileNames(folder.Path()), ::testing::ElementsAre("a.txt"));
}

TEST(AtomicFile, ReportsFullDiskAndKeepsOldFile) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder.Path() / "a.txt", "old");
  rlimit old_limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{1000, old_limit.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limit);
  const std::string message =
      InputErrorOf([&] { WriteFileAtomically(folder.Path() / "a.txt", std::string(5000, 'x')); });
  setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(message, HasSubstr("a.txt: cannot be written (File too large)"));
  EXPECT_EQ(ReadFile(folder.Path() / "a.txt", ""), "old");
  EXPECT_THAT(FileNames(folder.Path()), ::testing::ElementsAre("a.txt"));
}

TEST(AtomicPath, UncommittedFileLeavesNothing) {
  const TemporaryFolder folder;
  {
    const AtomicPath path(folder.Path() / "map.png");
    EXPECT_EQ(path.Path().extension(), ".png");
    WriteFileAtomically(path.Path(), "half");
  }
  EXPECT_TRUE(fs::is_empty(folder.Path()));
}

TEST(AtomicPath, CommitNewReplacesNothing) {
  const TemporaryFolder folder;
  const fs::path path = folder.Write("map.bin", "of another program");
  {
    AtomicPath draft(path);
    folder.Write(draft.Path().filename(), "ours");
    EXPECT_THROW(draft.CommitNew(), InputError);
  }
  EXPECT_EQ(ReadFile(path, ""), "of another program");
  {
    AtomicPath draft(folder.Path() / "new.bin");
    folder.Write(draft.Path().filename(), "ours");
    draft.CommitNew();
  }
  EXPECT_EQ(ReadFile(folder.Path() / "new.bin", ""), "ours");
  EXPECT_THAT(FileNames(folder.Path()), ::testing::UnorderedElementsAre("map.bin", "new.bin"));
}

TEST(ResultFolder, CreatesFolderButNeverOverwrites) {
  const TemporaryFolder folder;
  CreateResultFolder(folder.Path() / "a" / "b");
  EXPECT_TRUE(fs::is_directory(folder.Path() / "a" / "b"));
  EXPECT_NO_THROW(CreateResultFolder(folder.Path() / "a" / "b"));  // empty: nothing to lose
  EXPECT_THROW(CreateResultFolder(folder.Path() / "a"), UsageError);
  folder.Write("file", "x");
  EXPECT_THROW(CreateResultFolder(folder.Path() / "file"), UsageError);
  EXPECT_THROW(CreateResultFolder(folder.Path() / "file" / "below"), InputError);
  EXPECT_EQ(UnusedResultFolder(folder.Path(), "a").filename(), "a-2");
  EXPECT_EQ(UnusedResultFolder(folder.Path(), "new").filename(), "new");
}

TEST(AtomicPath, RemovesLeftoversOfKilledPrograms) {
  const TemporaryFolder folder;
  const fs::path own = AtomicPath(folder.Path() / "film.mp4").Path();
  const auto name_of = [&](const char* stem, int process) {
    std::string name = own.filename().string();
    name.replace(0, std::string(".film").size(), stem);
    return name.replace(name.find(std::to_string(::getpid())), std::to_string(::getpid()).size(),
                        std::to_string(process));
  };
  const fs::path left = folder.Write(name_of(".film", DeadProcess()), "half");
  const fs::path other = folder.Write(name_of(".tour", DeadProcess()), "half");
  const fs::path alive = folder.Write(name_of(".film", ::getppid()), "half");
  const AtomicPath film(folder.Path() / "film.mp4");
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(other));
  EXPECT_TRUE(fs::exists(alive));
}

}  // namespace
}  // namespace sqslam
