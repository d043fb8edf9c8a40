#include <opencv2/dnn.hpp>

#include "slam/detection/network.h"

namespace sqslam {
namespace {

// OpenCV's message without its file and line.
std::string Reason(const cv::Exception& e) { return e.err.substr(0, e.err.find('\n')); }

class OpenCvNetwork final : public Network {
 public:
  explicit OpenCvNetwork(const std::string& file) : file_(file), network_(cv::dnn::readNetFromONNX(file)) {
    network_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    network_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  }

  std::vector<std::string> Outputs() const override { return network_.getUnconnectedOutLayersNames(); }

  std::vector<cv::Mat> Run(const cv::Mat& input, const std::vector<std::string>& outputs) override {
    std::vector<cv::Mat> blobs;
    try {
      network_.setInput(input);
      network_.forward(blobs, outputs);
    } catch (const cv::Exception& e) {
      throw NetworkError("{}: fails on an input of {}x{} ({})", file_, input.size[3], input.size[2],
                         Reason(e));
    }
    return blobs;
  }

 private:
  std::string file_;
  cv::dnn::Net network_;
};

}  // namespace

std::unique_ptr<Network> ReadByOpenCv(const std::string& file) {
  try {
    return std::make_unique<OpenCvNetwork>(file);
  } catch (const cv::Exception& e) {
    throw NetworkError("{}: cannot be read ({}), expected an ONNX network that OpenCV {} supports", file,
                       Reason(e), CV_VERSION);
  }
}

}  // namespace sqslam
