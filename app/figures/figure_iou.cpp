#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "app/figures/figure_common.h"
#include "render/figures/chart_figures.h"
#include "render/page/panels.h"
#include "render/page/write_figure.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kIouFooter = R"(
From the eval.json of results held against one ground truth (sqslam eval writes it): a bar for each ground-truth
object, and at the right the means over the objects shown, one that was not found counting 0. --objects says
which are shown: found (in at least one of the results; the default), scored (those whose ground truth fixes the
shape), all. --ellipsoids adds each result's objects with both exponents set to 1, in the same place and size.

Examples:
  sqslam figure iou out/desk --output iou.pdf
  sqslam figure iou out/desk --ellipsoids --output shape.pdf
  sqslam figure iou out/sq out/quadric --name superquadrics --name quadrics --output iou.png --width-mm 180
)";

struct IouArguments : FigureArguments {
  std::vector<std::string> results;
  std::vector<std::string> names;
  std::string objects = "found";
  bool ellipsoids = false;
};

struct Score {
  double iou = 0.0;
  double ellipsoid = 0.0;
};

struct TruthObject {
  std::string name;
  bool scored = false;
  bool found = false;  // by any of the results
};

struct Scores {
  std::string ground_truth;
  std::map<int, TruthObject> objects;  // by ground-truth number
  std::map<int, Score> found;
};

Scores ReadScores(const fs::path& path) {
  try {
    const auto eval = nlohmann::json::parse(ReadFile(path, "an eval.json"));
    Scores scores;
    scores.ground_truth = eval.at("ground_truth").get<std::string>();
    if (!eval.contains("objects")) {
      throw InputError(
          fmt::format("{}: knows no objects, expected an evaluation against objects_gt.json", path.string()));
    }
    const auto add = [&scores](const nlohmann::json& entry) {
      const int id = entry.at("ground_truth").get<int>();
      scores.objects[id] = {entry.at("name").get<std::string>(), entry.at("scored").get<bool>(), false};
      return id;
    };
    for (const auto& entry : eval.at("objects").at("matched")) {
      const int id = add(entry);
      scores.found[id] = {entry.at("iou").get<double>(), entry.at("iou_ellipsoid").get<double>()};
    }
    for (const auto& entry : eval.at("objects").at("missed")) {
      add(entry);
    }
    return scores;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(
        fmt::format("{}: expected an eval.json as sqslam eval writes it ({})", path.string(), error.what()));
  }
}

std::vector<Scores> ReadAll(const std::vector<std::string>& results) {
  std::vector<Scores> all;
  for (const fs::path result : results) {
    const fs::path path = fs::is_directory(result) ? result / "eval.json" : result;
    if (!fs::exists(path)) {
      throw InputError(fmt::format("{}: missing, expected sqslam eval RESULT --ground-truth SEQUENCE first",
                                   path.string()));
    }
    all.push_back(ReadScores(path));
    if (all.back().objects.size() != all.front().objects.size() ||
        all.back().ground_truth != all.front().ground_truth) {
      throw InputError(fmt::format("{}: evaluated against {}, expected {} as for {}", path.string(),
                                   all.back().ground_truth, all.front().ground_truth, results.front()));
    }
  }
  return all;
}

// Objects to show by ground-truth number; names that several carry are told apart by it.
std::map<int, std::string> Shown(const std::vector<Scores>& all, const std::string& which) {
  std::map<int, TruthObject> objects = all.front().objects;
  for (const Scores& scores : all) {
    for (const auto& [id, score] : scores.found) {
      objects[id].found = true;
    }
  }
  std::map<std::string, int> uses;
  for (const auto& [id, object] : objects) {
    ++uses[object.name];
  }
  std::map<int, std::string> shown;
  for (const auto& [id, object] : objects) {
    if (which == "all" || (which == "scored" ? object.scored : object.found)) {
      const std::string name = ReadableLabel(object.name);
      shown[id] = uses[object.name] > 1 ? fmt::format("{} {}", name, id) : name;
    }
  }
  return shown;
}

void Draw(const IouArguments& a) {
  const FigureOptions options = MakeFigureOptions(a);
  const std::vector<std::string> names = NamesOf(a.results, a.names);
  const std::vector<Scores> all = ReadAll(a.results);
  const std::map<int, std::string> shown = Shown(all, a.objects);
  if (shown.empty()) {
    throw InputError(fmt::format("{}: no object to show, expected one that was found (or --objects all)",
                                 fmt::join(a.results, ", ")));
  }
  IouFigure figure;
  for (const auto& [id, name] : shown) {
    figure.objects.push_back(name);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    IouFigure::Series series{all.size() == 1 ? "superquadrics" : names[i], {}};
    IouFigure::Series ellipsoids{all.size() == 1 ? "as ellipsoids" : names[i] + " as ellipsoids", {}};
    if (all.size() == 1 && !a.names.empty()) {
      series.name = names[i];
    }
    for (const auto& [id, name] : shown) {
      const auto found = all[i].found.find(id);
      const bool is = found != all[i].found.end();
      series.values.push_back(is ? std::optional(found->second.iou) : std::nullopt);
      ellipsoids.values.push_back(is ? std::optional(found->second.ellipsoid) : std::nullopt);
    }
    figure.series.push_back(std::move(series));
    if (a.ellipsoids) {
      figure.series.push_back(std::move(ellipsoids));
    }
  }
  WriteFigure(DrawIou(figure, options), a.output);
}

}  // namespace

void AddIouFigure(CLI::App& figure) {
  const auto a = std::make_shared<IouArguments>();
  CLI::App* command = AddFigure(figure, "iou", "3D IoU of each object, and the means, of one or more results",
                                kIouFooter, FigureKind::kChart, *a);
  command->add_option("RESULT", a->results, "Result folders that hold eval.json, or such files")->required();
  command->add_option("--name", a->names, "Name of a result in the legend, repeatable, in their order")
      ->expected(1)
      ->take_all();
  command->add_option("--objects", a->objects, "found, scored or all")
      ->check(CLI::IsMember({"found", "scored", "all"}))
      ->capture_default_str();
  command->add_flag("--ellipsoids", a->ellipsoids, "Also as ellipsoids");
  command->callback([a] { Draw(*a); });
}

}  // namespace sqslam::app
