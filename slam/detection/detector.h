#pragma once

#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/io/frame.h"

namespace sqslam {

class Network;
struct ScoredBox;

// Layout of the boxes in the network's output.
enum class NetworkDecoder { kYolox, kCenterNet, kYoloV8 };
constexpr auto EnumNames(NetworkDecoder) { return std::array{"yolox", "centernet", "yolov8"}; }

// Order of the channels of the network's input.
enum class ChannelOrder { kBgr, kRgb };
constexpr auto EnumNames(ChannelOrder) { return std::array{"bgr", "rgb"}; }

// Library that runs the network. Auto: OpenCV, and ONNX Runtime for networks that OpenCV cannot run.
enum class NetworkEngine { kAuto, kOpenCv, kOnnxRuntime };
constexpr auto EnumNames(NetworkEngine) { return std::array{"auto", "opencv", "onnxruntime"}; }

// Input and output of a detector's ONNX file: the YAML file beside its weights.
struct NetworkOptions {
  std::string file;  // weights (.onnx): absolute, beside the YAML file, or in assets/detectors
  NetworkEngine engine = NetworkEngine::kAuto;
  NetworkDecoder decoder = NetworkDecoder::kYolox;
  int width = 640;  // input, pixels; a multiple of 32
  int height = 480;
  ChannelOrder color = ChannelOrder::kBgr;
  double scale = 1.0;                // factor on pixel values of 0 to 255
  std::vector<std::string> outputs;  // names, in the order that the decoder expects; none: the file's own
  std::vector<std::string> classes;  // names in the order of class numbers; none: the 80 of COCO
  double threshold = 0.25;           // minimum score of a box, [0, 1]
  double suppression_iou = 0.5;      // IoU above which the weaker of two boxes of one class is dropped
  double min_area = 16.0;            // smaller boxes are dropped, pixels^2 of the image; at least 1
  int max_boxes = 100;               // per image, strongest first

  void VisitFields(auto&& visit) {
    visit("file", file);
    visit("engine", engine);
    visit("decoder", decoder);
    visit("width", width, 32, 4096);
    visit("height", height, 32, 4096);
    visit("color", color);
    visit("scale", scale, 1e-6, 1000.0);
    visit("outputs", outputs);
    visit("classes", classes);
    visit("threshold", threshold, 0.0, 1.0);
    visit("suppression_iou", suppression_iou, 0.0, 1.0);
    visit("min_area", min_area, 1.0, 1e9);
    visit("max_boxes", max_boxes, 1, 10000);
  }

  cv::Size InputSize() const { return {width, height}; }
};

// Loads a network by the name of its file in configs/detectors or from a YAML file, with `settings`
// (key=value) applied on top. `file` is then an existing absolute path. Throws UsageError for unknown names
// and bad values, and InputError if the weights are missing, with the places searched and how to fetch them.
NetworkOptions LoadNetwork(const std::string& name_or_file, const std::vector<std::string>& settings = {});

// Like LoadNetwork, but "auto" is the best network of configs/detectors with existing weights; nothing if no
// weights exist.
std::optional<NetworkOptions> ChooseNetwork(const std::string& name_or_file,
                                            const std::vector<std::string>& settings = {});

// Returns everything that boxes depend on in one line: all options, and a checksum of the weights.
std::string Fingerprint(const NetworkOptions& options);

// Finds objects in images: a network, or a detector of the embedding program (RunRequest::detector). Not
// thread-safe.
class ObjectDetector {
 public:
  virtual ~ObjectDetector() = default;

  // Returns the boxes of an image (8UC3) in its own pixels, clipped to it, strongest first; labels have no
  // blanks. An exception ends the run, which saves its map first.
  virtual std::vector<Detection> Detect(const cv::Mat& bgr) = 0;

  virtual std::string Name() const { return "a detector of the program's own"; }  // for display
  virtual std::string Settings() const { return Name(); }  // everything that boxes depend on, in one line
};

// Returns the boxes of a frame in its own pixels. The detector sees the image upright, as people do, if the
// frame was turned.
std::vector<Detection> DetectIn(const Frame& frame, ObjectDetector& detector);

// A network, run on the CPU by OpenCV or ONNX Runtime, with as many threads as OpenCV uses.
class Detector final : public ObjectDetector {
 public:
  // Throws InputError with the file name if the engine cannot read the network, for unknown output names
  // (listing the existing ones), and for an output shape that does not fit the decoder or the number of
  // classes (found by a trial run). Throws UsageError for ONNX Runtime in a build without it.
  explicit Detector(const NetworkOptions& options);
  ~Detector() override;

  std::vector<Detection> Detect(const cv::Mat& bgr) override;
  std::string Name() const override;  // file name of the weights
  std::string Settings() const override;

 private:
  void Start();  // reads the network with the engine of the options, and runs it once
  std::vector<ScoredBox> Run(const cv::Mat& input);

  NetworkOptions options_;  // with the chosen engine
  std::vector<std::string> classes_;
  std::unique_ptr<Network> network_;
  std::vector<std::string> outputs_;
};

}  // namespace sqslam
