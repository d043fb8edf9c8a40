#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"

namespace sqslam {

// Checks a video before it is mapped: samples of its frames, each compared with the next ones.
struct InspectionOptions {
  double sample_interval = 0.25;  // seconds between samples; all frames are samples if they are farther apart
  int keypoints = 500;            // extracted in each sample
  // A sample is reported if
  double max_blur = 0.6;      // its blur (BlurOf, 0 sharp to 1) is higher
  double min_coverage = 0.3;  // keypoints lie in a smaller share of an 8x6 grid's cells
  double max_clipped = 0.4;   // a larger share of its pixels is black or white
  double min_shared = 0.12;   // a smaller share of its keypoints is found in the next frame
  double min_kept = 0.02;     // a smaller share of its keypoints is found in the next sample
  double min_flow = 0.002;    // keypoints move by fewer image widths per second: the camera stands still
  double max_turning = 0.04;  // less of the motion differs from pure rotation: the camera only turns
  double max_turn = 0.7;      // image widths; a longer turn leaves no mapped point in the image
  double min_trouble = 1.0;   // seconds; shorter trouble is not reported

  void VisitFields(auto&& visit) {
    visit("sample_interval", sample_interval, 0.01, 10.0);
    visit("keypoints", keypoints, 100, 10000);
    visit("max_blur", max_blur, 0.0, 1.0);
    visit("min_coverage", min_coverage, 0.0, 1.0);
    visit("max_clipped", max_clipped, 0.0, 1.0);
    visit("min_shared", min_shared, 0.0, 1.0);
    visit("min_kept", min_kept, 0.0, 1.0);
    visit("max_turn", max_turn, 0.0, 100.0);
    visit("min_flow", min_flow, 0.0, 1.0);
    visit("max_turning", max_turning, 0.0, 1.0);
    visit("min_trouble", min_trouble, 0.0, 100.0);
  }
};

// Reasons why a part of a video cannot be mapped. A sample has the first that applies.
enum class FilmTrouble { kExposure, kBlur, kTexture, kStandstill, kTurning, kJump };
constexpr auto EnumNames(FilmTrouble) {
  return std::array{"exposure", "blur", "texture", "standstill", "turning", "jump"};
}

// One sample.
struct FilmMoment {
  std::int64_t frame = 0;
  double seconds = 0.0;   // since the first sample
  double clipped = 0.0;   // share of pixels that are black or white
  double blur = 0.0;      // BlurOf
  double coverage = 0.0;  // share of an 8x6 grid's cells with keypoints
  double shared = 1.0;    // share of the keypoints found in the next frame
  double kept = 1.0;      // share of the keypoints found in the next sample
  double flow = 0.0;      // median motion of keypoints to the next sample, image widths per second
  double sideways = 0.0;  // share of the motion over two intervals that no pure rotation explains
  int things = -1;        // objects found by the detector; -1: it did not run
};

struct FilmFinding {
  FilmTrouble trouble;
  double begin = 0.0;  // seconds since the first sample
  double end = 0.0;
  bool breaks = false;  // tracking is lost; otherwise the map only does not grow
};

struct FilmInspection {
  std::vector<FilmMoment> moments;
  std::vector<FilmFinding> findings;  // in the order of time
  double seconds = 0.0;               // from the first to the last sample
  double moving = 0.0;                // seconds of sideways motion without trouble
  double longest = 0.0;               // seconds of the longest part without a break of tracking
  std::optional<double> mapped;       // share of the frames that a trial run mapped
  double skew = 0.0;                  // 95 % quantile of the motion in 20 ms, share of the image's width

  // Returns true if most of the video can be expected in one map: by the trial run, or else by the samples.
  bool IsFit() const;
};

// Returns the perceptual blur of an 8UC1 image, 0 (sharp) to 1: the share of the differences between
// neighbouring pixels that another blur would preserve (Crété-Roffet et al. 2007, The blur effect).
double BlurOf(const cv::Mat& gray);

// Returns the number of objects in an image (8UC3).
using ThingCounter = std::function<int(const cv::Mat& bgr)>;
// Called after each sample; false ends the inspection, which then holds the samples so far and no findings.
using InspectionProgress = std::function<bool(std::int64_t done, std::int64_t total)>;

// Inspects the frames of the range; `count` (may be null) runs on eight of them. Throws InputError if fewer
// than three can be read.
FilmInspection InspectFilm(const Sequence& sequence, const FrameRange& range,
                           const InspectionOptions& options, const ThingCounter& count = nullptr,
                           const InspectionProgress& progress = nullptr);

// Returns "0:12 to 0:19  the camera turns on the spot: walk sideways there".
std::string InWords(const FilmFinding& finding);

}  // namespace sqslam
