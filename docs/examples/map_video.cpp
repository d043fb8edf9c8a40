// Maps a film, a folder of images or a sequence, and prints the objects: map_video INPUT RESULT

#include <iostream>

#include "slam/run/run_pipeline.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: map_video INPUT RESULT\n";
    return 2;
  }
  sqslam::RunRequest request;
  request.sequence.path = argv[1];
  request.output = argv[2];              // a new folder
  request.options.deterministic = true;  // the same bytes every time
  try {
    sqslam::RunHost host;  // a class of your own shows progress, or stops the run
    const sqslam::FinishedRun run = sqslam::RunPipeline(request, host);
    std::cout << run.stats.tracked << " of " << run.stats.frames << " frames\n";
    for (const sqslam::SnapshotObject& object : run.result.map.snapshot->objects) {
      const auto& [shape, T_map_object] = object.superquadric;
      std::cout << object.id << ' ' << object.label << " at " << T_map_object.translation.transpose()
                << ", half size " << shape.half_size.transpose() << ", exponents " << shape.e1 << ' '
                << shape.e2 << '\n';
    }
  } catch (const std::exception& error) {  // InputError, UsageError, NoMapError: slam/util/error.h
    std::cerr << error.what() << '\n';
    return 1;
  }
}
