#include "slam/detection/detector.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <opencv2/dnn.hpp>
#include <string_view>

#include "slam/detection/decoders.h"
#include "slam/detection/network.h"
#include "slam/io/coco.h"
#include "slam/io/image_header.h"
#include "slam/util/data_path.h"
#include "slam/util/enum_names.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kNoOnnxRuntime =
    "this build has no ONNX Runtime, which supports more networks: install libonnxruntime-dev (Debian 13) "
    "and "
    "build again";

std::vector<std::string> ClassNames(const NetworkOptions& options) {
  if (options.classes.empty()) {
    return {kCocoNames.begin(), kCocoNames.end()};
  }
  return ToVector(options.classes, [](const std::string& name) { return NormalizedLabel(ValidLabel(name)); });
}

std::vector<std::string> OutputNames(const Network& network, const NetworkOptions& options) {
  const std::vector<std::string> existing = network.Outputs();
  const std::size_t needed = options.decoder == NetworkDecoder::kCenterNet ? 2 : 1;
  const std::vector<std::string>& wanted = options.outputs.empty() ? existing : options.outputs;
  const bool known = std::ranges::all_of(
      wanted, [&](const std::string& name) { return std::ranges::find(existing, name) != existing.end(); });
  if (!known || wanted.size() != needed) {
    throw InputError("{}: outputs [{}] for the decoder '{}', expected {} of [{}]", options.file,
                     fmt::join(wanted, ", "), NameOf(options.decoder), needed, fmt::join(existing, ", "));
  }
  return wanted;
}

fs::path FindWeights(const fs::path& yaml, const std::string& file) {
  std::vector<fs::path> places = {yaml.parent_path() / file};
  try {
    places.push_back(DataPath("assets") / "detectors" / file);
  } catch (const InputError&) {  // no assets: search only beside the YAML file
  }
  std::vector<std::string> names;
  for (const fs::path& place : places) {
    if (fs::is_regular_file(place)) {
      return fs::absolute(place);
    }
    names.push_back(place.string());
  }
  throw InputError(
      "{}: its weights '{}' are missing, expected one of {}; scripts/fetch-detector.sh downloads a network",
      yaml.string(), file, fmt::join(names, ", "));
}

}  // namespace

Detector::Detector(const NetworkOptions& options) : options_(options), classes_(ClassNames(options)) {
  if (options.engine != NetworkEngine::kAuto) {
    Start();
    return;
  }
  options_.engine = NetworkEngine::kOpenCv;
  try {
    Start();
  } catch (const NetworkError& e) {
    if (OnnxRuntimeVersion().empty()) {
      throw InputError("{}; {}", e.what(), kNoOnnxRuntime);
    }
    options_.engine = NetworkEngine::kOnnxRuntime;
    Start();
  }
}

Detector::~Detector() = default;

void Detector::Start() {
  const bool by_onnxruntime = options_.engine == NetworkEngine::kOnnxRuntime;
  ThrowIf<UsageError>(by_onnxruntime && OnnxRuntimeVersion().empty(), "engine 'onnxruntime': {}",
                      kNoOnnxRuntime);
  network_ = by_onnxruntime ? ReadByOnnxRuntime(options_.file) : ReadByOpenCv(options_.file);
  outputs_ = OutputNames(*network_, options_);
  Run(cv::Mat::zeros(options_.InputSize(), CV_8UC3));
}

std::vector<ScoredBox> Detector::Run(const cv::Mat& input) {
  const std::vector<cv::Mat> blobs = network_->Run(
      cv::dnn::blobFromImage(input, options_.scale, {}, {}, options_.color == ChannelOrder::kRgb), outputs_);
  const int classes = static_cast<int>(classes_.size());
  try {
    switch (options_.decoder) {
      case NetworkDecoder::kCenterNet:  // more peaks than boxes: non-maximum suppression follows
        return DecodeCenterNet(blobs[0], blobs[1], options_.InputSize(), classes, options_.threshold,
                               4 * options_.max_boxes);
      case NetworkDecoder::kYoloV8:
        return DecodeYoloV8(blobs[0], classes, options_.threshold);
      default:
        return DecodeYolox(blobs[0], options_.InputSize(), classes, options_.threshold);
    }
  } catch (const InputError& e) {
    throw InputError("{}: {}", options_.file, e.what());
  }
}

std::vector<Detection> DetectIn(const Frame& frame, ObjectDetector& detector) {
  const cv::Mat upright = Turned(frame.bgr, -frame.quarter_turns);
  std::vector<Detection> detections = detector.Detect(upright);
  for (Detection& detection : detections) {
    detection.box = Turned(detection.box, upright.size(), frame.quarter_turns, frame.bgr.size());
  }
  return detections;
}

std::vector<Detection> Detector::Detect(const cv::Mat& bgr) {
  const Letterbox letterbox(bgr.size(), options_.InputSize());
  std::vector<Detection> detections;
  for (const ScoredBox& scored : SuppressNonMaxima(Run(letterbox.Fill(bgr)), options_.suppression_iou)) {
    const Box2d box = letterbox.ToImage(scored.box);
    if (box.Area() >= options_.min_area && static_cast<int>(detections.size()) < options_.max_boxes) {
      detections.push_back({classes_[scored.class_number], scored.score, box});
    }
  }
  return detections;
}

std::string Detector::Name() const { return fs::path(options_.file).filename().string(); }
std::string Detector::Settings() const { return Fingerprint(options_); }

NetworkOptions LoadNetwork(const std::string& name_or_file, const std::vector<std::string>& settings) {
  const fs::path path = ConfigFile("configs/detectors", "detector", name_or_file);
  NetworkOptions options;
  LoadOptions(path, options);
  SetOptions(settings, options);
  CheckOptions(options);
  ThrowIf<UsageError>(options.file.empty(), "{}: no 'file', expected the name of an .onnx file",
                      path.string());
  ThrowIf<UsageError>(options.width % 32 != 0 || options.height % 32 != 0,
                      "{}: input of {}x{}, expected multiples of 32", path.string(), options.width,
                      options.height);
  options.file = FindWeights(path, options.file).string();
  return options;
}

std::optional<NetworkOptions> ChooseNetwork(const std::string& name_or_file,
                                            const std::vector<std::string>& settings) {
  if (name_or_file != "auto") {
    return LoadNetwork(name_or_file, settings);
  }
  for (const char* name : {"yolox-nano", "centernet"}) {  // the better one first
    try {
      return LoadNetwork(name, settings);
    } catch (const InputError&) {  // its weights are missing
    }
  }
  return std::nullopt;
}

std::string Fingerprint(const NetworkOptions& options) {
  const std::string weights = ReadFile(options.file, "the weights of a network");
  const auto* bytes = reinterpret_cast<const Bytef*>(weights.data());
  std::string line = DumpOptions(options);
  std::ranges::replace(line, '\n', ' ');
  return fmt::format("{}weights: {:08x}", line, crc32_z(0, bytes, weights.size()));
}

}  // namespace sqslam
