#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/page/figure_options.h"
#include "slam/util/options.h"

namespace sqslam {

// Told at the start and after each picture; may be null.
using FigureProgress = std::function<void(int done, int total)>;
inline void Tell(const FigureProgress& progress, int done, int total) {
  if (progress) {
    progress(done, total);
  }
}

// The image of a frame, 8UC3.
using FrameImages = std::function<cv::Mat(std::int64_t frame)>;

// The request for a figure, beside its own options. Empty lists leave the choice to the figure.
struct FigureRequest {
  FigureOptions page;
  std::vector<std::string> results;  // folders or files
  std::vector<std::string> names;    // of the results, in their order
  std::vector<int> objects;          // ids
  std::vector<std::int64_t> frames;
  FigureProgress progress;
  // The frames of the video that a result was mapped from; null where there is none.
  std::function<FrameImages(const std::string& result)> video_of;
};

// An option of a figure's own, as a command line offers it.
struct FigureOption {
  std::string names;  // with the word that stands for the value: "--columns N"
  std::string help;
  OptionField field;
};

// The visitor that options of figures are written for: that of slam/util/options.h with help texts.
class FigureOptionCollector {
 public:
  explicit FigureOptionCollector(std::vector<FigureOption>& options) : options_(options) {}

  template <typename Value, typename... Limits>
  void operator()(std::string_view names, std::string_view help, Value& value, const Limits&... limits) {
    std::vector<OptionField> fields;
    OptionCollector(fields, "")(names, value, limits...);
    options_.push_back({std::string(names), std::string(help), std::move(fields.front())});
  }
  void operator()(std::string_view names, std::string_view help, std::string& value,
                  std::initializer_list<const char*> allowed) {
    (*this)(names, help, value);
    options_.back().field.allowed.assign(allowed.begin(), allowed.end());
  }

 private:
  std::vector<FigureOption>& options_;
};

// One drawing to be made: `options` may be changed until `draw` is called.
struct FigureTask {
  std::vector<FigureOption> options;
  std::function<FigurePage(const FigureRequest&)> draw;
};

// A figure as `sqslam figure NAME` offers it: what it takes, and how it is drawn.
struct FigureEntry {
  std::string name{};
  std::string help{};          // one line
  std::string details{};       // with examples, below the options
  std::string results_help{};  // empty: takes no results
  bool several = false;        // results, frames
  std::string names_help{};    // empty: takes no names of results
  bool objects = false;
  std::string frames_help{};                   // empty: takes no frames
  bool pictures = false;                       // draws maps: takes a rendering back end
  bool view = false;                           // takes camera angles
  void (*adapt_style)(SceneStyle&) = nullptr;  // to what looks best here; before the user's own settings
  std::function<FigureTask()> make{};

  // A figure whose options are a struct with VisitFields. `draw` throws InputError or UsageError.
  template <typename Options>
  static std::function<FigureTask()> Maker(FigurePage (*draw)(const FigureRequest&, const Options&)) {
    return [draw] {
      const auto options = std::make_shared<Options>();
      FigureTask task;
      options->VisitFields(FigureOptionCollector(task.options));
      task.draw = [options, draw](const FigureRequest& request) { return draw(request, *options); };
      return task;
    };
  }
  static std::function<FigureTask()> Maker(FigurePage (*draw)(const FigureRequest&)) {
    return [draw] { return FigureTask{{}, draw}; };
  }
};

}  // namespace sqslam
