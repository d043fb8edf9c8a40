#pragma once

#include <filesystem>
#include <string>

#include "slam/run/run_host.h"

namespace sqslam::app {

struct ReportInputs {
  std::filesystem::path result;  // result folder; report.html is written into it
  std::string title;             // empty: the name of the sequence, or of the result folder
  std::string sequence;          // what was mapped, as shown under the title; empty: as the recording says
  std::filesystem::path
      video;  // embedded where it is smaller than 8 MiB; empty: growth.mp4 or map.mp4 if there
  const FinishedRun* run = nullptr;  // the run that was just made: its values instead of its files
};

// One self-contained page from what lies in the result folder: figures of the run, map.png, top view of
// trajectory and objects, tables of objects and of times, figures/*.png, all embedded. A file that is missing
// leaves its section out. Throws InputError where a file is broken or the page cannot be written.
void WriteReport(const ReportInputs& inputs);

}  // namespace sqslam::app
