#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "app/report/report.h"
#include "render/figures/figure_input.h"
#include "render/picture/photo.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/geometry/angles.h"
#include "slam/io/input_images.h"
#include "slam/util/markup.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// Lists the intervals without tracking, relative to the start of the path.
std::string GapsText(const Trajectory& trajectory) {
  std::vector<std::string> gaps;
  const std::vector<Trajectory> pieces = SplitAtGaps(trajectory);
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    const double start = trajectory.front().timestamp;
    gaps.push_back(fmt::format("{} to {}", ClockText(pieces[i - 1].back().timestamp - start),
                               ClockText(pieces[i].front().timestamp - start)));
  }
  constexpr std::size_t kMaxGaps = 8;
  if (gaps.size() > kMaxGaps) {
    gaps.resize(kMaxGaps);
    gaps.emplace_back("…");
  }
  return fmt::format("{}", fmt::join(gaps, ", "));
}

// Name and text of each line.
using Facts = std::vector<std::pair<std::string, std::string>>;

Facts FactsOf(const ReportData& data) {
  Facts facts;
  const MapSnapshotPtr map = data.recording ? data.recording->Last() : nullptr;
  if (map && map->camera.width > 0) {
    const Camera& camera = map->camera;
    facts.emplace_back(
        "Camera", fmt::format("{} × {} pixels, focal length {:.1f} px ({:.0f}° wide)", camera.width,
                              camera.height, camera.fx, kDegreesPerRadian * HorizontalFieldOfView(camera)));
  }
  if (data.stats) {
    const RunStats& stats = *data.stats;
    const RunCounters& counters = stats.counters;
    if (!stats.camera.empty()) {
      facts.emplace_back("Focal length from", stats.camera);
    }
    if (!stats.detector.empty()) {
      facts.emplace_back("Boxes from", stats.detector_frames > 0
                                           ? fmt::format("{}, which saw {} of {} frames", stats.detector,
                                                         stats.detector_frames, stats.frames)
                                           : stats.detector);
    }
    const std::string gaps = GapsText(data.trajectory);
    facts.emplace_back(
        "Tracking lost",
        fmt::format("{}{}", counters.losses == 0 ? "never" : fmt::format("{} times", counters.losses),
                    gaps.empty() ? "" : "; not in the map: " + gaps));
    if (counters.losses > 0) {
      facts.emplace_back("Relocalised", fmt::format("{} times", counters.relocalizations));
    }
    facts.emplace_back("Loops closed",
                       fmt::format("{}, and {} returns to known places", counters.loops, counters.returns));
    facts.emplace_back("Submaps", fmt::format("{} merged, {} left on their own, {} given up", counters.merges,
                                              stats.submaps, counters.resets));
    if (stats.skipped + stats.dropped > 0) {
      facts.emplace_back("Frames left out",
                         fmt::format("{} unreadable, {} too late", stats.skipped, stats.dropped));
    }
  }
  if (map) {
    facts.emplace_back("Gravity",
                       map->gravity_known ? "known: the map stands upright" : "not found: the map may lean");
  }
  if (data.stats && !data.stats->command.empty()) {
    facts.emplace_back("Made by", data.stats->command);
  }
  if (data.recording) {
    facts.emplace_back("Version", "sqslam " + data.recording->Info().program_version);
  }
  return facts;
}

}  // namespace

void AppendRun(std::string& page, const ReportData& data) {
  const Facts facts = FactsOf(data);
  if (facts.empty()) {
    return;
  }
  const auto out = std::back_inserter(page);
  fmt::format_to(out, "<section><h2>How it was made</h2>\n<table class=\"facts\"><tbody>\n");
  for (const auto& [name, text] : facts) {
    fmt::format_to(out, "<tr><th>{}</th><td>{}</td></tr>\n", name, EscapeMarkup(text));
  }
  fmt::format_to(out, "</tbody></table>\n");
  if (data.stats && !data.stats->warnings.empty()) {
    fmt::format_to(out, "<h3>Warnings</h3>\n<ul class=\"warnings\">\n");
    for (const std::string& warning : data.stats->warnings) {
      fmt::format_to(out, "<li>{}</li>\n", EscapeMarkup(warning));
    }
    fmt::format_to(out, "</ul>\n");
  }
  const auto settings = ChangedOptions(data.recording ? ConfigOf(*data.recording) : SystemOptions(), {});
  if (!settings.empty()) {
    fmt::format_to(
        out,
        "<h3>Settings that differ from the defaults</h3>\n<div class=\"scroll\"><table><thead><tr><th "
        "class=\"l\">Setting</th><th>Value</th><th>Default</th></tr></thead><tbody>\n");
    for (const auto& [key, value, before] : settings) {
      fmt::format_to(out, "<tr><td class=\"l\"><code>{}</code></td><td>{}</td><td>{}</td></tr>\n",
                     EscapeMarkup(key), EscapeMarkup(value), EscapeMarkup(before));
    }
    fmt::format_to(out, "</tbody></table></div>\n");
  }
  fmt::format_to(out, "</section>\n");
}

std::optional<OutlinedPhoto> BestPhoto(const RecordingReader& reader, const ViewHistory& history) {
  MapSnapshot map = *reader.Last();
  std::map<std::size_t, double> worth;  // of keyframes
  std::map<std::size_t, std::set<std::size_t>> shown;
  for (const SeenOutline& outline : FindOutlines(map, history, 0.5)) {
    if (outline.detected) {
      const bool reliable = IsReliable(map.objects[outline.object]);
      worth[outline.keyframe] +=
          (reliable ? 1.0 : 0.1) * (outline.whole ? 1.0 : 0.4) * std::min(0.3, std::sqrt(outline.share));
      shown[outline.keyframe].insert(outline.object);
    }
  }
  if (worth.empty()) {
    return std::nullopt;
  }
  const std::size_t best = std::ranges::max_element(worth, {}, [](const auto& w) { return w.second; })->first;
  const SnapshotKeyframe keyframe = map.keyframes[best];
  map.objects = ToVector(shown[best], [&map](std::size_t object) { return map.objects[object]; });
  InputImages images(reader);
  const cv::Mat image = images.Read(history.image_files, keyframe.frame_index);
  if (image.empty()) {
    return std::nullopt;
  }
  PictureOptions options;
  options.width = 1280;
  options.height = 1280 * image.rows / image.cols;
  return OutlinedPhoto{RenderOverPhoto(map, image, keyframe.T_map_camera, options),
                       fmt::format("Frame {} of the input, with the outlines of the mapped objects that the "
                                   "detector saw in it.",
                                   keyframe.frame_index)};
}

}  // namespace sqslam::app
