#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "slam/util/error.h"

namespace sqslam {

// Thrown if an engine cannot read or run a network. The message names file, reason and expectation.
struct NetworkError : InputError {
  using InputError::InputError;
};

// A network, read from its ONNX file by one engine. Run() and the functions that read throw NetworkError.
class Network {
 public:
  virtual ~Network() = default;
  virtual std::vector<std::string> Outputs() const = 0;  // all names in the file

  // Returns the named outputs, 32F, for an input of 1 x 3 x height x width, 32F.
  virtual std::vector<cv::Mat> Run(const cv::Mat& input, const std::vector<std::string>& outputs) = 0;
};

std::unique_ptr<Network> ReadByOpenCv(const std::string& file);
std::unique_ptr<Network> ReadByOnnxRuntime(const std::string& file);

// Returns the version of ONNX Runtime; empty in a build without it.
std::string OnnxRuntimeVersion();

}  // namespace sqslam
