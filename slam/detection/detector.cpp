#include "slam/detection/detector.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <opencv2/dnn.hpp>
#include <set>
#include <string>

#include "slam/detection/decoders.h"
#include "slam/io/coco.h"
#include "slam/util/enum_names.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

std::vector<std::string> ClassNames(const NetworkOptions& options) {
  if (options.classes.empty()) {
    return {kCocoNames.begin(), kCocoNames.end()};
  }
  std::vector<std::string> names;
  for (const std::string& name : options.classes) {
    names.push_back(NormalizedLabel(name));
  }
  return names;
}

// OpenCV's message without its file and line.
std::string Reason(const cv::Exception& e) { return e.err.substr(0, e.err.find('\n')); }

cv::dnn::Net ReadNetwork(const std::string& file) {
  try {
    return cv::dnn::readNetFromONNX(file);
  } catch (const cv::Exception& e) {
    throw InputError(fmt::format("{}: cannot be read ({}), expected an ONNX network that OpenCV {} knows",
                                 file, Reason(e), CV_VERSION));
  }
}

std::vector<std::string> OutputNames(const cv::dnn::Net& network, const NetworkOptions& options) {
  const std::vector<std::string> there = network.getUnconnectedOutLayersNames();
  const std::size_t needed = options.decoder == NetworkDecoder::kCenterNet ? 2 : 1;
  const std::vector<std::string>& wanted = options.outputs.empty() ? there : options.outputs;
  const bool known = std::all_of(wanted.begin(), wanted.end(), [&](const std::string& name) {
    return std::find(there.begin(), there.end(), name) != there.end();
  });
  if (!known || wanted.size() != needed) {
    throw InputError(fmt::format("{}: outputs [{}] for the decoder '{}', expected {} of [{}]", options.file,
                                 fmt::join(wanted, ", "), NameOf(options.decoder), needed,
                                 fmt::join(there, ", ")));
  }
  return wanted;
}

}  // namespace

struct Detector::Impl {
  explicit Impl(const NetworkOptions& wanted)
      : options(wanted),
        classes(ClassNames(options)),
        network(ReadNetwork(options.file)),
        outputs(OutputNames(network, options)) {
    network.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    network.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    Run(cv::Mat::zeros(options.InputSize(), CV_8UC3));
  }

  std::vector<ScoredBox> Run(const cv::Mat& input) {
    std::vector<cv::Mat> blobs;
    try {
      network.setInput(
          cv::dnn::blobFromImage(input, options.scale, {}, {}, options.color == ChannelOrder::kRgb));
      network.forward(blobs, outputs);
    } catch (const cv::Exception& e) {
      throw InputError(fmt::format("{}: fails on an input of {}x{} ({})", options.file, options.width,
                                   options.height, Reason(e)));
    }
    try {
      return Decode(blobs);
    } catch (const InputError& e) {
      throw InputError(fmt::format("{}: {}", options.file, e.what()));
    }
  }

  std::vector<ScoredBox> Decode(const std::vector<cv::Mat>& blobs) const {
    const int count = static_cast<int>(classes.size());
    if (options.decoder == NetworkDecoder::kCenterNet) {
      // Non-maximum suppression takes some out afterwards: more peaks than boxes are wanted.
      return DecodeCenterNet(blobs[0], blobs[1], options.InputSize(), count, options.threshold,
                             4 * options.max_boxes);
    }
    if (options.decoder == NetworkDecoder::kYoloV8) {
      return DecodeYoloV8(blobs[0], count, options.threshold);
    }
    return DecodeYolox(blobs[0], options.InputSize(), count, options.threshold);
  }

  NetworkOptions options;
  std::vector<std::string> classes;
  cv::dnn::Net network;
  std::vector<std::string> outputs;
};

Detector::Detector(const NetworkOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;

std::vector<Detection> Detector::Detect(const cv::Mat& bgr) {
  const NetworkOptions& options = impl_->options;
  const Letterbox letterbox(bgr.size(), options.InputSize());
  std::vector<Detection> detections;
  for (const ScoredBox& scored :
       SuppressNonMaxima(impl_->Run(letterbox.Fill(bgr)), options.suppression_iou)) {
    const Box2d box = letterbox.ToImage(scored.box);
    if (box.Area() >= options.min_area && static_cast<int>(detections.size()) < options.max_boxes) {
      detections.push_back(
          {impl_->classes[static_cast<std::size_t>(scored.class_number)], scored.score, box});
    }
  }
  return detections;
}

}  // namespace sqslam
