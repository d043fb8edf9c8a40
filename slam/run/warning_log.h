#pragma once

#include <memory>
#include <string>
#include <vector>

namespace sqslam {

// Collects the warnings that the program logs during its lifetime, if the program's logger allows it (a sink
// of sinks, as app/terminal makes it).
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
