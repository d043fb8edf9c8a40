#include "slam/detection/network.h"

namespace sqslam {

std::string OnnxRuntimeVersion() { return ""; }

std::unique_ptr<Network> ReadByOnnxRuntime(const std::string& file) {
  throw NetworkError("{}: needs ONNX Runtime, which is missing in this build", file);
}

}  // namespace sqslam
