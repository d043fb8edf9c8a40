#pragma once

#include <memory>
#include <string>
#include <vector>

namespace sqslam {

// Takes down the warnings that the program gives as long as it lives, if the program's log passes them on
// (a sink of sinks, as app/terminal makes it).
class WarningLog {
 public:
  WarningLog();
  ~WarningLog();
  WarningLog(const WarningLog&) = delete;
  WarningLog& operator=(const WarningLog&) = delete;

  std::vector<std::string> Lines() const;  // each once, in the order in which they came

 private:
  class Sink;
  std::shared_ptr<Sink> sink_;
};

}  // namespace sqslam
