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
    "this build has no ONNX Runtime, which knows more networks: install libonnxruntime-dev (Debian 13) and "
    "build again";

std::vector<std::string> ClassNames(const NetworkOptions& options) {
  if (options.classes.empty()) {
    return {kCocoNames.begin(), kCocoNames.end()};
  }
  return ToVector(options.classes, [](const std::string& name) { return NormalizedLabel(ValidLabel(name)); });
}

std::vector<std::string> OutputNames(const Network& network, const NetworkOptions& options) {
  const std::vector<std::string> there = network.Outputs();
  const std::size_t needed = options.decoder == NetworkDecoder::kCenterNet ? 2 : 1;
  const std::vector<std::string>& wanted = options.outputs.empty() ? there : options.outputs;
  const bool known = std::ranges::all_of(
      wanted, [&](const std::string& name) { return std::ranges::find(there, name) != there.end(); });
  if (!known || wanted.size() != needed) {
    throw InputError("{}: outputs [{}] for the decoder '{}', expected {} of [{}]", options.file,
                     fmt::join(wanted, ", "), NameOf(options.decoder), needed, fmt::join(there, ", "));
  }
  return wanted;
}

fs::path FindWeights(const fs::path& yaml, const std::string& file) {
  std::vector<fs::path> places = {yaml.parent_path() / file};
  try {
    places.push_back(DataPath("assets") / "detectors" / file);
  } catch (const InputError&) {  // no assets: only the place beside the YAML file is left
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

struct Detector::Impl {
  explicit Impl(const NetworkOptions& wanted) : options(wanted), classes(ClassNames(options)) {
    if (options.engine != NetworkEngine::kAuto) {
      Start();
      return;
    }
    options.engine = NetworkEngine::kOpenCv;
    try {
      Start();
    } catch (const NetworkError& e) {
      if (OnnxRuntimeVersion().empty()) {
        throw InputError("{}; {}", e.what(), kNoOnnxRuntime);
      }
      options.engine = NetworkEngine::kOnnxRuntime;
      Start();
    }
  }

  // Reads the network by the engine of the options, and tries it.
  void Start() {
    ThrowIf<UsageError>(options.engine == NetworkEngine::kOnnxRuntime && OnnxRuntimeVersion().empty(),
                        "engine 'onnxruntime': {}", kNoOnnxRuntime);
    network = options.engine == NetworkEngine::kOnnxRuntime ? ReadByOnnxRuntime(options.file)
                                                            : ReadByOpenCv(options.file);
    outputs = OutputNames(*network, options);
    Run(cv::Mat::zeros(options.InputSize(), CV_8UC3));
  }

  std::vector<ScoredBox> Run(const cv::Mat& input) {
    const std::vector<cv::Mat> blobs = network->Run(
        cv::dnn::blobFromImage(input, options.scale, {}, {}, options.color == ChannelOrder::kRgb), outputs);
    try {
      return Decode(blobs);
    } catch (const InputError& e) {
      throw InputError("{}: {}", options.file, e.what());
    }
  }

  std::vector<ScoredBox> Decode(const std::vector<cv::Mat>& blobs) const {
    const int count = static_cast<int>(classes.size());
    if (options.decoder == NetworkDecoder::kCenterNet) {
      // Non-maximum suppression follows: decode more peaks than boxes are wanted.
      return DecodeCenterNet(blobs[0], blobs[1], options.InputSize(), count, options.threshold,
                             4 * options.max_boxes);
    }
    if (options.decoder == NetworkDecoder::kYoloV8) {
      return DecodeYoloV8(blobs[0], count, options.threshold);
    }
    return DecodeYolox(blobs[0], options.InputSize(), count, options.threshold);
  }

  NetworkOptions options;  // with the engine that was chosen
  std::vector<std::string> classes;
  std::unique_ptr<Network> network;
  std::vector<std::string> outputs;
};

Detector::Detector(const NetworkOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Detector::~Detector() = default;

std::vector<Detection> Detector::Detect(const cv::Mat& bgr) {
  const NetworkOptions& options = impl_->options;
  const Letterbox letterbox(bgr.size(), options.InputSize());
  std::vector<Detection> detections;
  for (const ScoredBox& scored :
       SuppressNonMaxima(impl_->Run(letterbox.Fill(bgr)), options.suppression_iou)) {
    const Box2d box = letterbox.ToImage(scored.box);
    if (box.Area() >= options.min_area && static_cast<int>(detections.size()) < options.max_boxes) {
      detections.push_back({impl_->classes[scored.class_number], scored.score, box});
    }
  }
  return detections;
}

std::string Detector::Name() const { return fs::path(impl_->options.file).filename().string(); }
std::string Detector::Settings() const { return Fingerprint(impl_->options); }

NetworkOptions LoadNetwork(const std::string& name_or_file, const std::vector<std::string>& settings) {
  const fs::path path = ConfigFile("configs/detectors", "detector", name_or_file);
  NetworkOptions options;
  LoadOptions(path, options);
  for (const std::string& setting : settings) {
    SetOption(setting, options);
  }
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
  NetworkOptions all = options;
  std::vector<OptionField> fields = OptionFields(all);
  if (options.engine != NetworkEngine::kOnnxRuntime) {  // as lines were before there was a choice
    std::erase_if(fields, [](const OptionField& field) { return field.key == "engine"; });
  }
  std::string line = DumpOptionFields(fields);
  std::ranges::replace(line, '\n', ' ');
  return fmt::format("{}weights: {:08x}", line, crc32_z(0, bytes, weights.size()));
}

}  // namespace sqslam
