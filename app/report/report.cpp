#include "app/report/report.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "slam/io/image_files.h"
#include "slam/util/atomic_file.h"
#include "slam/util/data_path.h"
#include "slam/util/markup.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

using Output = std::back_insert_iterator<std::string>;

// Return pictures and videos as "data:image/webp;base64,...".
std::string PictureUri(const cv::Mat& picture) {
  return "data:image/webp;base64," + Base64(EncodedImage(".webp", picture, {cv::IMWRITE_WEBP_QUALITY, 86}));
}

std::string PictureUri(const fs::path& file) {
  const cv::Mat picture = ReadImage(file, cv::IMREAD_COLOR);
  ThrowIf<InputError>(picture.empty(), "{}: cannot be read, expected a picture", file.string());
  return PictureUri(picture);
}

std::string VideoUri(const fs::path& file) {
  return "data:video/mp4;base64," + Base64(ReadFile(file, "a video"));
}

constexpr std::uintmax_t kMaxVideoBytes = 3u << 20;  // bytes: the interactive map shows the growth too

void AppendFigureOfRun(Output out, std::string_view name, const std::string& value, std::string_view unit,
                       const std::string& note) {
  fmt::format_to(out, "<div><dt>{}</dt><dd>{}{}{}</dd></div>\n", name, value,
                 unit.empty() ? "" : fmt::format("<small>{}</small>", unit),
                 note.empty() ? "" : fmt::format("<span>{}</span>", note));
}

void AppendFiguresOfRun(Output out, const ReportData& data) {
  fmt::format_to(out, "<dl class=\"figures\">\n");
  if (data.stats) {
    const RunStats& stats = *data.stats;
    const double share = stats.frames > 0 ? 100.0 * stats.tracked / stats.frames : 0.0;
    AppendFigureOfRun(out, "Frames tracked", fmt::format("{:.1f}", share), "%",
                      fmt::format("{} of {}", stats.tracked, stats.frames));
    const std::string uncertain = stats.uncertain > 0 ? fmt::format("{} uncertain", stats.uncertain) : "";
    const std::string detector = stats.detector_frames > 0 ? fmt::format("detector saw {} of {} frames",
                                                                         stats.detector_frames, stats.frames)
                                                           : "";
    const std::string_view comma = uncertain.empty() || detector.empty() ? "" : ", ";
    AppendFigureOfRun(out, "Objects", std::to_string(stats.objects - stats.uncertain), "",
                      fmt::format("{}{}{}", uncertain, comma, detector));
    AppendFigureOfRun(out, "Map points", std::to_string(stats.points), "",
                      fmt::format("{} keyframes", stats.keyframes));
  }
  if (data.evaluation != nullptr) {
    const TrajectoryError& error = data.evaluation->trajectory;
    AppendFigureOfRun(out, "Trajectory error (RMSE)", fmt::format("{:.1f}", 1000.0 * error.rmse), "mm",
                      fmt::format("{:.2f} % of {:.2f} m",
                                  error.path_length > 0.0 ? 100.0 * error.rmse / error.path_length : 0.0,
                                  error.path_length));
    if (data.evaluation->has_objects) {
      AppendFigureOfRun(out, "Mean 3D IoU", fmt::format("{:.3f}", data.evaluation->iou.mean), "",
                        fmt::format("{:.3f} as ellipsoids", data.evaluation->iou.mean_ellipsoid));
      AppendFigureOfRun(out, "Objects matched", std::to_string(data.evaluation->objects.matches.size()), "",
                        fmt::format("of {} in the ground truth; {} with IoU 0.25 or more, {} with 0.5",
                                    data.evaluation->truth.size(), data.evaluation->iou.matched_25,
                                    data.evaluation->iou.matched_50));
    }
  }
  if (data.stats) {
    const RunStats& stats = *data.stats;
    AppendFigureOfRun(
        out, "Time", fmt::format("{:.1f}", stats.wall_seconds), "s",
        fmt::format("{:.1f} frames a second", stats.frames / std::max(1e-9, stats.wall_seconds)));
    AppendFigureOfRun(out, "Peak memory", fmt::format("{:.0f}", stats.peak_memory_mib), "MiB", "");
  }
  fmt::format_to(out, "</dl>\n");
}

std::optional<fs::path> VideoOf(const ReportInputs& inputs) {
  for (const fs::path& file : {inputs.video, inputs.result / "growth.mp4", inputs.result / "map.mp4"}) {
    std::error_code error;
    if (!file.empty() && fs::is_regular_file(file, error) && fs::file_size(file, error) <= kMaxVideoBytes) {
      return file;
    }
  }
  return std::nullopt;
}

// Appends a picture that enlarges on click, without a script: a checkbox in its label holds the state.
void AppendFigure(Output out, const std::string& uri, const std::string& text, const std::string& caption) {
  fmt::format_to(out,
                 "<figure><label class=\"zoom\"><input type=\"checkbox\"><img alt=\"{}\" src=\"{}\"></label>"
                 "<figcaption>{}</figcaption></figure>\n",
                 EscapeMarkup(text), uri, EscapeMarkup(caption));
}

void AppendPictures(Output out, const ReportInputs& inputs, bool has_view) {
  if (!has_view && fs::exists(inputs.result / "map.png")) {
    AppendFigure(out, PictureUri(inputs.result / "map.png"), "The map",
                 "The map: objects as superquadrics, map points, camera path.");
  }
  if (const auto video = VideoOf(inputs)) {
    const fs::path poster = inputs.result / "map.png";
    fmt::format_to(
        out,
        "<figure><video controls muted playsinline preload=\"metadata\"{} src=\"{}\"></video><figcaption>"
        "The growth of the map along the run.</figcaption></figure>\n",
        fs::exists(poster) ? fmt::format(" poster=\"{}\"", PictureUri(poster)) : "", VideoUri(*video));
  }
}

// Appends an input image with the objects' outlines and the interactive map; returns false without the map.
bool AppendViews(std::string& page, const ReportInputs& inputs, const ReportData& data) {
  if (!data.recording) {
    return false;
  }
  const Output out(page);
  const ViewHistory history = ReadHistory(*data.recording);
  if (const auto photo = BestPhoto(*data.recording, history)) {
    AppendFigure(out, PictureUri(photo->picture), "An input image with the outlines of the objects",
                 photo->caption);
  }
  try {
    MapViewExtras extras;
    extras.render_options = inputs.render_options;
    extras.metres = data.IsMetric() ? data.Scale() : 0.0;
    if (data.evaluation != nullptr && !data.evaluation->truth_positions_map.empty()) {
      extras.true_path.push_back(data.evaluation->truth_positions_map);
    }
    const MapView view = ReadMapView(*data.recording, history, inputs.result / "map.sqmap", extras);
    fmt::format_to(
        out,
        "<figure class=\"turn\">{}<figcaption>The map. Drag to turn it, click an object for its "
        "numbers and best views, a keyframe for its image; the slider plays its growth.</figcaption>"
        "</figure>\n",
        MapViewElements(view));
    return true;
  } catch (const InputError& error) {
    spdlog::warn("report.html has no 3D view: {}", error.what());
    return false;
  }
}

void AppendTopView(Output out, const ReportData& data, const LabelColors& colors) {
  const std::string svg = TopViewSvg(data, colors);
  if (svg.empty()) {
    return;
  }
  fmt::format_to(
      out,
      "<section><h2>Seen from above</h2>\n<figure>{}<figcaption>Camera path, and the objects’ horizontal "
      "outlines, dashed where uncertain.{}</figcaption></figure></section>\n",
      svg,
      data.evaluation != nullptr ? " The ground truth is aligned by a similarity."
      : data.scale               ? fmt::format(" {}.", EscapeMarkup(ScaleText(*data.scale)))
                                 : " A map from one camera has no scale: lengths are in map units.");
}

void AppendGallery(Output out, const fs::path& folder) {
  std::vector<fs::path> pictures;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".png") {
        pictures.push_back(entry.path());
      }
    }
  }
  if (pictures.empty()) {
    return;
  }
  std::ranges::sort(pictures);
  fmt::format_to(out, "<section><h2>Figures</h2>\n<div class=\"gallery\">\n");
  for (const fs::path& picture : pictures) {
    std::string caption = ReadableLabel(picture.stem().string());
    std::ranges::replace(caption, '-', ' ');
    caption[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(caption[0])));
    AppendFigure(out, PictureUri(picture), caption, caption);
  }
  fmt::format_to(out, "</div></section>\n");
}

// Reads a result folder; values of a run in memory replace its files.
ReportData ReadReportData(const ReportInputs& inputs) {
  const fs::path& folder = inputs.result;
  ThrowIf<InputError>(!fs::is_directory(folder), "{}: no such folder; expected the result folder of a run",
                      folder.string());
  const auto has = [&](const char* name) { return fs::exists(folder / name); };
  ReportData data;
  data.evaluation = inputs.evaluation;
  if (inputs.run != nullptr) {
    data.trajectory = inputs.run->result.map.trajectory;
    data.objects = inputs.run->result.map.snapshot->objects;
    data.stats = inputs.run->stats;
  } else {
    data.trajectory = has("trajectory.txt") ? ReadTrajectory(folder / "trajectory.txt") : Trajectory();
    data.objects = has("objects.json") ? ReadObjects(folder / "objects.json") : data.objects;
    data.stats = has("stats.json") ? std::optional(ReadStats(folder / "stats.json")) : std::nullopt;
  }
  if (has("map.sqmap")) {
    data.recording =
        inputs.changed ? inputs.changed : std::make_shared<const RecordingReader>(folder / "map.sqmap");
    data.scale = data.recording->Info().scale;
    data.recording = data.recording->Size() > 0 ? data.recording : nullptr;
  }
  if (inputs.changed && data.recording) {
    data.objects = data.recording->Last()->objects;
    if (data.stats) {
      data.stats->objects = static_cast<int>(data.objects.size());
      data.stats->uncertain =
          data.stats->objects - static_cast<int>(std::ranges::count_if(data.objects, IsReliable));
    }
  }
  return data;
}

// Appends a warning if most frames of the run failed.
void AppendBanner(Output out, const ReportData& data) {
  if (!data.stats || 2 * data.stats->tracked >= data.stats->frames) {
    return;
  }
  fmt::format_to(
      out,
      "<div class=\"alarm\"><b>Most of this run failed.</b> Only {} of {} frames are in the map, so it "
      "shows a small part of what was filmed. The usual causes: the camera turns on the spot, moves "
      "too fast, or sees too little texture.</div>\n",
      data.stats->tracked, data.stats->frames);
}

}  // namespace

fs::path WriteReport(const ReportInputs& inputs) {
  const ReportData data = ReadReportData(inputs);
  const LabelColors colors = LabelColors();
  const std::string sequence =
      inputs.sequence.empty() && data.recording ? data.recording->Info().sequence_path : inputs.sequence;
  const std::string title =
      inputs.title.empty()
          ? AbsolutePath(sequence.empty() ? inputs.result : fs::path(sequence)).filename().string()
          : inputs.title;
  std::string body;
  const Output out = std::back_inserter(body);
  fmt::format_to(
      out, "<header><div class=\"eyebrow\">Object map</div>\n<h1>{}</h1>\n{}</header>\n", EscapeMarkup(title),
      sequence.empty() ? "" : fmt::format("<div class=\"sub\">{}</div>\n", EscapeMarkup(sequence)));
  AppendBanner(out, data);
  AppendFiguresOfRun(out, data);
  const bool has_view = AppendViews(body, inputs, data);
  if (!inputs.changed) {
    AppendPictures(out, inputs, has_view);
  }
  AppendTopView(out, data, colors);
  AppendObjects(body, data, colors);
  AppendRelations(body, data, inputs.result);
  AppendClasses(body, data);
  AppendComparison(body, data, colors);
  if (!inputs.changed) {
    AppendGallery(out, inputs.result / "figures");
  }
  AppendTiming(body, data);
  AppendRun(body, data);
  fmt::format_to(
      out,
      "<footer>Made by sqslam. Beside this page: map.sqmap (the whole run), objects.json, points.ply, "
      "trajectory.txt, stats.json.</footer>\n");
  const std::string style = ReadFile(DataPath("assets/report.css"), "a style sheet");
  const fs::path page = inputs.output.empty() ? inputs.result / "report.html" : inputs.output;
  WriteFileAtomically(page, HtmlPage(title, body, style));
  return page;
}

}  // namespace sqslam::app
