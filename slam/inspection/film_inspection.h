#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"

namespace sqslam {

// Looks through a film before it is mapped: a sample of its frames, each held against the next ones.
struct InspectionOptions {
  double sample_interval = 0.25;  // seconds between samples; frames that are farther apart are all looked at
  int keypoints = 500;            // number looked for in each
  // A sample is in trouble where
  double max_blur = 0.6;      // its blur (BlurOf, 0 sharp to 1) is above
  double min_coverage = 0.3;  // keypoints lie in a smaller share of an 8x6 grid's cells
  double max_clipped = 0.4;   // a larger share of its pixels is black or white
  double min_shared = 0.12;   // a smaller share of its keypoints is found again in the next frame
  double min_kept = 0.02;     // a smaller share of them in the next sample
  double min_flow = 0.002;    // keypoints move by fewer image widths a second: the camera stands still
  double max_turning = 0.04;  // a smaller share of the motion is no pure rotation: the camera only turns
  double max_turn = 0.7;      // image widths: after a longer turn nothing known is left in the picture
  double min_trouble = 1.0;   // seconds that trouble lasts before it is told

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

// Trouble that keeps a film from being mapped, in the order in which one hides another.
enum class FilmTrouble { kExposure, kBlur, kTexture, kStandstill, kTurning, kJump };
constexpr auto EnumNames(FilmTrouble) {
  return std::array{"exposure", "blur", "texture", "standstill", "turning", "jump"};
}

// One sample.
struct FilmMoment {
  std::int64_t frame = 0;
  double seconds = 0.0;   // since the first
  double clipped = 0.0;   // share of pixels that are black or white
  double blur = 0.0;      // BlurOf
  double coverage = 0.0;  // share of an 8x6 grid's cells with keypoints
  double shared = 1.0;    // share of the keypoints that the next frame has too
  double kept = 1.0;      // share of them that the next sample has
  double flow = 0.0;      // median motion of keypoints to the next sample, image widths a second
  double sideways = 0.0;  // share of the motion over two intervals that no pure rotation explains
  int things = -1;        // found by the detector; -1: not looked for
};

struct FilmFinding {
  FilmTrouble trouble;
  double begin = 0.0;  // seconds since the first frame
  double end = 0.0;
  bool breaks = false;  // tracking off; else the map just does not grow
};

struct FilmInspection {
  std::vector<FilmMoment> moments;
  std::vector<FilmFinding> findings;  // in the order of time
  double seconds = 0.0;               // that the film lasts
  double moving = 0.0;                // seconds in which the camera moves sideways, free of trouble
  double longest = 0.0;               // seconds of the longest part in which tracking is not broken off
  double skew = 0.0;                  // 95 % quantile of the motion in 20 ms, share of the image's width

  // True where most of the film can be expected in one map.
  bool IsFit() const;
};

// Perceptual blur of an 8UC1 image, 0 (sharp) to 1: the share of the differences between neighbouring pixels
// that another blur would leave as they are (Crété-Roffet et al. 2007, The blur effect).
double BlurOf(const cv::Mat& gray);

// Counts the things in an image (8UC3).
using ThingCounter = std::function<int(const cv::Mat& bgr)>;
// Told after each sample; false ends the inspection: it then holds the samples until there and nothing of
// them all.
using InspectionProgress = std::function<bool(std::int64_t done, std::int64_t total)>;

// Looks at the frames of the range; `count` (may be null) at eight of them. Throws InputError where fewer
// than three can be read.
FilmInspection InspectFilm(const Sequence& sequence, const FrameRange& range,
                           const InspectionOptions& options, const ThingCounter& count = nullptr,
                           const InspectionProgress& progress = nullptr);

// Parts of trouble among the samples; see FilmTrouble.
std::vector<FilmFinding> FindTrouble(const std::vector<FilmMoment>& moments,
                                     const InspectionOptions& options);

// "0:12 to 0:19  the camera turns on the spot: walk sideways there".
std::string InWords(const FilmFinding& finding);

}  // namespace sqslam
