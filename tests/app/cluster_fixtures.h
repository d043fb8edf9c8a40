#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "tests/app/run_program.h"
#include "tests/app/tiny_experiment.h"

namespace sqslam::testing {

// Two runs of a tiny film, made at home or handed to what `before` sets up as Slurm.
class ClusterTest : public ::testing::Test {
 protected:
  ClusterTest() {
    folder_.Write("tiny.yaml", kScene);
    folder_.Write("e.yaml", std::string(kExperiment) + "jobs: 2\nslurm: {poll: 0.2, retries: 1}\n");
  }

  ProgramRun Run(const std::string& options, const std::string& output = "out") const {
    return RunProgram(Command(options, output), Before());
  }
  std::string Command(const std::string& options, const std::string& output = "out") const {
    return "experiment " + (folder_.Path() / "e.yaml").string() + " --output " +
           (folder_.Path() / output).string() + " " + options;
  }
  virtual std::string Before() const = 0;
  std::filesystem::path Output() const { return folder_.Path() / "out"; }
  std::string Tables(const std::string& output, const std::string& number) const {
    return Slurp(folder_.Path() / output / ("table-" + number + ".csv"));
  }
  bool WaitFor(const std::filesystem::path& file) const {
    for (int i = 0; i < 600 && !std::filesystem::exists(file); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return std::filesystem::exists(file);
  }

  // Holds on any cluster: the tables are those of home, from tasks that say where they were made.
  void ExpectTheTablesOfHome() const {
    const ProgramRun home = Run("", "home");
    EXPECT_EQ(home.exit_code, 0) << home.err;
    for (const char* number : {"1", "2", "3"}) {
      EXPECT_EQ(Tables("out", number), Tables("home", number));
    }
    const auto stats =
        nlohmann::json::parse(Slurp(Output() / "runs/tiny-superquadric-full-refined-1/stats.json"));
    EXPECT_THAT(stats.at("job").get<std::string>(), ::testing::HasSubstr("_0"));
    EXPECT_NE(stats.at("host"), "");
    EXPECT_NE(stats.at("version"), "");
    EXPECT_THAT(stats.at("command").get<std::string>(),
                ::testing::HasSubstr("/out/runs/tiny-superquadric-full-refined-1 "));
    const auto at_home =
        nlohmann::json::parse(Slurp(folder_.Path() / "home/runs/tiny-quadric-full-refined-1/stats.json"));
    EXPECT_EQ(at_home.at("job"), "");
    for (const auto& entry : std::filesystem::directory_iterator(Output() / "runs")) {
      EXPECT_FALSE(entry.path().filename().string().starts_with('.')) << entry.path();
    }
  }

  TemporaryFolder folder_;
};

// sbatch and squeue as files of the shell: the tasks of a job run one after the other, and those that `lost`
// names are never begun.
class StandIn : public ClusterTest {
 protected:
  StandIn() {
    folder_.Write("bin/sbatch", R"sh(#!/bin/bash
cd "$(dirname "$0")/.."
if [ -e refuse ]; then echo 'sbatch: error: invalid partition specified: none' >&2; exit 1; fi
echo job >>jobs
number=$(wc -l <jobs)
cp "${@: -1}" job$number.sh
name=$(sed -n 's/^#SBATCH --job-name=//p' job$number.sh)
last=$(sed -n 's/^#SBATCH --array=0-\([0-9]*\)%.*/\1/p' job$number.sh)
after=$(echo "$@" | sed -n 's/.*afterany:\([0-9]*\).*/\1/p')
mkdir -p queue
for k in $(seq 0 ${last:-0}); do touch queue/$number,$name,$k; done
(
  for fd in $(ls /proc/$BASHPID/fd); do if [ $fd -gt 2 ]; then eval "exec $fd>&-"; fi; done
  while [ -n "$after" ] && ls queue/$after,* >/dev/null 2>&1; do sleep 0.1; done
  while [ -e hold ]; do sleep 0.1; done
  for k in $(seq 0 ${last:-0}); do
    if [ -e lost ] && [ "$(cat lost)" = $number,$k ]; then rm -f queue/$number,$name,$k; continue; fi
    export SLURM_JOB_ID=$number
    if [ -n "$last" ]; then export SLURM_ARRAY_JOB_ID=$number SLURM_ARRAY_TASK_ID=$k; fi
    bash job$number.sh >>task.log 2>&1
    rm -f queue/$number,$name,$k
  done
) >/dev/null 2>&1 &
echo $number
echo 'sbatch: warning: this cluster is down on Monday' >&2
)sh");
    folder_.Write("bin/squeue", R"sh(#!/bin/bash
cd "$(dirname "$0")/.."
name=$(echo "$@" | sed 's/.*-n \([^ ]*\).*/\1/')
echo 'squeue: warning: slow today' >&2
for task in queue/*,$name,*; do if [ -e "$task" ]; then basename "$task" | cut -d, -f1; fi; done
exit 0
)sh");
    std::filesystem::permissions(folder_.Path() / "bin/sbatch", std::filesystem::perms::owner_all);
    std::filesystem::permissions(folder_.Path() / "bin/squeue", std::filesystem::perms::owner_all);
  }
  ~StandIn() override {  // its tasks write into the folder
    std::filesystem::remove(folder_.Path() / "hold");
    while (std::filesystem::exists(folder_.Path() / "queue") &&
           !std::filesystem::is_empty(folder_.Path() / "queue")) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  std::string Before() const override {
    return "unset SLURM_JOB_ID SLURM_ARRAY_JOB_ID; export PATH=" + (folder_.Path() / "bin").string() +
           ":$PATH";
  }
  std::size_t Jobs() const { return Slurp(folder_.Path() / "jobs").size() / 4; }
};

// A real cluster of this machine alone.
class RealSlurm : public ClusterTest {
 protected:
  static constexpr const char* kScript = SQSLAM_SOURCE_DIR "/scripts/local-slurm.sh ";

  void SetUp() override {
    if (::getuid() != 0) {
      GTEST_SKIP() << "only root can start a Slurm cluster; a stand-in was tried in its place";
    }
    if (std::system("command -v slurmctld slurmd sbatch munged >/dev/null") != 0) {
      GTEST_SKIP()
          << "no Slurm here (slurmctld, slurmd, slurm-client, munge); a stand-in was tried in its place";
    }
    started_ = std::system((Before() + "; " + kScript + "start " + Cluster().string()).c_str()) == 0;
    ASSERT_TRUE(started_) << Slurp(Cluster() / "slurmctld.log");
  }
  void TearDown() override {
    if (started_) {
      EXPECT_EQ(std::system((std::string(kScript) + "stop " + Cluster().string()).c_str()), 0);
    }
  }
  std::filesystem::path Cluster() const { return folder_.Path() / "cluster"; }
  std::string Before() const override {
    return "export SLURM_CONF=" + (Cluster() / "slurm.conf").string() +
           " SLURM_PORT=" + std::to_string(20000 + 2 * (::getpid() % 5000));
  }

  bool started_ = false;
};

}  // namespace sqslam::testing
