#include <onnxruntime_cxx_api.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "slam/detection/network.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// ONNX Runtime's message on one line; the sizes that it expects stand on the later ones.
std::string Reason(const Ort::Exception& e) {
  std::string text = e.what();
  text.erase(text.find_last_not_of(" \n") + 1);
  std::ranges::replace(text, '\n', ' ');
  return text;
}

Ort::SessionOptions SessionOptions() {
  Ort::SessionOptions options;
  // As many threads as OpenCV uses. A fixed number also keeps results equal from run to run.
  options.SetIntraOpNumThreads(std::max(1, cv::getNumThreads()));
  // Waiting threads would otherwise keep the cores busy that tracking and mapping need.
  options.AddConfigEntry("session.intra_op.allow_spinning", "0");
  return options;
}

class OnnxRuntimeNetwork final : public Network {
 public:
  explicit OnnxRuntimeNetwork(const std::string& file)
      : file_(file),
        environment_(ORT_LOGGING_LEVEL_FATAL, "sqslam"),  // errors come as exceptions
        session_(environment_, file.c_str(), SessionOptions()) {
    if (session_.GetInputCount() != 1) {
      throw NetworkError("{}: has {} inputs, expected one, an image", file, session_.GetInputCount());
    }
    input_ = session_.GetInputNameAllocated(0, allocator_).get();
    for (std::size_t i = 0; i < session_.GetOutputCount(); ++i) {
      outputs_.emplace_back(session_.GetOutputNameAllocated(i, allocator_).get());
    }
  }

  std::vector<std::string> Outputs() const override { return outputs_; }

  std::vector<cv::Mat> Run(const cv::Mat& input, const std::vector<std::string>& outputs) override {
    try {
      const std::array<std::int64_t, 4> shape = {input.size[0], input.size[1], input.size[2], input.size[3]};
      const Ort::MemoryInfo memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
      const auto image = Ort::Value::CreateTensor<float>(memory, const_cast<float*>(input.ptr<float>()),
                                                         input.total(), shape.data(), shape.size());
      const char* name = input_.c_str();
      const auto names = ToVector(outputs, [](const std::string& output) { return output.c_str(); });
      const std::vector<Ort::Value> values =
          session_.Run(Ort::RunOptions(), &name, &image, 1, names.data(), names.size());
      return ToVector(values, [&](const Ort::Value& value) { return Blob(value); });
    } catch (const Ort::Exception& e) {
      throw NetworkError("{}: fails on an input of {}x{} ({})", file_, input.size[3], input.size[2],
                         Reason(e));
    }
  }

 private:
  cv::Mat Blob(const Ort::Value& value) const {
    if (!value.IsTensor() ||
        value.GetTensorTypeAndShapeInfo().GetElementType() != ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT) {
      throw NetworkError("{}: an output is not a tensor of 32-bit floats, as the decoders expect", file_);
    }
    const auto sizes = ToVector(value.GetTensorTypeAndShapeInfo().GetShape(),
                                [](std::int64_t size) { return static_cast<int>(size); });
    return cv::Mat(sizes, CV_32F, const_cast<float*>(value.GetTensorData<float>())).clone();
  }

  std::string file_;
  Ort::Env environment_;
  Ort::AllocatorWithDefaultOptions allocator_;
  Ort::Session session_;
  std::string input_;
  std::vector<std::string> outputs_;
};

}  // namespace

std::string OnnxRuntimeVersion() { return Ort::GetVersionString(); }

std::unique_ptr<Network> ReadByOnnxRuntime(const std::string& file) {
  try {
    return std::make_unique<OnnxRuntimeNetwork>(file);
  } catch (const Ort::Exception& e) {
    throw NetworkError("{}: cannot be read ({}), expected an ONNX network that ONNX Runtime {} supports",
                       file, Reason(e), Ort::GetVersionString());
  }
}

}  // namespace sqslam
