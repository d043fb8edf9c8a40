#include "slam/util/file_lock.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "slam/util/host.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

TEST(FileLock, AdmitsOneHolder) {
  const TemporaryFolder folder;
  {
    const auto lock = FileLock::Try(folder.Path() / "lock");
    ASSERT_TRUE(lock);
    EXPECT_FALSE(FileLock::Try(folder.Path() / "lock"));
    EXPECT_FALSE(FileLock::Wait(folder.Path() / "lock", [] { return true; }));
  }
  EXPECT_TRUE(FileLock::Try(folder.Path() / "lock"));
  EXPECT_THROW(FileLock::Try(folder.Path() / "none" / "lock"), InputError);
}

TEST(FileLock, ReleasesWhenHolderIsKilled) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "lock";
  const pid_t holder = ::fork();
  if (holder == 0) {
    const auto lock = FileLock::Wait(path, [] { return false; });
    ::pause();
  }
  while (!std::filesystem::exists(path) || FileLock::Try(path)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ::kill(holder, SIGKILL);
  ::waitpid(holder, nullptr, 0);
  EXPECT_TRUE(FileLock::Try(path));
}

TEST(SlurmJob, NamesTaskOfArray) {
  ::setenv("SLURM_JOB_ID", "18", 1);
  EXPECT_EQ(SlurmJob(), "18");
  ::setenv("SLURM_ARRAY_JOB_ID", "17", 1);
  ::setenv("SLURM_ARRAY_TASK_ID", "3", 1);
  EXPECT_EQ(SlurmJob(), "17_3");
  for (const char* name : {"SLURM_JOB_ID", "SLURM_ARRAY_JOB_ID", "SLURM_ARRAY_TASK_ID"}) {
    ::unsetenv(name);
  }
  EXPECT_EQ(SlurmJob(), "");
}

}  // namespace
}  // namespace sqslam
