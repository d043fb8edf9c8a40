#pragma once

#include <utility>

namespace sqslam::viewer {

// A value with a version that rises whenever it is set, so that whoever shows it can tell that it is another
// one.
template <typename T>
class Observed {
 public:
  Observed() = default;
  Observed(const Observed&) = default;
  Observed& operator=(const Observed& other) {
    Set(other.value_);
    return *this;
  }

  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }
  int Version() const { return version_; }

  void Set(T value) {
    value_ = std::move(value);
    ++version_;
  }
  // Changes it in place: change(T&).
  template <typename Change>
  void Update(Change change) {
    change(value_);
    ++version_;
  }

 private:
  T value_{};
  int version_ = 0;
};

// Remembers the version of an observed value that was shown last.
class ShownVersion {
 public:
  // True if the value is another one than at the last call.
  template <typename T>
  bool Misses(const Observed<T>& value) {
    return std::exchange(version_, value.Version()) != value.Version();
  }

 private:
  int version_ = -1;
};

}  // namespace sqslam::viewer
