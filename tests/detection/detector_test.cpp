#include "slam/detection/detector.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>

#include "slam/util/error.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;

// An ONNX file by hand: field = number, wire type 2, length, bytes.
std::string Varint(std::uint64_t value) {
  std::string bytes;
  for (; value > 127; value >>= 7) {
    bytes += static_cast<char>((value & 127) | 128);
  }
  return bytes + static_cast<char>(value);
}
std::string Number(int field, std::uint64_t value) { return Varint(field << 3) + Varint(value); }
std::string Bytes(int field, const std::string& bytes) {
  return Varint(field << 3 | 2) + Varint(bytes.size()) + bytes;
}
std::string ValueInfo(const std::string& name, const std::vector<int>& sizes) {
  std::string shape;
  for (const int size : sizes) {
    shape += Bytes(1, Number(1, static_cast<std::uint64_t>(size)));
  }
  return Bytes(1, name) + Bytes(2, Bytes(1, Number(1, 1) + Bytes(2, shape)));
}

// A network whose output `output` is its input, of 3 planes, under another name: to the decoder 'centernet' a
// heatmap of three classes it is not, which is what the tests below are about.
std::string PassThrough() {
  const std::string node = Bytes(1, "images") + Bytes(2, "output") + Bytes(3, "relu") + Bytes(4, "Relu");
  const std::string graph = Bytes(1, node) + Bytes(2, "graph") +
                            Bytes(11, ValueInfo("images", {1, 3, 32, 64})) +
                            Bytes(12, ValueInfo("output", {1, 3, 32, 64}));
  return Number(1, 6) + Bytes(7, graph) + Bytes(8, Bytes(1, "") + Number(2, 11));
}

class DetectorTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = fs::temp_directory_path() / ("sqslam-network-" + std::to_string(::getpid()) + ".onnx");
    std::ofstream(file_, std::ios::binary) << PassThrough();
    options_.file = file_.string();
    options_.width = 64;
    options_.height = 32;
  }
  void TearDown() override { fs::remove(file_); }

  std::string Refusal() const {
    try {
      Detector detector(options_);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }

  fs::path file_;
  NetworkOptions options_;
};

TEST_F(DetectorTest, AFileThatIsNoNetworkIsRefusedByName) {
  std::ofstream(file_, std::ios::binary) << "not a network";
  EXPECT_NE(Refusal().find(file_.string()), std::string::npos);
  options_.file = "/no/such/file.onnx";
  EXPECT_NE(Refusal().find("/no/such/file.onnx"), std::string::npos);
}

TEST_F(DetectorTest, UnknownOutputsAreRefusedWithThoseThereAre) {
  options_.outputs = {"boxes"};
  const std::string refusal = Refusal();
  EXPECT_NE(refusal.find("boxes"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("[output]"), std::string::npos) << refusal;
}

TEST_F(DetectorTest, AnOutputOfAnotherShapeIsRefusedBeforeTheFirstImage) {
  const std::string refusal = Refusal();
  EXPECT_NE(refusal.find("1x3x32x64"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("1x42x85"), std::string::npos) << refusal;
}

TEST(LoadNetworkTest, UnknownNamesAndMissingWeightsSayWhatThereIs) {
  try {
    LoadNetwork("no-such-detector");
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_NE(std::string(e.what()).find("yolox-nano"), std::string::npos) << e.what();
  }
  const fs::path yaml =
      fs::temp_directory_path() / ("sqslam-detector-" + std::to_string(::getpid()) + ".yaml");
  std::ofstream(yaml) << "file: missing.onnx\n";
  EXPECT_THROW(LoadNetwork(yaml.string()), InputError);
  std::ofstream(yaml) << "file: missing.onnx\nwidht: 320\n";
  EXPECT_THROW(LoadNetwork(yaml.string()), UsageError);
  fs::remove(yaml);
}

// The real network, where it has been put.
TEST(DetectorWeightsTest, YoloxFindsNothingInAWhiteWallAndIsRepeatable) {
  NetworkOptions options;
  try {
    options = LoadNetwork("yolox-nano");
  } catch (const InputError& e) {
    GTEST_SKIP() << e.what();
  }
  Detector detector(options);
  EXPECT_TRUE(detector.Detect(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(255))).empty());
}

}  // namespace
}  // namespace sqslam
