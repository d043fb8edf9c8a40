#include "app/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "app/result/map_input.h"
#include "render/picture/picture_text.h"
#include "slam/geometry/angles.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/markup.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

using Output = std::back_insert_iterator<std::string>;

constexpr std::uintmax_t kLargestVideo = 8u << 20;  // bytes

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
    AppendFigureOfRun(out, "Objects", std::to_string(stats.objects), "",
                      stats.detector_frames > 0
                          ? fmt::format("detector saw {} of {} frames", stats.detector_frames, stats.frames)
                          : "");
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
                        fmt::format("of {} in the ground truth", data.evaluation->truth.size()));
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

// The dot in the colour of a class, "#rrggbb" as in the pictures of the map.
std::string Dot(const LabelColors& colors, const std::string& label) {
  return fmt::format("<span class=\"dot\" style=\"background:{}\"></span>", FormatColor(colors(label)));
}

void AppendObjectRow(Output out, const ReportData& data, const SnapshotObject& object,
                     const LabelColors& colors) {
  const Superquadric& shape = object.superquadric.shape;
  const double factor =
      2.0 * data.Scale() * (data.evaluation != nullptr ? 100.0 : 1.0);  // centimetres where metric
  const int digits = data.evaluation != nullptr ? 1 : 3;
  fmt::format_to(out, "<tr><td class=\"l\">{}{} {}</td>", Dot(colors, object.label), object.id,
                 EscapeMarkup(object.label));
  fmt::format_to(out, "<td>{}</td><td>{:.2f}</td><td>{:.2f}</td>",
                 ShapeGlyphSvg(object, colors(object.label)), shape.e1, shape.e2);
  fmt::format_to(out, "<td>{:.{}f} × {:.{}f} × {:.{}f}</td>", factor * shape.half_size.x(), digits,
                 factor * shape.half_size.y(), digits, factor * shape.half_size.z(), digits);
  fmt::format_to(out, "<td>{}</td><td>{}</td><td>{:.2f}</td></tr>\n", object.observations, object.points,
                 object.score);
}

// An object of the ground truth with its number.
std::string TruthCell(const GroundTruthObject& truth) {
  return fmt::format("<td class=\"l\">{} {}</td><td>{}</td>", truth.id, EscapeMarkup(ShownName(truth)),
                     truth.detections);
}

void AppendMatchRow(Output out, const Evaluation& evaluation, const ObjectMatch& match,
                    const LabelColors& colors) {
  const SnapshotObject& object = evaluation.mapped.at(static_cast<std::size_t>(match.mapped));
  fmt::format_to(out, "<tr>{}<td class=\"l\">{}{} {}</td>",
                 TruthCell(evaluation.truth.at(static_cast<std::size_t>(match.truth))),
                 Dot(colors, object.label), object.id, EscapeMarkup(object.label));
  fmt::format_to(
      out,
      "<td class=\"bars\"><span class=\"bar\"><i style=\"width:{:.0f}%\"></i></span></td><td>{:.3f}</td>",
      100.0 * match.iou, match.iou);
  fmt::format_to(out, "<td>{:.3f}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.1f}</td></tr>\n",
                 match.iou_ellipsoid, 100.0 * match.center_error, 100.0 * match.size_error,
                 kDegreesPerRadian * match.yaw_error);
}

// "3 chair, 7 cup", or "none".
std::string MappedOf(const Evaluation& evaluation, const auto& items) {
  std::vector<std::string> names;
  for (const auto& item : items) {
    const SnapshotObject& object = evaluation.mapped.at(static_cast<std::size_t>(item.mapped));
    names.push_back(fmt::format("{} {}", object.id, EscapeMarkup(object.label)));
  }
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

void AppendObjects(Output out, const ReportData& data, const LabelColors& colors) {
  if (data.objects.empty()) {
    return;
  }
  fmt::format_to(
      out,
      "<section><h2>Objects</h2>\n<div class=\"scroll\"><table><thead><tr><th class=\"l\">Object</th>"
      "<th>From above, side</th><th>ε₁</th><th>ε₂</th><th>Size, {}</th><th>Seen in</th><th>Points</th>"
      "<th>Score</th></tr></thead><tbody>\n",
      data.evaluation != nullptr ? "cm" : "map units");
  for (const SnapshotObject& object : data.objects) {
    AppendObjectRow(out, data, object, colors);
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

void AppendComparison(Output out, const ReportData& data, const LabelColors& colors) {
  if (data.evaluation == nullptr || !data.evaluation->has_objects) {
    return;
  }
  const Evaluation& evaluation = *data.evaluation;
  fmt::format_to(
      out,
      "<section><h2>Against the ground truth</h2>\n<div class=\"scroll\"><table><thead><tr>"
      "<th class=\"l\">Ground truth</th><th>Boxes</th><th class=\"l\">Mapped as</th><th></th><th>3D IoU</th>"
      "<th>as ellipsoid</th><th>Centre off, cm</th><th>Size off, cm</th><th>Yaw off, "
      "°</th></tr></thead><tbody>\n");
  for (const ObjectMatch& match : evaluation.objects.matches) {
    AppendMatchRow(out, evaluation, match, colors);
  }
  for (const int missed : evaluation.objects.missed) {
    fmt::format_to(out, "<tr class=\"missed\">{}<td class=\"l\" colspan=\"7\">missed</td></tr>\n",
                   TruthCell(evaluation.truth.at(static_cast<std::size_t>(missed))));
  }
  fmt::format_to(out, "</tbody></table></div>\n<div class=\"after\"></div>\n");
  for (const CoverageCount& count : evaluation.coverage) {
    fmt::format_to(out, "<p class=\"note\">Objects with {} or more detections in the map: {} of {}.</p>\n",
                   count.min_detections, count.mapped, count.total);
  }
  fmt::format_to(out,
                 "<p class=\"note\">In the map without ground truth: {}. Mapped twice: {}.</p></section>\n",
                 MappedOf(evaluation, evaluation.extra), MappedOf(evaluation, evaluation.objects.duplicates));
}

void AppendTiming(Output out, const ReportData& data) {
  if (!data.stats || data.stats->timing_ms.empty()) {
    return;
  }
  double largest = 1e-9;
  for (const auto& [stage, summary] : data.stats->timing_ms) {
    largest = std::max(largest, summary.mean);
  }
  fmt::format_to(
      out,
      "<section><h2>Time</h2>\n<div class=\"scroll\"><table><thead><tr><th class=\"l\">Stage, milliseconds"
      "</th><th></th><th>Mean</th><th>Median</th><th>95 "
      "%</th><th>Longest</th><th>Times</th></tr></thead><tbody>\n");
  for (const auto& [stage, summary] : data.stats->timing_ms) {  // sorted: a stage stands before its parts
    const std::size_t dot = stage.find('.');
    const std::string name = ReadableLabel(dot == std::string::npos ? stage : stage.substr(dot + 1));
    fmt::format_to(
        out,
        "<tr class=\"{}\"><td class=\"stage\">{}</td><td class=\"bars\"><span class=\"bar\"><i "
        "style=\"width:{:.0f}%\"></i>"
        "</span></td><td>{:.2f}</td><td>{:.2f}</td><td>{:.2f}</td><td>{:.1f}</td><td>{}</td></tr>\n",
        dot == std::string::npos ? "stage1" : "sub", EscapeMarkup(name), 100.0 * summary.mean / largest,
        summary.mean, summary.median, summary.p95, summary.max, summary.count);
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

std::optional<fs::path> VideoOf(const ReportInputs& inputs) {
  for (const fs::path& file : {inputs.video, inputs.result / "growth.mp4", inputs.result / "map.mp4"}) {
    std::error_code error;
    if (!file.empty() && fs::is_regular_file(file, error) && fs::file_size(file, error) <= kLargestVideo) {
      return file;
    }
  }
  return std::nullopt;
}

void AppendPictures(Output out, const ReportInputs& inputs) {
  if (fs::exists(inputs.result / "map.png")) {
    fmt::format_to(
        out,
        "<figure><img alt=\"The map\" src=\"{}\"><figcaption>The map: objects as superquadrics, map "
        "points, camera path.</figcaption></figure>\n",
        DataUri(inputs.result / "map.png", "image/png"));
  }
  if (const auto video = VideoOf(inputs)) {
    fmt::format_to(
        out,
        "<figure><video controls muted playsinline preload=\"metadata\" src=\"{}\"></video><figcaption>"
        "The growth of the map along the run.</figcaption></figure>\n",
        DataUri(*video, "video/mp4"));
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
      "outlines.{}</figcaption></figure></section>\n",
      svg,
      data.evaluation != nullptr ? " The ground truth is aligned by a similarity."
                                 : " A map from one camera has no scale: "
                                   "lengths are in map units.");
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
    std::string caption = picture.stem().string();
    std::ranges::replace_if(
        caption, [](char c) { return c == '_' || c == '-'; }, ' ');
    fmt::format_to(out, "<figure><img alt=\"{0}\" src=\"{1}\"><figcaption>{0}</figcaption></figure>\n",
                   EscapeMarkup(caption), DataUri(picture, "image/png"));
  }
  fmt::format_to(out, "</div></section>\n");
}

// The sequence that the run says it mapped.
std::string RecordedSequence(const fs::path& result) {
  return fs::exists(result / "map.sqmap") ? RecordingReader(result / "map.sqmap").Info().sequence_path : "";
}

// Reads a result folder, or takes from the run what it would read of it.
ReportData ReadReportData(const ReportInputs& inputs) {
  const fs::path& folder = inputs.result;
  if (!fs::is_directory(folder)) {
    throw InputError(fmt::format("{}: no such folder; expected the result folder of a run", folder.string()));
  }
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
  return data;
}

}  // namespace

void WriteReport(const ReportInputs& inputs) {
  const ReportData data = ReadReportData(inputs);
  const LabelColors colors = LabelColors::Of(data.objects);
  const std::string sequence = inputs.sequence.empty() ? RecordedSequence(inputs.result) : inputs.sequence;
  const std::string title =
      inputs.title.empty() ? FolderName(sequence.empty() ? inputs.result : fs::path(sequence)) : inputs.title;
  std::string body;
  const Output out = std::back_inserter(body);
  fmt::format_to(
      out, "<header><div class=\"eyebrow\">Object map</div>\n<h1>{}</h1>\n{}</header>\n", EscapeMarkup(title),
      sequence.empty() ? "" : fmt::format("<div class=\"sub\">{}</div>\n", EscapeMarkup(sequence)));
  AppendFiguresOfRun(out, data);
  AppendPictures(out, inputs);
  AppendTopView(out, data, colors);
  AppendObjects(out, data, colors);
  AppendComparison(out, data, colors);
  AppendGallery(out, inputs.result / "figures");
  AppendTiming(out, data);
  fmt::format_to(
      out,
      "<footer>Made by sqslam. Beside this page: map.sqmap (the whole run), objects.json, points.ply, "
      "trajectory.txt, stats.json.</footer>\n");
  WriteFileAtomically(inputs.result / "report.html", HtmlPage(title, body));
}

}  // namespace sqslam::app
