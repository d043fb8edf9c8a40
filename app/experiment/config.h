#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "app/cluster/slurm.h"
#include "slam/io/frame_source.h"

namespace sqslam::app {

// One input of an experiment: a sequence on disk, or a scene that is rendered first.
struct ExperimentSequence {
  std::string name;    // default: name of the folder or scene
  std::string path;    // sequence folder, as for `sqslam run`; empty if there is a scene
  std::string scene;   // scene description, as for `sqslam synth`
  std::string format;  // as for `sqslam run`; empty: its default
  std::string camera;
  std::string detections;
  bool evaluate = true;  // against the ground truth of the folder; false: only times and counts
  std::int64_t start = 0;
  std::string frames;  // N or A:B, see ParseFrameRange; empty: all
  std::int64_t stride = 1;
  std::vector<std::string> set;  // options for this sequence, key=value

  void VisitFields(auto&& visit) {
    visit("name", name);
    visit("path", path);
    visit("scene", scene);
    visit("format", format);
    visit("camera", camera);
    visit("detections", detections);
    visit("evaluate", evaluate);
    visit("start", start, std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
    visit("frames", frames);
    visit("stride", stride, std::int64_t{1}, std::numeric_limits<std::int64_t>::max());
    visit("set", set);
  }
};

// Throws UsageError if `frames` is not a range.
FrameRange FramesOf(const ExperimentSequence& sequence);

// Named options, to compare settings that have no axis of their own.
struct ExperimentVariant {
  std::string name;  // empty: the defaults
  std::vector<std::string> set;

  void VisitFields(auto&& visit) {
    visit("name", name);
    visit("set", set);
  }
};

inline constexpr int kAllObjects = -1;

// Every combination of these is one cell of the experiment.
struct ExperimentGrid {
  std::vector<std::string> sequences;  // names
  std::vector<std::string> variants;   // names; "default" is the unnamed one
  std::vector<std::string> representations;
  std::vector<std::string> associations;
  std::vector<std::string> methods;
  std::vector<std::string> max_objects = {"all"};  // numbers of objects whose boxes are used
  int repetitions = 1;

  void VisitFields(auto&& visit) {
    visit("sequences", sequences);
    visit("variants", variants);
    VisitAxes(visit);
  }
  void VisitAxes(auto&& visit) {  // those that the whole experiment may set too
    visit("representations", representations);
    visit("associations", associations);
    visit("methods", methods);
    visit("max_objects", max_objects);
    visit("repetitions", repetitions, 1, 1000000);
  }
};

// Returns the number in a word of max_objects; nothing for other words. "all" is kAllObjects.
std::optional<int> ObjectLimit(const std::string& word);

struct ExperimentConfig {
  std::filesystem::path folder;  // of the file; paths in it may be relative to it
  std::string output;            // default: out/NAME of the file
  std::string options;           // pipeline options, as for `sqslam run --config`
  bool deterministic = false;
  std::int64_t seed = 1;             // of the first repetition; each further one adds 1
  int jobs = 1;                      // parallel runs; measured times are only good with 1
  SlurmOptions slurm;                // with --on slurm
  std::vector<std::string> objects;  // names or labels that get rows of their own in Table I
  std::vector<ExperimentSequence> sequences;
  std::vector<ExperimentVariant> variants;  // the first is unnamed: the defaults
  ExperimentGrid common;                    // values for grids that do not say otherwise
  std::vector<ExperimentGrid> grids;

  void VisitFields(auto&& visit) {  // sequences, variants and grids are read apart
    common.VisitAxes(visit);
    visit("output", output);
    visit("config", options);
    visit("deterministic", deterministic);
    visit("seed", seed, std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
    visit("jobs", jobs, 1, 1000000);
    visit("objects", objects);
    visit("slurm", slurm);
  }
};

// Reads and checks a configuration, including pipeline options in `set`. Throws UsageError with file and
// line, and with the nearest valid name for an unknown key or word.
ExperimentConfig ReadExperiment(const std::filesystem::path& path);
ExperimentConfig ParseExperiment(const std::string& yaml, const std::string& source);

// Resolves a path of the configuration against the current folder, the folder of the file, and the data of
// the program, in this order; returns it unchanged if none has it.
std::filesystem::path ResolvePath(const ExperimentConfig& config, const std::filesystem::path& path);

}  // namespace sqslam::app
