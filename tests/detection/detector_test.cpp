#include "slam/detection/detector.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>

#include "slam/detection/network.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "tests/detection/hand_made_network.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;

class DetectorTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = fs::temp_directory_path() / ("sqslam-network-" + std::to_string(::getpid()) + ".onnx");
    std::ofstream(file_, std::ios::binary) << HandMadeNetwork::PassThrough();
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

  // Writes a network that finds blocks of one colour in the image below.
  void WriteBlockFinder(const std::string& bytes) {
    std::ofstream(file_, std::ios::binary) << bytes;
    options_.decoder = NetworkDecoder::kCenterNet;
    options_.outputs = {"heatmap", "ltrb"};
    options_.classes = {"blue thing", "green_thing", "red_thing"};
    options_.scale = 1.0 / 255.0;
    options_.threshold = 0.5;
  }
  // Twice as large as the input, with a blue block in cell (5, 3) of the input.
  static cv::Mat BlueBlock() {
    cv::Mat image(64, 128, CV_8UC3, cv::Scalar::all(0));
    cv::Mat(image, cv::Rect(40, 24, 8, 8)).setTo(cv::Scalar(230, 0, 0));
    return image;
  }

  fs::path file_;
  NetworkOptions options_;
};

TEST_F(DetectorTest, RefusesFilesThatAreNoNetwork) {
  std::ofstream(file_, std::ios::binary) << "not a network";
  EXPECT_NE(Refusal().find(file_.string()), std::string::npos);
  options_.file = "/no/such/file.onnx";
  EXPECT_NE(Refusal().find("/no/such/file.onnx"), std::string::npos);
}

TEST_F(DetectorTest, AutoTakesFirstNetworkWithWeights) {
  const std::optional<NetworkOptions> chosen = ChooseNetwork("auto", {"file=" + file_.string()});
  ASSERT_TRUE(chosen.has_value());
  EXPECT_EQ(DumpOptions(*chosen), DumpOptions(LoadNetwork("yolox-nano", {"file=" + file_.string()})));
  EXPECT_FALSE(ChooseNetwork("auto", {"file=/no/such/file.onnx"}).has_value());
  EXPECT_THROW(ChooseNetwork("centernet", {"file=/no/such/file.onnx"}), InputError);
  EXPECT_THROW(ChooseNetwork("yolo-nano"), UsageError);
}

TEST_F(DetectorTest, RefusesUnknownOutputsListingKnownOnes) {
  options_.outputs = {"boxes"};
  const std::string refusal = Refusal();
  EXPECT_NE(refusal.find("boxes"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("[output]"), std::string::npos) << refusal;
}

TEST_F(DetectorTest, RefusesWrongOutputShapeBeforeFirstImage) {
  const std::string refusal = Refusal();
  EXPECT_NE(refusal.find("1x3x32x64"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("1x42x85"), std::string::npos) << refusal;
}

// The image is twice as large as the input.
TEST_F(DetectorTest, DetectsColouredBlockInImagePixels) {
  WriteBlockFinder(HandMadeNetwork::ChannelsAsClasses());
  const cv::Mat image = BlueBlock();
  const std::vector<Detection> found = Detector(options_).Detect(image);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].label, "blue_thing");
  EXPECT_NEAR(found[0].score, 230.0 / 255.0, 1e-3);
  EXPECT_NEAR(found[0].box.x, 2 * (4 * 5 - 8), 1e-3);
  EXPECT_NEAR(found[0].box.y, 2 * (4 * 3 - 8), 1e-3);
  EXPECT_NEAR(found[0].box.width, 32.0, 1e-3);
  EXPECT_NEAR(found[0].box.height, 32.0, 1e-3);

  options_.color = ChannelOrder::kRgb;
  EXPECT_EQ(Detector(options_).Detect(image).at(0).label, "red_thing");
  options_.min_area = 32.0 * 32.0 + 1.0;
  EXPECT_TRUE(Detector(options_).Detect(image).empty());
  options_.classes = {"one", "two"};
  EXPECT_NE(Refusal().find("1x3x8x16"), std::string::npos) << Refusal();
}

TEST_F(DetectorTest, FingerprintDependsOnOptionsAndWeights) {
  const std::string first = Fingerprint(options_);
  EXPECT_EQ(first.find('\n'), std::string::npos);
  options_.max_boxes = 7;
  EXPECT_NE(Fingerprint(options_), first);
  options_.max_boxes = NetworkOptions().max_boxes;
  EXPECT_EQ(Fingerprint(options_), first);
  std::ofstream(file_, std::ios::binary) << HandMadeNetwork::ChannelsAsClasses();
  EXPECT_NE(Fingerprint(options_), first);
}

TEST_F(DetectorTest, FingerprintNamesEngine) {
  options_.engine = NetworkEngine::kOnnxRuntime;
  EXPECT_NE(Fingerprint(options_).find("engine: onnxruntime"), std::string::npos);
}

TEST_F(DetectorTest, ExplainsHowToGetOnnxRuntime) {
  if (!OnnxRuntimeVersion().empty()) {
    GTEST_SKIP() << "this build has ONNX Runtime";
  }
  WriteBlockFinder(HandMadeNetwork::UnknownToOpenCv());
  const std::string refusal = Refusal();
  EXPECT_NE(refusal.find(file_.string()), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("no ONNX Runtime"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("libonnxruntime-dev"), std::string::npos) << refusal;
  EXPECT_EQ(refusal.find('\n'), std::string::npos) << refusal;
  options_.engine = NetworkEngine::kOpenCv;
  EXPECT_EQ(Refusal().find("ONNX Runtime"), std::string::npos) << Refusal();

  options_.engine = NetworkEngine::kOnnxRuntime;
  try {
    Detector detector(options_);
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_NE(std::string(e.what()).find("'onnxruntime'"), std::string::npos) << e.what();
  }
}

class OnnxRuntimeTest : public DetectorTest {
 protected:
  void SetUp() override {
    if (OnnxRuntimeVersion().empty()) {
      GTEST_SKIP() << "this build has no ONNX Runtime";
    }
    DetectorTest::SetUp();
    options_.engine = NetworkEngine::kOnnxRuntime;
  }
};

TEST_F(OnnxRuntimeTest, FindsSameBoxesAsOpenCv) {
  WriteBlockFinder(HandMadeNetwork::ChannelsAsClasses());
  const std::vector<Detection> found = Detector(options_).Detect(BlueBlock());
  options_.engine = NetworkEngine::kOpenCv;
  const std::vector<Detection> expected = Detector(options_).Detect(BlueBlock());
  ASSERT_EQ(expected.size(), 1U);
  ASSERT_EQ(found.size(), expected.size());
  EXPECT_EQ(found[0].label, expected[0].label);
  EXPECT_NEAR(found[0].score, expected[0].score, 1e-6);
  EXPECT_NEAR(found[0].box.x, expected[0].box.x, 1e-4);
  EXPECT_NEAR(found[0].box.y, expected[0].box.y, 1e-4);
  EXPECT_NEAR(found[0].box.width, expected[0].box.width, 1e-4);
  EXPECT_NEAR(found[0].box.height, expected[0].box.height, 1e-4);
}

TEST_F(OnnxRuntimeTest, RunsNetworksThatOpenCvDoesNotKnow) {
  WriteBlockFinder(HandMadeNetwork::UnknownToOpenCv());
  options_.scale /= 4.0;
  options_.engine = NetworkEngine::kOpenCv;
  EXPECT_FALSE(Refusal().empty());
  options_.engine = NetworkEngine::kAuto;
  Detector detector(options_);
  const std::vector<Detection> found = detector.Detect(BlueBlock());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].label, "blue_thing");
  EXPECT_NEAR(found[0].score, 230.0 / 255.0, 1e-3);
  EXPECT_NE(detector.Settings().find("engine: onnxruntime"), std::string::npos) << detector.Settings();
  WriteBlockFinder(HandMadeNetwork::ChannelsAsClasses());
  EXPECT_EQ(Detector(options_).Settings().find("onnxruntime"), std::string::npos);
}

TEST_F(OnnxRuntimeTest, RefusesSameFilesAsOpenCv) {
  EXPECT_NE(Refusal().find("1x3x32x64"), std::string::npos) << Refusal();
  options_.outputs = {"boxes"};
  EXPECT_NE(Refusal().find("[output]"), std::string::npos) << Refusal();
  options_.outputs = {};
  options_.width = 96;
  EXPECT_NE(Refusal().find("96x32"), std::string::npos) << Refusal();
  std::ofstream(file_, std::ios::binary) << "not a network";
  EXPECT_NE(Refusal().find(file_.string()), std::string::npos) << Refusal();
  EXPECT_NE(Refusal().find("ONNX Runtime"), std::string::npos) << Refusal();
}

TEST(LoadNetworkTest, ChecksSettingsLikeFile) {
  EXPECT_THROW(LoadNetwork("yolox-nano", {"width=330"}), UsageError);
  EXPECT_THROW(LoadNetwork("yolox-nano", {"file=missing.onnx"}), InputError);
}

TEST(LoadNetworkTest, ReportsUnknownNamesAndMissingWeights) {
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

// Tests colours, order of outputs and classes of the real network, if its weights are installed.
TEST(DetectorWeightsTest, YoloxFindsNothingInWhiteWall) {
  NetworkOptions options;
  try {
    options = LoadNetwork("yolox-nano");
  } catch (const InputError& e) {
    GTEST_SKIP() << e.what();
  }
  EXPECT_TRUE(Detector(options).Detect(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(255))).empty());
}

}  // namespace
}  // namespace sqslam
