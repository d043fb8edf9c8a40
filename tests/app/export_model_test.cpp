// Maps that were kept, exported for COLMAP and nerfstudio.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "app/export/camera_model.h"
#include "slam/io/cameras.h"
#include "slam/io/point_cloud.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "tests/app/saved_map.h"
#include "tests/io/photograph.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The texts as COLMAP's documentation describes them, read on their own terms.
TEST_F(SavedMapCommands, WritesColmapModelWithOurError) {
  const ProgramRun run = RunProgram("export " + Map() + " --format colmap -o " + Out("colmap").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const fs::path model = Out("colmap") / "sparse" / "0";
  std::istringstream cameras(Slurp(model / "cameras.txt"));
  std::string line, name;
  std::getline(cameras, line);
  int id = 0, width = 0, height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  cameras >> id >> name >> width >> height >> fx >> fy >> cx >> cy;
  EXPECT_EQ(name, "PINHOLE");
  EXPECT_EQ(width, 320);

  struct Image {
    Rigid3d T_camera_map;
    std::vector<std::array<double, 3>> points;  // x, y, id
  };
  std::map<int, Image> images;
  std::istringstream text(Slurp(model / "images.txt"));
  while (std::getline(text, line)) {
    if (line.starts_with("#")) {
      continue;
    }
    std::istringstream head(line);
    double w = 0.0, x = 0.0, y = 0.0, z = 0.0;
    Image image;
    Eigen::Vector3d& t = image.T_camera_map.translation;
    int camera = 0;
    head >> id >> w >> x >> y >> z >> t.x() >> t.y() >> t.z() >> camera >> name;
    image.T_camera_map.rotation = {w, x, y, z};
    EXPECT_TRUE(fs::exists(Out("colmap") / "images" / name)) << name;
    std::getline(text, line);
    std::istringstream row(line);
    for (std::array<double, 3> p{}; row >> p[0] >> p[1] >> p[2];) {
      image.points.push_back(p);
    }
    images[id] = image;
  }
  EXPECT_EQ(static_cast<int>(images.size()), ReadStats(fs::path(Map()) / "stats.json").keyframes);

  double sum = 0.0;
  int points = 0;
  std::istringstream cloud(Slurp(model / "points3D.txt"));
  while (std::getline(cloud, line)) {
    if (line.starts_with("#")) {
      continue;
    }
    std::istringstream row(line);
    Eigen::Vector3d p;
    int r = 0, g = 0, b = 0, image = 0, k = 0, length = 0;
    double error = 0.0, own = 0.0;
    row >> id >> p.x() >> p.y() >> p.z() >> r >> g >> b >> error;
    while (row >> image >> k) {
      const std::array<double, 3>& seen = images.at(image).points.at(static_cast<std::size_t>(k));
      EXPECT_EQ(static_cast<int>(seen[2]), id);
      const Eigen::Vector3d q = images.at(image).T_camera_map * p;
      own += std::hypot(fx * q.x() / q.z() + cx - seen[0], fy * q.y() / q.z() + cy - seen[1]);
      ++length;
    }
    ASSERT_GE(length, 2);
    EXPECT_NEAR(own / length, error, 1e-4);
    sum += error;
    ++points;
  }
  EXPECT_EQ(points, ReadStats(fs::path(Map()) / "stats.json").points);
  EXPECT_LT(sum / points, 1.5);
  EXPECT_THAT(run.out, HasSubstr(fmt::format("mean reprojection error {:.3f} px", sum / points)));
}

TEST_F(SavedMapCommands, WritesModelThatColmapReads) {
  if (std::system("command -v colmap >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "colmap is not installed (packages-test.txt)";
  }
  const ProgramRun run = RunProgram("export " + Map() + " --format colmap -o " + Out("analysed").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const fs::path report = Out("analysis.txt");
  const fs::path model = Out("analysed") / "sparse" / "0";
  for (const char* only : {".bin", ".txt"}) {
    const fs::path part = Out(std::string("only") + only);
    fs::create_directories(part);
    for (const char* file : {"cameras", "images", "points3D"}) {
      fs::copy_file(model / (std::string(file) + only), part / (std::string(file) + only));
    }
    const std::string command = "QT_QPA_PLATFORM=offscreen colmap model_analyzer --path " + part.string() +
                                " >" + report.string() + " 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << Slurp(report);
    const std::string text = Slurp(report);
    const std::string key = "Mean reprojection error: ";
    ASSERT_THAT(text, HasSubstr(key));
    const double error = std::stod(text.substr(text.find(key) + key.size()));
    EXPECT_THAT(run.out, HasSubstr(fmt::format("mean reprojection error {:.3f} px", error)));
  }
}

// COLMAP goes on with the model: it adjusts it, and triangulates points of its own from its poses.
TEST_F(SavedMapCommands, WritesModelThatColmapExtends) {
  if (std::system("command -v colmap >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "colmap is not installed (packages-test.txt)";
  }
  const ProgramRun run = RunProgram("export " + Map() + " --format colmap -o " + Out("handed").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string model = (Out("handed") / "sparse" / "0").string();
  const std::string images = (Out("handed") / "images").string();
  const std::string database = Out("handed.db").string();
  const fs::path report = Out("handed.txt");
  const auto colmap = [&](const std::string& arguments) {
    const std::string command =
        "QT_QPA_PLATFORM=offscreen colmap " + arguments + " >" + report.string() + " 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << arguments << Slurp(report);
  };
  fs::create_directories(Out("adjusted"));
  colmap("bundle_adjuster --input_path " + model + " --output_path " + Out("adjusted").string());
  EXPECT_THAT(Slurp(report), HasSubstr("Final cost"));
  std::string names, line;
  std::istringstream list(Slurp(fs::path(model) / "images.txt"));
  while (std::getline(list, line)) {
    if (!line.starts_with("#")) {
      names += line.substr(line.rfind(' ') + 1) + "\n";
      std::getline(list, line);
    }
  }
  WriteFileAtomically(Out("names.txt"), names);
  std::string camera;
  std::istringstream cameras(Slurp(fs::path(model) / "cameras.txt"));
  while (std::getline(cameras, line)) {
    camera = line.starts_with("#") ? camera : line;
  }
  std::istringstream words(camera);
  std::string id, kind, width, height, number, parameters;
  words >> id >> kind >> width >> height;
  while (words >> number) {
    parameters += (parameters.empty() ? "" : ",") + number;
  }
  colmap("feature_extractor --SiftExtraction.use_gpu 0 --ImageReader.single_camera 1 --database_path " +
         database + " --image_path " + images + " --image_list_path " + Out("names.txt").string() +
         " --ImageReader.camera_model " + kind + " --ImageReader.camera_params " + parameters);
  colmap("sequential_matcher --SiftMatching.use_gpu 0 --database_path " + database);
  fs::create_directories(Out("triangulated"));
  colmap("point_triangulator --clear_points 1 --database_path " + database + " --image_path " + images +
         " --input_path " + model + " --output_path " + Out("triangulated").string());
  EXPECT_TRUE(fs::exists(Out("triangulated") / "points3D.bin"));
}

TEST(CameraModel, NamesFisheyeLensAsColmapAndNerfstudioDo) {
  const TemporaryFolder folder;
  app::CameraModel model;
  model.camera = {
      640, 480, 300.0, 301.0, 320.0, 240.0, {-0.01, 0.006, -0.004, 0.0008}, 30.0, 0.0, LensModel::kFisheye};
  app::WriteColmap(folder.Path(), model);
  EXPECT_THAT(Slurp(folder.Path() / "cameras.txt"),
              HasSubstr("1 OPENCV_FISHEYE 640 480 300 301 320.5 240.5 -0.01 0.006 -0.004 0.0008\n"));
  std::int32_t number = 0;
  std::memcpy(&number, Slurp(folder.Path() / "cameras.bin").data() + 12, sizeof(number));
  EXPECT_EQ(number, 5);
  app::WriteTransforms(folder.Path() / "transforms.json", model, "points.ply");
  const auto json = nlohmann::json::parse(Slurp(folder.Path() / "transforms.json"));
  EXPECT_EQ(json.at("camera_model"), "OPENCV_FISHEYE");
  EXPECT_EQ(json.at("k4"), 0.0008);
  EXPECT_FALSE(json.contains("p1"));
}

TEST_F(SavedMapCommands, WritesNerfstudioCamerasAlongMinusZ) {
  const ProgramRun run = RunProgram("export " + Map() + " --format nerfstudio -q -o " + Out("nerf").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "");
  const auto json = nlohmann::json::parse(Slurp(Out("nerf") / "transforms.json"));
  EXPECT_EQ(json.at("w"), 320);
  EXPECT_TRUE(fs::exists(Out("nerf") / json.at("ply_file_path").get<std::string>()));
  const Trajectory keyframes = ReadTrajectory(fs::path(Map()) / "keyframes.txt");
  ASSERT_EQ(json.at("frames").size(), keyframes.size());
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const auto& frame = json.at("frames").at(i);
    EXPECT_TRUE(fs::exists(Out("nerf") / frame.at("file_path").get<std::string>()));
    const Eigen::Matrix3d ours = keyframes[i].T_map_camera.RotationMatrix();
    for (int row = 0; row < 3; ++row) {
      const auto& theirs = frame.at("transform_matrix").at(static_cast<std::size_t>(row));
      EXPECT_NEAR(theirs.at(0).get<double>(), ours(row, 0), 1e-5);
      EXPECT_NEAR(theirs.at(1).get<double>(), -ours(row, 1), 1e-5);
      EXPECT_NEAR(theirs.at(2).get<double>(), -ours(row, 2), 1e-5);
      EXPECT_NEAR(theirs.at(3).get<double>(), keyframes[i].T_map_camera.translation[row], 1e-5);
    }
  }
}

// The map of this test has no object, so one is put where the camera looks.
TEST_F(SavedMapCommands, WritesWhiteMasksOfSolids) {
  fs::copy(Map(), Out("with-cup"), fs::copy_options::recursive);
  MapSnapshot map = *RecordingReader(Out("with-cup") / "map.sqmap").Last();
  SnapshotObject cup;
  cup.label = "cup";
  const Rigid3d& eye = map.keyframes.front().T_map_camera;
  cup.superquadric = {{Eigen::Vector3d::Constant(0.1), 1.0, 1.0}, {Eigen::Quaterniond::Identity(), {}}};
  cup.superquadric.T_map_object.translation = eye * Eigen::Vector3d(0.0, 0.0, 1.0);  // a ball of 26 px
  map.objects = {cup};
  AppendToRecording(Out("with-cup") / "map.sqmap", map);
  const ProgramRun run = RunProgram("export " + Out("with-cup").string() +
                                    " --format nerfstudio --masks -o " + Out("masked").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(Slurp(Out("masked") / "transforms.json"));
  for (const auto& frame : json.at("frames")) {
    EXPECT_EQ(frame.at("mask_path"),
              "masks" + frame.at("file_path").get<std::string>().substr(std::strlen("images")) + ".png");
    EXPECT_TRUE(fs::exists(Out("masked") / frame.at("mask_path").get<std::string>()));
  }
  const std::string first = json.at("frames").at(0).at("mask_path");
  const cv::Mat mask = cv::imread((Out("masked") / first).string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(mask.size(), cv::Size(320, 240));
  ASSERT_EQ(mask.type(), CV_8U);
  EXPECT_EQ(mask.at<std::uint8_t>(120, 160), 255);
  EXPECT_EQ(mask.at<std::uint8_t>(120, 160 + 20), 255);
  EXPECT_EQ(mask.at<std::uint8_t>(120, 160 + 32), 0);
  EXPECT_EQ(mask.at<std::uint8_t>(120 - 32, 160), 0);
  EXPECT_EQ(cv::countNonZero(mask) + cv::countNonZero(mask == 0), mask.rows * mask.cols);
  ExpectRefused("export " + Map() + " --masks", 2, "--masks: applies to --format only");
}

TEST_F(SavedMapCommands, CopiesFullImagesWhenMappedSmaller) {
  const ProgramRun run = RunProgram("run " + Input() + " --no-render --deterministic --detector none " +
                                    "--resize 0.75 --frames 50 -o " + Out("small").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const ProgramRun exported =
      RunProgram("export " + Out("small").string() + " --format colmap -o " + Out("small-colmap").string());
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  const fs::path copied = fs::directory_iterator(Out("small-colmap") / "images" / "rgb")->path();
  EXPECT_FALSE(fs::is_symlink(copied));
  EXPECT_TRUE(Slurp(copied) == Slurp(fs::path(Input()) / "rgb" / copied.filename())) << copied;
  const ProgramRun linked = RunProgram("export " + Out("small").string() + " --format colmap --link -o " +
                                       Out("small-linked").string());
  ASSERT_EQ(linked.exit_code, 0) << linked.err;
  EXPECT_TRUE(fs::is_symlink(Out("small-linked") / "images" / "rgb" / copied.filename()));
  const Camera given = ReadCamera(fs::path(Input()) / "camera.yaml");
  const Camera written = ReadCamera(Out("small") / "camera.yaml");
  EXPECT_EQ(written.width, given.width);
  EXPECT_NEAR(written.fx, given.fx, 1e-9);
  EXPECT_NEAR(written.cy, given.cy, 1e-9);
  EXPECT_THAT(Slurp(Out("small-colmap") / "sparse" / "0" / "cameras.txt"), HasSubstr("PINHOLE 320 240 "));
  const MapSnapshotPtr map = RecordingReader(Out("small") / "map.sqmap").Last();
  EXPECT_EQ(map->camera.width, 240);
  std::istringstream text(Slurp(Out("small-colmap") / "sparse" / "0" / "images.txt"));
  double right = 0.0, bottom = 0.0;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("#")) {
      continue;
    }
    std::getline(text, line);
    std::istringstream row(line);
    for (double x = 0.0, y = 0.0, id = 0.0; row >> x >> y >> id;) {
      right = std::max(right, x);
      bottom = std::max(bottom, y);
    }
  }
  EXPECT_GT(right, 250.0);
  EXPECT_LT(right, 320.0);
  EXPECT_GT(bottom, 190.0);
  EXPECT_LT(bottom, 240.0);
}

// The colours of points against the pixels of the written files where the model says that they are, for
// images that readers without EXIF, of 8 bits or of text with blanks would get wrong.
TEST_F(SavedMapCommands, ExportsThePixelsThatWereMapped) {
  for (const std::string kind : {"blanks", "mirrored", "deep"}) {
    SCOPED_TRACE(kind);
    const fs::path images = Out(kind);
    fs::create_directories(images);
    fs::copy_file(fs::path(Input()) / "camera.yaml", images / "camera.yaml");
    for (int i = 0; i < 50; ++i) {
      const fs::path original = fs::path(Input()) / "rgb" / fmt::format("{:04}.jpg", i);
      if (kind == "blanks") {
        fs::copy_file(original, images / fmt::format("Photo {} (desk).jpg", i));
      } else if (kind == "mirrored") {
        cv::Mat mirrored;
        cv::flip(cv::imread(original.string()), mirrored, 1);
        const TemporaryFolder folder;
        fs::copy_file(WritePhotograph(folder, "a.jpg", mirrored, {.orientation = 2}),
                      images / fmt::format("{:04}.jpg", i));
      } else {
        cv::Mat deep;
        cv::imread(original.string()).convertTo(deep, CV_16U, 12.0);
        cv::imwrite((images / fmt::format("{:04}.png", i)).string(), deep);
      }
    }
    const ProgramRun run =
        RunProgram("run " + images.string() + " --no-render --deterministic --detector none -o " +
                   Out(kind + "-map").string());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const fs::path exported = Out(kind + "-nerf");
    ASSERT_EQ(
        RunProgram("export " + Out(kind + "-map").string() + " --format nerfstudio -o " + exported.string())
            .exit_code,
        0);
    const auto json = nlohmann::json::parse(Slurp(exported / "transforms.json"));
    const PointCloud cloud = ReadPointCloud(exported / "points.ply");
    double error = 0.0;
    int seen = 0;
    for (const auto& frame : json.at("frames")) {
      const std::string name = frame.at("file_path");
      EXPECT_EQ(name.find(' '), std::string::npos) << name;
      const cv::Mat raw =
          cv::imread((exported / name).string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
      ASSERT_EQ(raw.cols, json.at("w").get<int>());
      Eigen::Matrix4d T_map_camera;
      for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
          T_map_camera(row, column) = frame.at("transform_matrix").at(row).at(column);
        }
      }
      for (std::size_t i = 0; i < cloud.points.size(); ++i) {
        const Eigen::Vector3d p =
            (T_map_camera.inverse() * cloud.points[i].homogeneous()).head<3>();  // -z ahead
        const Eigen::Vector2d pixel(
            json.at("fl_x").get<double>() * p.x() / -p.z() + json.at("cx").get<double>(),
            json.at("fl_y").get<double>() * p.y() / p.z() + json.at("cy").get<double>());
        if (p.z() < 0.0 && cv::Rect(0, 0, raw.cols, raw.rows).contains(cv::Point(pixel.x(), pixel.y()))) {
          const auto bgr = raw.at<cv::Vec3b>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
          for (int c = 0; c < 3; ++c) {
            error += std::abs(bgr[2 - c] - cloud.rgb[i][c]);
          }
          ++seen;
        }
      }
    }
    ASSERT_GT(seen, 1000);
    EXPECT_LT(error / seen / 3.0, 20.0) << "grey levels; mirrored images differ by about 50";
  }
}

TEST_F(SavedMapCommands, MapsAndExportsPhotographsTakenWithTurnedCamera) {
  const fs::path photographs = Out("photographs");
  fs::create_directories(photographs);
  fs::copy_file(fs::path(Input()) / "camera.yaml", photographs / "camera.yaml");
  const auto original = [](int i) {
    return cv::imread((fs::path(Input()) / "rgb" / fmt::format("{:04}.jpg", i)).string());
  };
  for (int i = 0; i < 50; ++i) {
    cv::Mat photograph = original(i);
    if (i % 4 == 1) {
      cv::rotate(photograph, photograph, cv::ROTATE_90_CLOCKWISE);
    }
    cv::imwrite((photographs / fmt::format("{:04}.png", i)).string(), photograph);
  }
  const ProgramRun run = RunProgram("run " + photographs.string() + " --no-render --deterministic " +
                                    "--detector none -o " + Out("turned").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("13 of 50 images were taken with the camera turned"));
  EXPECT_EQ(ReadStats(Out("turned") / "stats.json").tracked, 50);
  const ProgramRun exported =
      RunProgram("export " + Out("turned").string() + " --format colmap -o " + Out("turned-colmap").string());
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  int images = 0;
  for (const fs::directory_entry& file : fs::directory_iterator(Out("turned-colmap") / "images")) {
    const cv::Mat image = cv::imread(file.path().string());
    const cv::Mat expected = original(std::stoi(file.path().stem().string()));
    ASSERT_EQ(image.size(), expected.size()) << file.path();
    EXPECT_LT(cv::norm(image, expected, cv::NORM_L1) / static_cast<double>(3 * expected.total()), 3.0)
        << file.path();
    ++images;
  }
  EXPECT_EQ(images, ReadStats(Out("turned") / "stats.json").keyframes);
}

// Once in a folder whose images are copied, once in one of portrait images, which are turned and written.
TEST_F(SavedMapCommands, OmitsKeyframesWithUnreadableImages) {
  const MapSnapshotPtr map = RecordingReader(fs::path(Map()) / "map.sqmap").Last();
  const std::string image = fmt::format("{:04}.jpg", map->keyframes.at(1).frame_index);
  const int left = ReadStats(fs::path(Map()) / "stats.json").keyframes - 1;
  for (const bool copied : {true, false}) {
    const fs::path input = Out(copied ? "input-copied" : "input-written");
    const fs::path output = Out(copied ? "output-copied" : "output-written");
    fs::copy(Input(), input, fs::copy_options::recursive);
    if (copied) {
      fs::remove(input / "rgb" / image);
    } else {
      for (const fs::directory_entry& file : fs::directory_iterator(input / "rgb")) {
        cv::imwrite(file.path().string(), cv::Mat(160, 120, CV_8UC3, cv::Scalar::all(90)));
      }
      WriteFileAtomically(input / "rgb" / image, "no image");
    }
    const ProgramRun run = RunProgram("export " + Map() + " --format nerfstudio --images " + input.string() +
                                      " -o " + output.string());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, HasSubstr("keyframes whose images cannot be read, left out: 1"));
    EXPECT_THAT(run.out, HasSubstr(fmt::format("{} images, ", left)));
    const auto json = nlohmann::json::parse(Slurp(output / "transforms.json"));
    EXPECT_EQ(json.at("frames").size(), static_cast<std::size_t>(left));
    for (const auto& frame : json.at("frames")) {
      EXPECT_TRUE(fs::is_regular_file(output / frame.at("file_path").get<std::string>())) << frame;
    }
  }
}

TEST_F(SavedMapCommands, RefusesModelFormatsWithoutLiveMap) {
  ExpectRefused("export " + Map() + " --format colmap --meshes", 2, "--format colmap: holds no objects");
  ExpectRefused("export " + Map() + " --images " + Input(), 2, "--images: ");
}

}  // namespace
}  // namespace sqslam::testing
