#include "slam/inspection/film_inspection.h"

#include <fmt/format.h>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <deque>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "slam/estimation/two_view.h"
#include "slam/features/matching.h"
#include "slam/features/orb_extractor.h"
#include "slam/util/statistics.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// A sample, or the frame after one.
struct Features {
  FrameFeatures features;
  double timestamp = 0.0;  // seconds
};

double ClippedShare(const cv::Mat& gray) {
  constexpr double kDark = 6.0;
  constexpr double kBright = 249.0;
  return static_cast<double>(cv::countNonZero((gray < kDark) | (gray > kBright))) /
         static_cast<double>(gray.total());
}

double CoverageOf(const FrameFeatures& features, const Camera& camera) {
  constexpr int kColumns = 8;
  constexpr int kRows = 6;
  std::bitset<kColumns * kRows> taken;
  for (const Keypoint& keypoint : features.keypoints) {
    const int column =
        std::clamp(static_cast<int>(keypoint.pixel.x() * kColumns / camera.width), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(keypoint.pixel.y() * kRows / camera.height), 0, kRows - 1);
    taken.set(static_cast<std::size_t>(row * kColumns + column));
  }
  return static_cast<double>(taken.count()) / static_cast<double>(taken.size());
}

std::vector<TwoViewMatch> MatchFrames(const FrameFeatures& a, const FrameFeatures& b) {
  constexpr double kRatio = 0.8;
  std::vector<TwoViewMatch> matches;
  for (const auto& [i, j] : MatchAll(a, b, {}, {}, kMaxUnguidedDistance, kRatio)) {
    matches.push_back(
        {a.keypoints[static_cast<std::size_t>(i)].pixel, b.keypoints[static_cast<std::size_t>(j)].pixel});
  }
  return matches;
}

// Median length, px.
double FlowOf(const std::vector<TwoViewMatch>& matches) {
  std::vector<double> lengths =
      ToVector(matches, [](const TwoViewMatch& match) { return (match.pixel2 - match.pixel1).norm(); });
  return UpperMedian(std::move(lengths));
}

double ShareOf(const std::vector<TwoViewMatch>& matches, const FrameFeatures& features) {
  return static_cast<double>(matches.size()) / std::max(1.0, static_cast<double>(features.Size()));
}

// Compares a sample with the frame after it, which may be unreadable, and with the next sample.
void Compare(const Features& sample, const Features* neighbour, const Features& next, const Camera& camera,
             FilmMoment& moment) {
  constexpr double kMinKept = 0.05;  // of the keypoints, to measure the motion to the next sample
  const std::vector<TwoViewMatch> near =
      neighbour != nullptr ? MatchFrames(sample.features, neighbour->features) : std::vector<TwoViewMatch>();
  const std::vector<TwoViewMatch> far = MatchFrames(sample.features, next.features);
  moment.shared = neighbour != nullptr ? ShareOf(near, sample.features) : moment.shared;
  moment.kept = ShareOf(far, sample.features);
  const bool by_far = moment.kept >= kMinKept || near.empty();
  const std::vector<TwoViewMatch>& matches = by_far ? far : near;
  if (!matches.empty()) {
    const double seconds = (by_far ? next : *neighbour).timestamp - sample.timestamp;
    moment.flow = FlowOf(matches) / camera.width / seconds;
  }
}

// Returns the share of the motion that no rotation of the camera explains; 1 if too few keypoints match.
double SidewaysShare(const FrameFeatures& a, const FrameFeatures& b, const Camera& camera) {
  constexpr std::size_t kMinMatches = 20;
  constexpr double kNoise = 1.0;  // px, of matched keypoints
  const std::vector<TwoViewMatch> matches = MatchFrames(a, b);
  if (matches.size() < kMinMatches) {
    return 1.0;
  }
  const double rest = FlowWithoutRotation(camera, matches);
  return std::max(0.0, rest - kNoise) / std::max(FlowOf(matches), kNoise);
}

// Returns the trouble of a single image.
std::optional<FilmTrouble> ImageTrouble(const FilmMoment& moment, const InspectionOptions& options) {
  if (moment.clipped > options.max_clipped) {
    return FilmTrouble::kExposure;
  }
  if (moment.blur > options.max_blur) {
    return FilmTrouble::kBlur;
  }
  return moment.coverage < options.min_coverage ? std::optional(FilmTrouble::kTexture) : std::nullopt;
}

std::optional<FilmTrouble> TroubleOf(const FilmMoment& moment, const FilmMoment& next,
                                     const InspectionOptions& options) {
  if (const std::optional<FilmTrouble> trouble = ImageTrouble(moment, options)) {
    return trouble;
  }
  if (moment.shared < options.min_shared ||
      moment.kept < options.min_kept) {  // a bad next image shares nothing, but has a trouble of its own
    return ImageTrouble(next, options) ? std::nullopt : std::optional(FilmTrouble::kJump);
  }
  if (moment.flow < options.min_flow) {
    return FilmTrouble::kStandstill;
  }
  return moment.sideways < options.max_turning ? std::optional(FilmTrouble::kTurning) : std::nullopt;
}

// Returns the seconds from a sample to the next one.
double Duration(const std::vector<FilmMoment>& moments, std::size_t i) {
  return i + 1 < moments.size() ? moments[i + 1].seconds - moments[i].seconds : 0.0;
}

// Returns the motion during a finding, image widths.
double TurnDuring(const FilmFinding& finding, const std::vector<FilmMoment>& moments) {
  double turn = 0.0;
  for (std::size_t i = 0; i + 1 < moments.size(); ++i) {
    const bool within = finding.begin <= moments[i].seconds && moments[i].seconds < finding.end;
    turn += within ? moments[i].flow * Duration(moments, i) : 0.0;
  }
  return turn;
}

std::vector<FilmFinding> FindTrouble(const std::vector<FilmMoment>& moments,
                                     const InspectionOptions& options) {
  std::vector<FilmFinding> findings;
  for (std::size_t i = 0; i + 1 < moments.size(); ++i) {
    const std::optional<FilmTrouble> trouble = TroubleOf(moments[i], moments[i + 1], options);
    if (!trouble) {
      continue;
    }
    const double end = moments[i + 1].seconds;
    if (!findings.empty() && findings.back().trouble == *trouble &&
        moments[i].seconds - findings.back().end < options.min_trouble) {
      findings.back().end = end;
    } else {
      findings.push_back({*trouble, moments[i].seconds, end});
    }
  }
  // A jump breaks tracking however short it is.
  std::erase_if(findings, [&](const FilmFinding& finding) {
    return finding.trouble != FilmTrouble::kJump && finding.end - finding.begin < options.min_trouble;
  });
  for (FilmFinding& finding : findings) {
    finding.breaks = finding.trouble == FilmTrouble::kTurning
                         ? TurnDuring(finding, moments) > options.max_turn
                         : finding.trouble != FilmTrouble::kStandstill;
  }
  return findings;
}

void Summarize(FilmInspection& inspection) {
  const std::vector<FilmMoment>& moments = inspection.moments;
  inspection.seconds = moments.back().seconds;
  double unbroken = 0.0;
  std::vector<double> skews;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const double seconds = Duration(moments, i);
    const double middle = moments[i].seconds + 0.5 * seconds;
    const auto finding = std::ranges::find_if(
        inspection.findings, [&](const FilmFinding& f) { return f.begin <= middle && middle < f.end; });
    const bool in_trouble = finding != inspection.findings.end();
    unbroken = in_trouble && finding->breaks ? 0.0 : unbroken + seconds;
    inspection.longest = std::max(inspection.longest, unbroken);
    inspection.moving += in_trouble ? 0.0 : seconds;
    constexpr double kReadout = 0.02;  // seconds, of a phone's rolling shutter
    skews.push_back(moments[i].flow * kReadout);
  }
  inspection.skew = LinearQuantile(skews, 0.95);
}

FrameRange SampleRange(const Sequence& sequence, const FrameRange& range, const InspectionOptions& options) {
  const double fps = sequence.camera.fps > 0.0 ? sequence.camera.fps : 30.0;
  const auto step = std::max<std::int64_t>(
      1, std::lround(options.sample_interval * fps / static_cast<double>(range.stride)));
  FrameRange samples = range;
  samples.stride = range.stride * step;
  samples.count = (range.SizeIn(sequence) + step - 1) / step;
  return samples;
}

// The frames after the samples. Unreadable frames are skipped in both, each on its own.
class NeighbourFrames {
 public:
  NeighbourFrames(const Sequence& sequence, FrameRange samples, std::int64_t stride) {
    samples.start += stride;
    if (samples.stride > stride && samples.SizeIn(sequence) > 0) {
      source_.emplace(sequence, samples);
    }
  }

  // Returns the frame of this index, which must rise; empty if it cannot be read.
  std::optional<Frame> At(std::int64_t index) {
    while (source_ && (!frame_ || frame_->index < index) && (frame_ = source_->Next())) {
    }
    return frame_ && frame_->index == index ? frame_ : std::nullopt;
  }

 private:
  std::optional<FrameSource> source_;
  std::optional<Frame> frame_;
};

std::string ClockTime(double seconds) {
  const int whole = static_cast<int>(std::lround(seconds));
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace

bool FilmInspection::IsFit() const {
  constexpr double kMinLongestShare = 0.6;  // of the film
  constexpr double kMinMovingShare = 0.3;
  constexpr double kMinMapped = 0.5;  // of the frames; below, a run warns that few are in the map
  if (mapped) {
    return *mapped >= kMinMapped;
  }
  return seconds > 0.0 && longest >= kMinLongestShare * seconds && moving >= kMinMovingShare * seconds;
}

double BlurOf(const cv::Mat& gray) {
  constexpr int kTaps = 9;
  cv::Mat image;
  gray.convertTo(image, CV_32F);
  double blur = 0.0;
  for (const bool across : {true, false}) {
    cv::Mat blurred;
    cv::blur(image, blurred, across ? cv::Size(kTaps, 1) : cv::Size(1, kTaps));
    const cv::Rect first =
        across ? cv::Rect(0, 0, gray.cols - 1, gray.rows) : cv::Rect(0, 0, gray.cols, gray.rows - 1);
    const cv::Rect second = first + (across ? cv::Point(1, 0) : cv::Point(0, 1));
    const cv::Mat sharp_steps = cv::abs(image(second) - image(first));
    const cv::Mat blurred_steps = cv::abs(blurred(second) - blurred(first));
    const double all = cv::sum(sharp_steps)[0];
    const double lost = cv::sum(cv::max(sharp_steps - blurred_steps, 0.0))[0];
    blur = std::max(blur, all > 0.0 ? (all - lost) / all : 1.0);
  }
  return blur;
}

FilmInspection InspectFilm(const Sequence& sequence, const FrameRange& range,
                           const InspectionOptions& options, const ThingCounter& count,
                           const InspectionProgress& progress) {
  constexpr int kThingSamples = 8;
  const FrameRange samples = SampleRange(sequence, range, options);
  const std::int64_t thing_step = std::max<std::int64_t>(1, samples.count / kThingSamples);
  const Camera& camera = sequence.camera;
  OrbOptions orb;
  orb.num_features = options.keypoints;
  OrbExtractor extractor(orb);
  const auto extract = [&](const Frame& frame) {
    return Features{extractor.Extract(frame.gray, frame.bgr, camera), frame.timestamp};
  };
  FilmInspection inspection;
  std::vector<FilmMoment>& moments = inspection.moments;
  std::deque<Features> before;                      // the last two samples
  std::optional<Features> neighbour;                // frame after the last sample
  const bool all = samples.stride == range.stride;  // the next frame is the next sample
  FrameSource source(sequence, samples);
  NeighbourFrames neighbours(sequence, samples, range.stride);
  double start = 0.0;
  for (std::int64_t i = 0; const std::optional<Frame> frame = source.Next(); ++i) {
    start = i == 0 ? frame->timestamp : start;
    FilmMoment moment{.frame = frame->index, .seconds = frame->timestamp - start};
    moment.clipped = ClippedShare(frame->gray);
    moment.blur = BlurOf(frame->gray);
    Features features = extract(*frame);
    moment.coverage = CoverageOf(features.features, camera);
    moment.things = count && i % thing_step == 0 ? count(frame->bgr) : -1;
    if (!before.empty()) {
      Compare(before.back(),
              all         ? &features
              : neighbour ? &*neighbour
                          : nullptr,
              features, camera, moments.back());
    }
    if (before.size() == 2) {
      moments[moments.size() - 2].sideways =
          SidewaysShare(before.front().features, features.features, camera);
      before.pop_front();
    }
    moments.push_back(moment);
    before.push_back(std::move(features));
    const std::optional<Frame> next = all ? std::nullopt : neighbours.At(frame->index + range.stride);
    neighbour = next ? std::optional(extract(*next)) : std::nullopt;
    if (progress && !progress(i + 1, samples.count)) {
      return inspection;
    }
  }
  ThrowIf<InputError>(moments.size() < 3, "{}: {} frames can be read, expected at least three",
                      sequence.path.string(), moments.size());
  // The last samples have no followers.
  for (std::size_t i = moments.size() - 2; i < moments.size(); ++i) {
    moments[i].sideways = moments[i - 1].sideways;
  }
  moments.back().flow = moments[moments.size() - 2].flow;
  inspection.findings = FindTrouble(moments, options);
  Summarize(inspection);
  return inspection;
}

std::string InWords(const FilmFinding& finding) {
  constexpr std::array kWords = {
      "too dark or too bright: film with more or less light",
      "blurred: move slower, or use more light",
      "too little texture: keep textured things in the image",
      "the camera stands still: walk sideways there",
      "the camera turns on the spot: walk sideways there",
      "neighbouring frames barely overlap: a cut? Otherwise move slower, or record at a higher frame rate",
  };
  const std::string begin = ClockTime(finding.begin);
  const std::string end = ClockTime(finding.end);
  return fmt::format("{:<13} {}", begin == end ? begin : begin + " to " + end,
                     kWords[static_cast<std::size_t>(finding.trouble)]);
}

}  // namespace sqslam
