#include "app/cluster/array_work.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <set>
#include <thread>

#include "app/terminal/terminal.h"
#include "slam/util/atomic_file.h"
#include "slam/util/host.h"
#include "slam/util/json_file.h"
#include "slam/util/stopwatch.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
using Words = std::vector<std::string>;
namespace {

constexpr std::size_t kMaxTasks = 1000;  // per array: the limit of Slurm's default MaxArraySize

// Number of submissions of each task.
using Attempts = std::map<std::string, int>;

Attempts ReadAttempts(const fs::path& path) {
  try {
    return ReadJsonFile(path, "counts of tasks").at("attempts").get<Attempts>();
  } catch (const std::exception&) {  // missing, or not written by us
    return {};
  }
}

void WriteAttempts(const fs::path& path, const Attempts& attempts) {
  WriteJsonFile(path,
                nlohmann::ordered_json{{"format", "sqslam-tasks"}, {"version", 1}, {"attempts", attempts}});
}

// Waits until the queue is to be asked again, or until every task has its result. Looking for results is
// cheaper than asking the cluster's one controller and happens more often, but for at most a twentieth of the
// time: a thousand names on NFS take a while.
void WaitForResults(const ArrayWork& work, double seconds, const std::function<bool()>& stop) {
  const Stopwatch waited;
  double next_look = 0.1;
  while (!stop() && waited.Seconds() < seconds) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    if (waited.Seconds() < next_look) {
      continue;
    }
    const Stopwatch look;
    if (work.unfinished().empty()) {
      return;
    }
    next_look = waited.Seconds() + std::max(0.1, 20.0 * look.Seconds());
  }
}

// The Slurm jobs of one ArrayWork.
class ArrayJobs {
 public:
  ArrayJobs(const ArrayWork& work, const SlurmOptions& options)
      : work_(work), options_(options), name_(JobName(work.title, work.folder)) {}

  const std::string& Name() const { return name_; }

  // Returns the ids of the queued jobs; empty if Slurm stops answering. Throws if it never answered.
  std::optional<Words> Queued() {
    std::string problem;
    std::optional<Words> jobs = QueuedJobs(name_, problem);
    if (!jobs && !answered_) {
      throw InputError("{}, expected a Slurm cluster here", problem);
    }
    if (!jobs && !warned_) {
      spdlog::warn("{}; retrying every {:g} s", problem, options_.poll);
    }
    warned_ = !jobs;
    answered_ = true;
    return jobs;
  }

  std::string Submit(const Words& words) const {
    return SubmitJob(Script("job.sh", {name_, work_.folder, words, work_.at_once, work_.command}));
  }

  // Submits a job for --task end that waits for `jobs`, unless there is one already.
  void SubmitEnd(Words jobs) const {
    std::string problem;
    const std::string name = name_ + "-end";
    const std::optional<Words> waiting = QueuedJobs(name, problem);
    const std::string own = SlurmJob();
    if (waiting && std::ranges::any_of(*waiting, [&](const std::string& job) { return job != own; })) {
      return;
    }
    std::ranges::sort(jobs);
    jobs.erase(std::ranges::unique(jobs).begin(), jobs.end());
    SubmitJob(Script("end.sh", {name, work_.folder, {kLastTask}, 1, work_.command}), jobs);
  }

 private:
  fs::path Script(const char* file, const SlurmJobText& job) const {
    WriteFileAtomically(work_.folder / file, JobScript(job, options_));
    return work_.folder / file;
  }

  const ArrayWork& work_;
  const SlurmOptions& options_;
  std::string name_;
  bool answered_ = false;
  bool warned_ = false;
};

// Returns the tasks with attempts left, at most as many as fit in one array.
Words NextTasks(const Words& unfinished, const Attempts& attempts, int retries) {
  Words next;
  for (const std::string& word : unfinished) {
    const auto made = attempts.find(word);
    if ((made == attempts.end() || made->second <= retries) && next.size() < kMaxTasks) {
      next.push_back(word);
    }
  }
  return next;
}

// Prints the recorded failures that are not in `reported`, and adds them to it.
void PrintFailures(const ArrayWork& work, const Words& unfinished, std::set<std::string>& reported,
                   const std::function<void(const std::string&)>& print) {
  for (const std::string& word : unfinished) {
    if (fs::exists(work.failure(word)) && reported.insert(word).second) {
      print(fmt::format("{}: FAILED: {}", word, ReadTaskFailure(work.failure(word)).message));
    }
  }
}

}  // namespace

TaskEnd ReadTaskFailure(const fs::path& path) {
  try {
    const auto record = ReadJsonFile(path, "a failed task");
    return {record.at("exit_code").get<int>(), record.at("message").get<std::string>()};
  } catch (const std::exception&) {  // missing or incomplete
    return {3, "ended without a result: killed, out of time or memory, or never begun"};
  }
}

int RunArrayTask(const std::string& name, const fs::path& failure, const SlurmOptions& options,
                 const std::function<TaskEnd()>& work) {
  TaskEnd end;
  const auto guarded = [&] {
    const char* restarts = std::getenv("SLURM_RESTART_COUNT");
    ThrowIf<InputError>(restarts != nullptr && ParseNumber<int>(restarts).value_or(0) > options.retries,
                        "requeued more than {} times", options.retries);
    end = work();
    return end.exit_code;
  };
  end.exit_code = ExitCodeOf(guarded, [&](const std::string& error) { end.message = error; });
  if (!end.message.empty()) {
    WriteJsonFile(failure, nlohmann::ordered_json{{"exit_code", end.exit_code},
                                                  {"message", end.message},
                                                  {"host", HostName()},
                                                  {"job", SlurmJob()}});
    PrintNotice(fmt::format("sqslam: {} failed: {}", name, end.message));
  }
  return end.exit_code;
}

ArrayEnd FollowArray(const ArrayWork& work, const SlurmOptions& options, const ArrayCall& call,
                     const std::function<bool()>& stop,
                     const std::function<void(const std::string&)>& print) {
  fs::create_directories(work.folder);
  const fs::path counts = work.folder / "tasks.json";
  ArrayJobs jobs(work, options);
  Attempts attempts = ReadAttempts(counts);
  std::set<std::string> reported;  // words whose failure is printed
  if (work.unfinished().empty()) {
    return ArrayEnd::kEnded;  // before Slurm is needed
  }
  for (bool first = true; !stop(); first = false) {
    const std::optional<Words> queued = jobs.Queued();
    const Words unfinished = work.unfinished();  // after the queue: tasks that left it have written results
    if (unfinished.empty()) {
      return ArrayEnd::kEnded;
    }
    PrintFailures(work, unfinished, reported, print);
    if (queued && queued->empty()) {
      if (first && !call.last_job) {
        attempts.clear();
      }
      const Words next = NextTasks(unfinished, attempts, options.retries);
      if (next.empty()) {
        return ArrayEnd::kEnded;
      }
      for (const std::string& word : next) {
        ++attempts[word];
        reported.erase(word);
        fs::remove(work.failure(word));
      }
      std::ranges::for_each(work.results, RemoveTemporaryFiles);
      WriteAttempts(counts, attempts);
      const std::string job = jobs.Submit(next);
      print(fmt::format("job {} of {} {} handed to Slurm", job, next.size(),
                        next.size() == 1 ? "task" : "tasks"));
      if (call.submit_only) {
        jobs.SubmitEnd({job});
        return ArrayEnd::kSubmitted;
      }
    } else if (queued && first) {
      print(fmt::format("{} tasks of {} are in the queue", queued->size(), jobs.Name()));
      if (call.submit_only) {
        jobs.SubmitEnd(*queued);
        return ArrayEnd::kSubmitted;
      }
    }
    WaitForResults(work, options.poll, stop);
  }
  spdlog::info("the tasks stay in the queue; scancel -n {} removes them", jobs.Name());
  return ArrayEnd::kStopped;
}

Words ArgumentsWithoutTask() {
  Words words = CommandWords();
  words.erase(words.begin());
  if (words.size() >= 2 && words[words.size() - 2] == "--task") {
    words.resize(words.size() - 2);
  }
  return words;
}

}  // namespace sqslam::app
