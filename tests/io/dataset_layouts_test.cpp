#include "slam/io/dataset_layouts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "slam/io/cameras.h"
#include "slam/io/image_files.h"
#include "slam/io/sequence.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kFps = 30.0;

std::vector<std::string> Names(const Sequence& sequence) {
  std::vector<std::string> names;
  for (const SequenceFrame& frame : sequence.frames) {
    names.push_back(frame.image_path.lexically_relative(sequence.path).string());
  }
  return names;
}

TEST(NumericLess, OrdersRunsOfDigitsAsNumbers) {
  EXPECT_TRUE(NumericLess("2.png", "10.png"));
  EXPECT_FALSE(NumericLess("10.png", "2.png"));
  EXPECT_TRUE(NumericLess("a9b2", "a9b10"));
  EXPECT_TRUE(NumericLess("a.png", "b.png"));
  EXPECT_TRUE(NumericLess("a", "a1"));
  EXPECT_FALSE(NumericLess("7", "7"));
  EXPECT_TRUE(NumericLess("99999999999999999999998.png", "99999999999999999999999.png"));
  EXPECT_NE(NumericLess("01.png", "1.png"), NumericLess("1.png", "01.png"));  // a total order
}

TEST(ImageFiles, RecognisesDepthImagesByName) {
  for (const char* name : {"00000-depth.png", "frame-000000.depth.png", "7_depth.PNG", "x-DEPTH.tif"}) {
    EXPECT_TRUE(IsDepthImage(name)) << name;
  }
  for (const char* name : {"00000-color.png", "depth.png", "depths-1.png", "in-depth-1.png"}) {
    EXPECT_FALSE(IsDepthImage(name)) << name;
  }
  EXPECT_EQ(LastNumber("scene_00_0012.png"), 12);
  EXPECT_EQ(LastNumber("frame-000123.color.png"), 123);
  EXPECT_EQ(LastNumber("no.png"), std::nullopt);
  EXPECT_EQ(LastNumber("99999999999999999999.png"), std::nullopt);
}

TEST(DatasetLayouts, FollowsIclNuimAssociations) {
  const TemporaryFolder folder;
  const CapturedLog log;
  folder.Write("associations.txt",
               "1 depth/1.png 1 rgb/1.png\n2 depth/2.png 2 rgb/2.png\n10 depth/10.png 10 rgb/10.png\n");
  folder.Write("rgb/1.png", "");
  folder.Write("livingRoom2.gt.freiburg", "");
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_EQ(sequence.format, SequenceFormat::kIclNuim);
  EXPECT_THAT(Names(sequence), ElementsAre("rgb/1.png", "rgb/2.png", "rgb/10.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[2].timestamp, 10 / kFps);
  EXPECT_EQ(sequence.camera.fx, 481.20);
  EXPECT_EQ(sequence.camera.fy, 480.0);
  EXPECT_THAT(log.Text(), HasSubstr("icl-nuim layout without camera.yaml, taken with --camera icl-nuim"));
}

TEST(DatasetLayouts, AcceptsColourImageFirstInAssociations) {
  const TemporaryFolder folder;
  folder.Write("associations.txt", "3 rgb/3.png 4 depth/4.png\n");
  folder.Write("rgb/3.png", "");
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_THAT(Names(sequence), ElementsAre("rgb/3.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[0].timestamp, 3 / kFps);
  folder.Write("associations.txt", "3 rgb/3.png 4 depth/4.png\n5 rgb/5.png\n");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }),
              HasSubstr("associations.txt:2: '5 rgb/5.png', expected"));
  folder.Write("associations.txt", "3 rgb/3.png 4 depth/4.png\nx rgb/5.png 5 depth/5.png\n");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }), HasSubstr("associations.txt:2:"));
}

TEST(DatasetLayouts, SortsIclNuimByNumberWithoutAssociations) {
  const TemporaryFolder folder;
  folder.Write("traj0.gt.freiburg", "");
  for (const char* name : {"rgb/10.png", "rgb/0.png", "rgb/2.png", "depth/0.png", "rgb/notes.txt"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_THAT(Names(sequence), ElementsAre("rgb/0.png", "rgb/2.png", "rgb/10.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[1].timestamp, 2 / kFps);  // image 1 is missing: a gap, no shift
}

TEST(DatasetLayouts, ReadsRenderedIclNuim) {
  const TemporaryFolder folder;
  for (const char* name :
       {"scene_00_0001.png", "scene_00_0000.png", "scene_00_0000.depth", "scene_00_0000.txt"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_EQ(sequence.format, SequenceFormat::kIclNuim);
  EXPECT_THAT(Names(sequence), ElementsAre("scene_00_0000.png", "scene_00_0001.png"));
}

TEST(DatasetLayouts, PicksColourImagesOfScenesV2) {
  const TemporaryFolder folder;
  for (const char* name : {"00001-color.png", "00001-depth.png", "00000-color.png", "00000-depth.png"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_EQ(sequence.format, SequenceFormat::kScenesV2);
  EXPECT_THAT(Names(sequence), ElementsAre("00000-color.png", "00001-color.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[1].timestamp, 1 / kFps);
  EXPECT_EQ(sequence.camera.fx, 570.3);
}

TEST(DatasetLayouts, PicksColourImagesOfSevenScenes) {
  const TemporaryFolder folder;
  for (const char* name : {"frame-000010.color.png", "frame-000010.depth.png", "frame-000010.pose.txt",
                           "frame-000009.color.png"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_EQ(sequence.format, SequenceFormat::k7Scenes);
  EXPECT_THAT(Names(sequence), ElementsAre("frame-000009.color.png", "frame-000010.color.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[0].timestamp, 9 / kFps);
  EXPECT_EQ(sequence.camera.fx, 525.0);
}

TEST(DatasetLayouts, PrefersFolderCameraToPreset) {
  const TemporaryFolder folder;
  const CapturedLog log;
  folder.Write("frame-000000.color.png", "");
  folder.Write("camera.yaml", "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 32\ncy: 24\nfps: 10\n");
  EXPECT_EQ(OpenSequence({.path = folder.Path(), .resize = "1"}).camera.fx, 50.0);
  EXPECT_EQ(log.Text(), "");
  EXPECT_EQ(OpenSequence({.path = folder.Path(), .camera = "kinect-v1", .resize = "1"}).camera.cx, 319.5);
}

TEST(DatasetLayouts, RecognisesTumCamerasByFolderName) {
  const TemporaryFolder folder;
  folder.Write("rgbd_dataset_freiburg2_desk/rgb.txt", "0.0 rgb/a.png\n");
  folder.Write("office/rgb.txt", "0.0 rgb/a.png\n");
  EXPECT_EQ(OpenSequence({.path = folder.Path() / "rgbd_dataset_freiburg2_desk", .resize = "1"}).camera.fx,
            520.9);
  EXPECT_EQ(PresetOf(SequenceFormat::kTum, folder.Path() / "rgbd_dataset_freiburg3_x" / ""), "tum-freiburg3");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path() / "office"}); }),
              AllOf(HasSubstr("camera.yaml: does not exist"), HasSubstr("--camera PRESET (7-scenes, ")));
}

TEST(DatasetLayouts, SortsPlainFoldersNumericallyWithoutDepth) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 32\ncy: 24\nfps: 10\n");
  for (const char* name : {"10.png", "2.png", "1.png", "1_depth.png", "2-depth.png"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_EQ(sequence.format, SequenceFormat::kImages);
  EXPECT_THAT(Names(sequence), ElementsAre("1.png", "2.png", "10.png"));
}

TEST(DatasetLayouts, NamesExpectedFilesWhenFormatDoesNotFit) {
  const TemporaryFolder folder;
  folder.Write("a.png", "");
  EXPECT_THAT(
      InputErrorOf([&] { OpenSequence({.path = folder.Path(), .format = SequenceFormat::k7Scenes}); }),
      HasSubstr("contains no image of the 7-scenes layout, expected names like frame-000000.color.png"));
  folder.Write("1-color.png", "");
  folder.Write("01-color.png", "");
  EXPECT_THAT(
      InputErrorOf([&] { OpenSequence({.path = folder.Path(), .format = SequenceFormat::kScenesV2}); }),
      HasSubstr("expected rising frame numbers"));
}

TEST(DatasetLayouts, SuggestsSequenceBelowFolder) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 32\ncy: 24\n");
  folder.Write("seq-02/frame-000000.color.png", "");
  folder.Write("seq-01/frame-000000.color.png", "");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }),
              AllOf(HasSubstr("no image in it"), HasSubstr("did you mean"), HasSubstr("seq-01?")));
}

TEST(DatasetLayouts, ReadsEurocTimesAndCamera) {
  const TemporaryFolder folder;
  folder.Write("mav0/cam0/data.csv",
               "#timestamp [ns],filename\r\n1403636579763555584,1403636579763555584.png\r\n"
               "1403636579813555456,1403636579813555456.png\r\n");
  folder.Write("mav0/cam0/data/1403636579763555584.png", "");
  folder.Write("mav0/cam0/sensor.yaml",
               "sensor_type: camera\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\n"
               "intrinsics: [458.654, 457.296, 367.215, 248.375]\ndistortion_model: radial-tangential\n"
               "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n");
  for (const char* below : {"", "mav0", "mav0/cam0"}) {
    const Sequence sequence = OpenSequence({.path = folder.Path() / below, .resize = "1"});
    EXPECT_EQ(sequence.format, SequenceFormat::kEuroc);
    ASSERT_EQ(sequence.frames.size(), 2U);
    EXPECT_EQ(sequence.frames[1].image_path.filename(), "1403636579813555456.png");
    EXPECT_NEAR(sequence.frames[1].timestamp - sequence.frames[0].timestamp, 0.05, 1e-6);
    EXPECT_EQ(sequence.camera.width, 752);
    EXPECT_EQ(sequence.camera.fy, 457.296);
    EXPECT_EQ(sequence.camera.distortion[1], 0.07395907);
    EXPECT_EQ(sequence.camera.fps, 20.0);
  }
  folder.Write("mav0/cam0/data.csv", "1.5,a.png\n");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }),
              HasSubstr("data.csv:1: '1.5,a.png', expected 'timestamp in ns,file'"));
}

TEST(DatasetLayouts, PrefersKittiColourCamera) {
  const TemporaryFolder folder;
  folder.Write("times.txt", "0.0\n0.1037\n0.2073\n");
  folder.Write(
      "calib.txt",
      "P0: 718.8 0 607.1 0 0 718.8 185.2 0 0 0 1 0\nP2: 700.5 0 600.1 45.3 0 701.5 180.2 0 0 0 1 0\n");
  cv::imwrite((folder.Path() / "0.png").string(), cv::Mat(96, 128, CV_8UC3));
  for (const char* camera : {"image_0", "image_2"}) {
    std::filesystem::create_directories(folder.Path() / camera);
    for (const char* name : {"000000.png", "000001.png", "000002.png"}) {
      std::filesystem::copy_file(folder.Path() / "0.png", folder.Path() / camera / name);
    }
  }
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_EQ(sequence.format, SequenceFormat::kKitti);
  EXPECT_THAT(Names(sequence), ElementsAre("image_2/000000.png", "image_2/000001.png", "image_2/000002.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[1].timestamp, 0.1037);
  EXPECT_EQ(sequence.camera.width, 128);
  EXPECT_EQ(sequence.camera.fx, 700.5);
  EXPECT_EQ(sequence.camera.fy, 701.5);
  EXPECT_EQ(sequence.camera.cy, 180.2);
  EXPECT_NEAR(sequence.camera.fps, 2 / 0.2073, 1e-6);
  cv::imwrite((folder.Path() / "image_2/000000.png").string(), cv::Mat(8, 128, CV_8UC3, cv::Scalar()));
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }),
              HasSubstr(": 128x8 pixels, expected sides from 16 to 16384"));
  folder.Write("calib.txt", "P2: 700.5 0\n");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }), HasSubstr("calib.txt:1: "));
}

TEST(ForeignCameras, ReadsKalibrAndRos) {
  const TemporaryFolder folder;
  folder.Write("kalibr.yaml",
               "cam0:\n  camera_model: pinhole\n  intrinsics: [461.6, 460.3, 363.0, 248.1]\n"
               "  distortion_model: radtan\n  distortion_coeffs: [-0.27, 0.06, 0.001, 0.002]\n"
               "  resolution: [752, 480]\n");
  const Camera kalibr = ReadCamera(folder.Path() / "kalibr.yaml");
  EXPECT_EQ(kalibr.height, 480);
  EXPECT_EQ(kalibr.cx, 363.0);
  EXPECT_EQ(kalibr.distortion[3], 0.002);
  EXPECT_EQ(kalibr.distortion[4], 0.0);
  folder.Write(
      "ros.yaml",
      "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [520.1, 0, 321.5, 0, 521.2, 239.5, 0, 0, 1]\ndistortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0.003, 0.004, 0.05]\n");
  const Camera ros = ReadCamera(folder.Path() / "ros.yaml");
  EXPECT_EQ(ros.width, 640);
  EXPECT_EQ(ros.fy, 521.2);
  EXPECT_EQ(ros.cx, 321.5);
  EXPECT_EQ(ros.distortion[4], 0.05);
  EXPECT_EQ(ros.lens, LensModel::kRadialTangential);
}

TEST(ForeignCameras, AcceptsRosMatricesAsLists) {
  const TemporaryFolder folder;
  const std::string size = "image_width: 640\nimage_height: 480\n";
  const std::string matrix = "camera_matrix: [520.1, 0, 321.5, 0, 521.2, 239.5, 0, 0, 1]\n";
  const Camera camera = ReadCamera(
      folder.Write("lists.yaml", size + matrix + "distortion_coefficients: [0.1, -0.2, 0.003, 0.004]\n"));
  EXPECT_EQ(camera.fy, 521.2);
  EXPECT_EQ(camera.cx, 321.5);
  EXPECT_EQ(camera.distortion[1], -0.2);
  const auto error_of = [&](const std::string& lines) {
    return InputErrorOf([&] { ReadCamera(folder.Write("bad.yaml", size + lines)); });
  };
  for (const std::string none : {"0", "{rows: 1, cols: 5}", "{data: 0}"}) {
    EXPECT_THAT(error_of(matrix + "distortion_coefficients: " + none + "\n"),
                HasSubstr("bad.yaml:4: distortion is not a list of at most five numbers"))
        << none;
    EXPECT_THAT(error_of("camera_matrix: " + none + "\n"), HasSubstr("bad.yaml: fx is missing")) << none;
  }
}

TEST(ForeignCameras, ReadsEquidistantAsFisheye) {
  const TemporaryFolder folder;
  const Camera kalibr = ReadCamera(
      folder.Write("kalibr.yaml",
                   "cam0:\n  camera_model: pinhole\n  intrinsics: [190.9, 190.8, 254.9, 256.8]\n"
                   "  distortion_model: equidistant\n  distortion_coeffs: [0.0034, 0.0007, -0.0020, 0.0002]\n"
                   "  resolution: [512, 512]\n"));
  EXPECT_EQ(kalibr.lens, LensModel::kFisheye);
  EXPECT_EQ(kalibr.distortion[2], -0.0020);
  const Camera ros = ReadCamera(folder.Write(
      "ros.yaml",
      "image_width: 848\nimage_height: 800\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [285.1, 0, 420.5, 0, 286.2, 395.5, 0, 0, 1]\ndistortion_model: equidistant\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 4\n  data: [-0.007, 0.043, -0.041, 0.007]\n"));
  EXPECT_EQ(ros.lens, LensModel::kFisheye);
  EXPECT_EQ(ros.distortion[3], 0.007);
}

// COLMAP's cameras.bin with one camera of 640x480 pixels.
std::string ColmapBinary(std::int32_t model, const std::vector<double>& parameters) {
  std::string bytes;
  const auto put = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  put(std::uint64_t{1});
  put(std::uint32_t{1});
  put(model);
  put(std::uint64_t{640});
  put(std::uint64_t{480});
  std::ranges::for_each(parameters, put);
  return bytes;
}

// The same camera in the words of other programs.
TEST(ForeignCameras, ReadsSlamAndReconstructionPrograms) {
  const TemporaryFolder folder;
  const std::string orb =
      "%YAML:1.0\n---\nCamera.type: \"PinHole\"\nCamera.fx: 500.0\nCamera.fy: 510.0\n"
      "Camera.cx: 319.5\nCamera.cy: 239.5\nCamera.k1: 0.1\nCamera.k2: 0.2\nCamera.p1: 0.01\n"
      "Camera.p2: 0.02\nCamera.fps: 25.0\n";
  const std::string orb_size = "Camera.width: 640\nCamera.height: 480\n";
  std::string orb3 = orb;
  for (std::size_t at = 0; (at = orb3.find("Camera.", at)) != orb3.npos; at += 8) {
    const bool of_lens = std::string_view(orb3).substr(at + 7, 1).find_first_of("fckp") == 0 &&
                         orb3.compare(at + 7, 3, "fps") != 0;
    orb3.replace(at, 7, of_lens ? "Camera1." : "Camera.");
  }
  const std::map<std::string, std::string> files = {
      {"orb2.yaml", orb + orb_size},
      {"orb3.yaml", orb3 + orb_size},
      {"stella.yaml",
       "Camera:\n  model: \"perspective\"\n  fx: 500\n  fy: 510\n  cx: 319.5\n  cy: 239.5\n  k1: 0.1\n"
       "  k2: 0.2\n  p1: 0.01\n  p2: 0.02\n  k3: 0\n  fps: 25\n  cols: 640\n  rows: 480\n"},
      {"cameras.txt", "# Camera list\n1 OPENCV 640 480 500 510 320 240 0.1 0.2 0.01 0.02\n"},
      {"opencv.yml",
       "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n"
       "   cols: 3\n   dt: d\n   data: [ 5.0e+02, 0., 319.5, 0., 510., 239.5, 0., 0., 1. ]\n"
       "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 8\n   dt: d\n"
       "   data: [ 0.1, 0.2, 0.01, 0.02, 0., 0., 0., 0. ]\n"},
      {"openvslam.yaml",
       "Camera.model: \"perspective\"\nCamera.fx: 500\nCamera.fy: 510\nCamera.cx: 319.5\nCamera.cy: 239.5\n"
       "Camera.k1: 0.1\nCamera.k2: 0.2\nCamera.p1: 0.01\nCamera.p2: 0.02\nCamera.cols: 640\n"
       "Camera.rows: 480\n"},
      {"camera_info.yaml",
       "header:\n  seq: 1\nheight: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\n"
       "D: [0.1, 0.2, 0.01, 0.02, 0.0]\nK: [500.0, 0.0, 319.5, 0.0, 510.0, 239.5, 0.0, 0.0, 1.0]\n---\n"},
      {"opencv.xml",
       "<?xml version=\"1.0\"?>\n<opencv_storage>\n<calibration_time>\"Mon Jan  5 2026\"</calibration_time>\n"
       "<image_width>640</image_width>\n<image_height>480</image_height>\n<flags>0</flags>\n"
       "<!-- pinhole -->\n<camera_matrix type_id=\"opencv-matrix\">\n  <rows>3</rows>\n  <cols>3</cols>\n"
       "  <dt>d</dt>\n  <data>\n    5.0e+02 0. 319.5 0. 510.\n    239.5 0. 0. 1.</data></camera_matrix>\n"
       "<distortion_coefficients type_id=\"opencv-matrix\">\n  <rows>5</rows>\n  <cols>1</cols>\n"
       "  <dt>d</dt>\n  <data>\n    0.1 0.2 0.01 0.02 0.</data></distortion_coefficients>\n"
       "</opencv_storage>\n"},
      {"cameras.bin", ColmapBinary(4, {500.0, 510.0, 320.0, 240.0, 0.1, 0.2, 0.01, 0.02})},
      {"script.json",
       R"({"image_width": 640, "image_height": 480, "dist_coeff": [[0.1, 0.2, 0.01, 0.02, 0.0]],
                          "camera_matrix": [[500, 0, 319.5], [0, 510, 239.5], [0, 0, 1]]})"},
      {"transforms.json",
       "{\t\"camera_model\": \"OPENCV\", \"w\": 640, \"h\": 480, \"fl_x\": 500, \"fl_y\": 510,"
       "\t\"cx\": 320, \"cy\": 240, \"k1\": 0.1, \"k2\": 0.2, \"p1\": 0.01, \"p2\": 0.02,"
       "\t\"frames\": [{\"file_path\": \"images/0.png\"}]}"},
  };
  for (const auto& [name, text] : files) {
    const Camera camera = ReadCamera(folder.Write(name, text));
    EXPECT_EQ(camera.width, 640) << name;
    EXPECT_EQ(camera.height, 480) << name;
    EXPECT_EQ(camera.fx, 500.0) << name;
    EXPECT_EQ(camera.fy, 510.0) << name;
    EXPECT_EQ(camera.cx, 319.5) << name;
    EXPECT_EQ(camera.cy, 239.5) << name;
    EXPECT_THAT(camera.distortion, ::testing::ElementsAre(0.1, 0.2, 0.01, 0.02, 0.0)) << name;
    EXPECT_EQ(camera.lens, LensModel::kRadialTangential) << name;
  }
  EXPECT_EQ(ReadCamera(folder.Path() / "orb3.yaml").fps, 25.0);
  EXPECT_THAT(InputErrorOf([&] { ReadCamera(folder.Write("old.yaml", orb)); }),
              HasSubstr("width is missing"));
  EXPECT_EQ(ReadCamera(folder.Path() / "old.yaml", [] { return cv::Size(640, 480); }).height, 480);
}

TEST(ForeignCameras, ReadsFisheyesOfSlamAndReconstructionPrograms) {
  const TemporaryFolder folder;
  for (const auto& [name, text] : std::map<std::string, std::string>{
           {"orb3.yaml",
            "%YAML:1.0\nCamera.type: \"KannalaBrandt8\"\nCamera1.fx: 190\nCamera1.fy: 190\nCamera1.cx: 255\n"
            "Camera1.cy: 255\nCamera1.k1: 0.1\nCamera1.k2: 0.2\nCamera1.k3: 0.3\nCamera1.k4: 0.4\n"
            "Camera.width: 512\nCamera.height: 512\n"},
           {"cameras.txt", "1 OPENCV_FISHEYE 512 512 190 190 255.5 255.5 0.1 0.2 0.3 0.4\n"},
           {"transforms.json",
            R"({"camera_model": "OPENCV_FISHEYE", "frames": [{"w": 512, "h": 512, "fl_x": 190,
               "fl_y": 190, "cx": 255.5, "cy": 255.5, "k1": 0.1, "k2": 0.2, "k3": 0.3, "k4": 0.4}]})"}}) {
    const Camera camera = ReadCamera(folder.Write(name, text));
    EXPECT_EQ(camera.lens, LensModel::kFisheye) << name;
    EXPECT_EQ(camera.cx, 255.0) << name;
    EXPECT_THAT(camera.distortion, ::testing::ElementsAre(0.1, 0.2, 0.3, 0.4, 0.0)) << name;
  }
}

TEST(ForeignCameras, RefusesOtherModelsOfReconstructionPrograms) {
  const TemporaryFolder folder;
  const auto error_of = [&](const std::string& name, const std::string& text) {
    return InputErrorOf([&] { ReadCamera(folder.Write(name, text)); });
  };
  EXPECT_THAT(error_of("cameras.txt", "1 FULL_OPENCV 64 48 50 50 32 24 0 0 0 0 0 0.1 0 0\n"),
              HasSubstr("cameras.txt:1: k4, k5 and k6"));
  EXPECT_THAT(error_of("cameras.txt", "1 PINHOLE 64 48 50 50 32 24\n2 PINHOLE 64 48 51 50 32 24\n"),
              HasSubstr("cameras.txt:2: a camera that differs"));
  EXPECT_THAT(error_of("cameras.txt", "1 PINHOLE 64 48 50 50 32\n"), HasSubstr("cameras.txt:1: "));
  EXPECT_THAT(error_of("cameras.bin", ColmapBinary(1, {50.0, 50.0})),
              HasSubstr("cameras.bin: ends in camera 0"));
  EXPECT_THAT(error_of("cameras.bin", ColmapBinary(7, {50.0, 50.0, 32.0, 24.0, 0.9})),
              HasSubstr("cameras.bin: camera 1 has the model number 7"));
  EXPECT_THAT(error_of("cameras.bin", ColmapBinary(1, {-1.0, 50.0, 32.0, 24.0})),
              HasSubstr("cameras.bin: fx is -1, expected"));
  EXPECT_THAT(error_of("opencv.xml", "<opencv_storage><image_width>640"),
              HasSubstr("opencv.xml: height is missing"));
  std::string nested = "<opencv_storage>";
  for (int i = 0; i < 300000; ++i) {
    nested += "<a>";
  }
  EXPECT_THAT(error_of("opencv.xml", nested), HasSubstr("opencv.xml:1: "));
  EXPECT_THAT(error_of("stella.yaml", "Camera:\n  model: equirectangular\n  fx: 1\n"),
              HasSubstr("stella.yaml:2: model is equirectangular, expected perspective or fisheye"));
  EXPECT_THAT(error_of("transforms.json", R"({"fl_x": 50, "camera_model": "EQUIRECTANGULAR"})"),
              HasSubstr("transforms.json: camera_model is EQUIRECTANGULAR"));
  EXPECT_THAT(error_of("transforms.json", R"({"frames": [{"fl_x": 50}, {"fl_x": 51}]})"),
              HasSubstr("transforms.json: fl_x differs between its frames"));
}

TEST(ForeignCameras, RefusesOtherLensModels) {
  const TemporaryFolder folder;
  folder.Write("kalibr.yaml", "cam0:\n  camera_model: pinhole\n  distortion_model: fov\n");
  EXPECT_THAT(InputErrorOf([&] { ReadCamera(folder.Path() / "kalibr.yaml"); }),
              HasSubstr("kalibr.yaml:3: distortion_model is fov, expected equidistant or "));
  folder.Write("omni.yaml", "camera_model: omni\nintrinsics: [1, 2, 3, 4]\n");
  EXPECT_THAT(InputErrorOf([&] { ReadCamera(folder.Path() / "omni.yaml"); }),
              HasSubstr("omni.yaml:1: camera_model is omni, expected pinhole"));
}

}  // namespace
}  // namespace sqslam
