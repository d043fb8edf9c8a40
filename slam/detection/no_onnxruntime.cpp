#include "slam/detection/network.h"

namespace sqslam {

bool HasOnnxRuntime() { return false; }

std::unique_ptr<Network> ReadByOnnxRuntime(const std::string& file) {
  throw NetworkError("{}: needs ONNX Runtime, which this build has not", file);
}

}  // namespace sqslam
