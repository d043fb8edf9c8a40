#include "slam/run/scale_estimation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "slam/io/cameras.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"
#include "tests/support/board_scene.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using testing::MakeSyntheticMap;
using testing::SyntheticMap;

// Returns the message that a call is refused with.
template <typename Error>
std::string Refusal(const auto& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was refused";
}

// Expects about two thirds of the errors within one deviation, nearly all within two.
void ExpectCoverage(const std::vector<double>& in_deviations) {
  const auto within = [&](double most) {
    return static_cast<double>(
               std::ranges::count_if(in_deviations, [&](double e) { return std::abs(e) < most; })) /
           static_cast<double>(in_deviations.size());
  };
  EXPECT_GT(within(1.0), 0.58);
  EXPECT_LT(within(1.0), 0.78);
  EXPECT_GT(within(2.0), 0.91);
}

// Moves each point to where its noisy keypoints put it.
void FitPoints(SyntheticMap& world) {
  constexpr int kSteps = 4;
  for (std::size_t i = 0; i < world.points.size(); ++i) {
    MapPoint& point = world.map.Point(static_cast<PointId>(i));
    for (int step = 0; step < kSteps; ++step) {
      Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      for (const Observation& observation : point.observations) {
        const Rigid3d& T_camera_map = world.map.At(observation.keyframe).T_camera_map;
        const auto error = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
          return world.camera.Project(T_camera_map * p) - world.map.KeypointOf(observation).pixel;
        };
        Eigen::Matrix<double, 2, 3> jacobian;
        for (int axis = 0; axis < 3; ++axis) {
          constexpr double kStep = 1e-6;
          jacobian.col(axis) =
              (error(point.p_map + kStep * Eigen::Vector3d::Unit(axis)) - error(point.p_map)) / kStep;
        }
        matrix += jacobian.transpose() * jacobian;
        right += jacobian.transpose() * error(point.p_map);
      }
      point.p_map -= matrix.ldlt().solve(right);
    }
  }
}

TEST(ScaleEstimation, GivesHonestDeviationsOfDistances) {
  SyntheticMap world = MakeSyntheticMap({.pixel_noise = 0.7});
  FitPoints(world);
  MapSnapshot map;
  map.camera = world.camera;
  for (std::size_t k = 0; k < world.T_camera_map.size(); ++k) {
    map.keyframes.push_back({static_cast<std::int64_t>(k), 0, 0.0, world.T_camera_map[k].Inverse()});
  }
  constexpr double kUnit = 0.4;  // of a length in the map: the snapshot is in metres already
  for (SnapshotKeyframe& keyframe : map.keyframes) {
    keyframe.T_map_camera.translation *= kUnit;
  }
  std::vector<double> errors;
  for (std::size_t i = 0; i + 1 < world.points.size(); i += 2) {
    const auto text = [&](std::size_t k) {
      const Eigen::Vector3d p = kUnit * world.map.Point(static_cast<PointId>(k)).p_map;
      return std::to_string(p.x()) + "," + std::to_string(p.y()) + "," + std::to_string(p.z());
    };
    const MeasuredLength measured = MeasureDistance(
        map, {text(i), text(i + 1), 1.0}, [&] { return world.map; }, kUnit);
    const double truth = kUnit * (world.points[i] - world.points[i + 1]).norm();
    EXPECT_NEAR(measured.length, truth, 0.1);
    errors.push_back((measured.length - truth) / measured.deviation);
  }
  ASSERT_GT(errors.size(), 100u);
  ExpectCoverage(errors);
}

TEST(ScaleEstimation, RefusesPlacesWithoutMapPoints) {
  const SyntheticMap world = MakeSyntheticMap({});
  MapSnapshot map;
  map.camera = world.camera;
  map.keyframes.push_back({0, 0, 0.0, world.T_camera_map[0].Inverse()});
  const auto measure = [&](const std::string& from) {
    return [&, from] {
      MeasureDistance(
          map, {from, "0,0,0", 1.0}, [&] { return world.map; }, 1.0);
    };
  };
  EXPECT_THAT(Refusal<InputError>(measure("50,0,0")),
              HasSubstr("no map point lies at 50,0,0, the nearest is "));
  EXPECT_THAT(Refusal<UsageError>(measure("1,zwei,3")),
              HasSubstr("1,zwei,3: expected the id of an object, or a position"));
}

// The heights of objects that err as their covariances say.
TEST(ScaleEstimation, GivesHonestDeviationsOfHeights) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::vector<double> errors;
  for (int i = 0; i < 300; ++i) {
    MapSnapshot map = HandMadeMap();
    SnapshotObject& cup = map.objects[1];
    const double deviation = 0.004;
    cup.fit.covariance.diagonal() << 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, deviation * deviation, 0.1, 0.1, 0.1;
    cup.superquadric.shape.half_size.z() += deviation * normal(random);
    const MeasuredLength measured = MeasureHeight(map, i % 2 == 0 ? "1" : "cup");
    EXPECT_NEAR(measured.deviation, 2.0 * deviation, 1e-9);
    EXPECT_EQ(measured.what, "height of 1 cup");
    errors.push_back((measured.length - 0.4) / measured.deviation);
  }
  ExpectCoverage(errors);
}

TEST(ScaleEstimation, PicksMostCertainHeightOfLabel) {
  MapSnapshot map = HandMadeMap();
  for (SnapshotObject& object : map.objects) {
    object.label = "cup";
    object.fit.covariance = 1e-3 * Eigen::Matrix<double, 9, 9>::Identity();
  }
  map.objects[2].fit.covariance *= 0.1;
  EXPECT_EQ(MeasureHeight(map, "cup").what, "height of 2 cup");
  map.objects[2].fit.reliability = 0.2;
  EXPECT_EQ(MeasureHeight(map, "cup").what, "height of 1 cup")
      << "uncertain ones last; the second is the taller";
}

TEST(ScaleEstimation, RefusesUnknownHeights) {
  MapSnapshot map = HandMadeMap();
  EXPECT_THAT(Refusal<InputError>([&] { MeasureHeight(map, "12"); }),
              HasSubstr("the map has no object 12, expected one of 0 book, 1 cup, 2 sports_ball"));
  EXPECT_THAT(Refusal<InputError>([&] { MeasureHeight(map, "1"); }), HasSubstr("1 cup was never refined"));
  map.gravity_known = false;
  EXPECT_THAT(Refusal<InputError>([&] { MeasureHeight(map, "1"); }), HasSubstr("up direction is unknown"));
}

TEST(ScaleEstimation, ParsesReferences) {
  EXPECT_EQ(std::get<KnownHeight>(ParseScaleReference("cup=0.096")).object, "cup");
  EXPECT_EQ(std::get<KnownHeight>(ParseScaleReference("4=0.096")).metres, 0.096);
  const auto board = std::get<CalibrationBoard>(ParseScaleReference("board=9x6,30,18,4X4_50"));
  EXPECT_EQ(board.kind, BoardKind::kCharuco);
  EXPECT_EQ(board.columns, 9);
  EXPECT_EQ(board.marker_mm, 18.0);
  EXPECT_EQ(std::get<CalibrationBoard>(ParseScaleReference("board")).columns, CalibrationBoard().columns);
  for (const char* wrong :
       {"cup", "=3", "cup=x", "board=9,30", "board=9x6,30", "cup=0", "cup=-1", "board=9x6,18,30"}) {
    EXPECT_THROW(ParseScaleReference(wrong), UsageError) << wrong;
  }
}

const CalibrationBoard kBoard{BoardKind::kCharuco, 9, 6, 30.0, 18.0, "4X4_50"};
const Camera kCamera{640, 480, 520.0, 523.0, 311.0, 246.0, {-0.1, 0.02, 0.001, -0.0015, 0.0}};

// Sights of the board from an arc in a map whose unit is so many metres; keyframes and corners err.
std::vector<BoardSighting> Sights(int count, double metres, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const std::vector<cv::Point3f> corners = BoardCorners(kBoard);
  std::vector<BoardSighting> sightings;
  for (int i = 0; i < count; ++i) {
    const double angle = 0.1 * i - 0.3;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
    const Eigen::Vector3d middle(135.0, 90.0, 0.0);  // mm
    const Rigid3d T_board_camera{turn, middle + turn * Eigen::Vector3d(0.0, 0.0, -600.0)};
    BoardSighting sight;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Eigen::Vector3d p(corners[k].x, corners[k].y, corners[k].z);
      const Eigen::Vector2d pixel = kCamera.ProjectDistorted(T_board_camera.Inverse() * p) +
                                    0.3 * Eigen::Vector2d(normal(random), normal(random));
      sight.view.ids.push_back(static_cast<int>(k));
      sight.view.corners.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    }
    sight.T_map_camera = T_board_camera;
    for (double& axis : sight.T_map_camera.translation) {
      axis += 2.0 * normal(random);  // mm: the map errs more than the corners do
    }
    sight.T_map_camera.translation *= 1e-3 / metres;
    sightings.push_back(std::move(sight));
  }
  return sightings;
}

TEST(ScaleEstimation, GivesHonestDeviationsOfBoards) {
  std::vector<double> errors;
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    const auto scale = ScaleByBoard(Sights(7, 2.5, seed), kCamera, kBoard);
    ASSERT_TRUE(scale);
    EXPECT_NEAR(scale->metres, 2.5, 0.1);
    EXPECT_EQ(scale->corners, kBoard.InnerCorners());
    errors.push_back((scale->metres - 2.5) / scale->deviation);
  }
  ExpectCoverage(errors);
}

TEST(ScaleEstimation, RequiresBoardInFourKeyframes) {
  EXPECT_FALSE(ScaleByBoard(Sights(3, 2.5, 1), kCamera, kBoard));
  std::vector<BoardSighting> still = Sights(1, 2.5, 1);
  still.resize(5, still.front());
  EXPECT_FALSE(ScaleByBoard(still, kCamera, kBoard));
}

// A recording whose keyframes show a board, with its images.
class BoardFilm : public ::testing::Test {
 protected:
  BoardFilm() {
    const testing::BoardScene scene(kBoard, kCamera);
    std::filesystem::create_directories(folder_.Path() / "rgb");
    std::ofstream list(folder_.Path() / "rgb.txt");
    MapSnapshot map;
    map.camera = kCamera;
    const std::vector<BoardSighting> sightings = Sights(4, 0.5, 3);
    for (std::size_t i = 0; i < sightings.size(); ++i) {
      const std::string name = "rgb/" + std::to_string(i) + ".png";
      Rigid3d T_board_camera = sightings[i].T_map_camera;
      T_board_camera.translation *= 500.0;
      cv::imwrite((folder_.Path() / name).string(), scene.Render(T_board_camera.Inverse()));
      list << 0.1 * static_cast<double>(i) << " " << name << "\n";
      map.keyframes.push_back({static_cast<std::int64_t>(i), static_cast<std::int64_t>(i),
                               0.1 * static_cast<double>(i), sightings[i].T_map_camera});
    }
    WriteCamera(folder_.Path() / "camera.yaml", kCamera);
    RecordingWriter(recording_, {folder_.Path().string(), "test", ""}).Add(map);
  }
  TemporaryFolder folder_;
  const std::filesystem::path recording_ = folder_.Path() / "map.sqmap";
};

TEST_F(BoardFilm, MeasuresMapThatIsAlreadyScaled) {
  const MapScale first = EstimateScale(recording_, kBoard);
  EXPECT_NEAR(first.metres, 0.5, 0.005);
  EXPECT_THAT(first.source, HasSubstr("in 4 keyframes"));
  StoreMapScale(recording_, MapScale{3.0, 0.1, "a mistake"});
  const MapScale again = EstimateScale(recording_, kBoard);
  EXPECT_NEAR(again.metres, first.metres, 1e-6);
  EXPECT_NEAR(again.deviation, first.deviation, 1e-6);
}

TEST_F(BoardFilm, IgnoresOtherBoards) {
  CalibrationBoard other = kBoard;
  other.dictionary = "6X6_50";
  EXPECT_THAT(Refusal<InputError>([&] { EstimateScale(recording_, other); }),
              HasSubstr("is seen in 0 of 4 keyframes, expected at least four from different positions"));
}

}  // namespace
}  // namespace sqslam
