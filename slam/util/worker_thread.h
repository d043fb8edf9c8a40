#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace sqslam {

// A thread that does jobs in order. At most `capacity` jobs wait, so that a fast producer cannot fill the
// memory. An error stops the thread and drops waiting jobs. The destructor completes waiting jobs.
template <typename Job>
class WorkerThread {
 public:
  WorkerThread(std::size_t capacity, std::function<void(Job&)> work)
      : capacity_(capacity), work_(std::move(work)), thread_([this] { Run(); }) {}
  ~WorkerThread() { Join(); }
  WorkerThread(const WorkerThread&) = delete;
  WorkerThread& operator=(const WorkerThread&) = delete;

  // Waits for room. Returns false, with the job dropped, after an error and after Finish().
  bool Offer(Job job) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return jobs_.size() < capacity_ || failure_ || closed_; });
    if (failure_ || closed_) {
      return false;
    }
    jobs_.push_back(std::move(job));
    changed_.notify_all();
    return true;
  }

  // Same, but rethrows the error that ended the work.
  void Add(Job job) {
    if (!Offer(std::move(job))) {
      Finish();
    }
  }

  // Waits until all jobs are done. Rethrows the error that ended the work.
  void Finish() {
    Join();
    if (failure_) {
      std::rethrow_exception(failure_);
    }
  }

  bool Failed() const {
    const std::lock_guard lock(mutex_);
    return failure_ != nullptr;
  }

 private:
  void Join() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
      changed_.notify_all();
    }
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  void Run() {
    try {
      for (;;) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !jobs_.empty() || closed_; });
        if (jobs_.empty()) {
          return;
        }
        Job job = std::move(jobs_.front());
        jobs_.pop_front();
        changed_.notify_all();
        lock.unlock();
        work_(job);
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      changed_.notify_all();
    }
  }

  const std::size_t capacity_;
  const std::function<void(Job&)> work_;
  mutable std::mutex mutex_;  // guards the following
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool closed_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // last: uses the other members
};

}  // namespace sqslam
