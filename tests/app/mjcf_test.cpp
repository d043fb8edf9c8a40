#include "app/export/mjcf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "app/export/urdf.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"
#include "tests/scene/made_room.h"

namespace sqslam::app {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;

// A scene in the simulator.
class Simulation {
 public:
  explicit Simulation(const fs::path& file) {
    std::array<char, 1000> error{};
    model_.reset(mj_loadXML(file.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
    EXPECT_NE(model_, nullptr) << file << ": " << error.data();
    if (model_) {
      data_.reset(mj_makeData(model_.get()));
      mj_forward(model_.get(), data_.get());
    }
  }
  explicit operator bool() const { return model_ != nullptr; }

  int Body(const std::string& name) const { return mj_name2id(model_.get(), mjOBJ_BODY, name.c_str()); }
  bool IsFree(int body) const { return model_->body_dofnum[body] == 6; }
  int Geoms(const std::string& name) const { return model_->body_geomnum[Body(name)]; }
  double Mass(const std::string& name) const { return model_->body_mass[Body(name)]; }
  int GeomType(const std::string& name) const { return model_->geom_type[model_->body_geomadr[Body(name)]]; }
  Eigen::Vector3d Position(int body) const {
    return Eigen::Map<const Eigen::Vector3d>(data_->xpos + 3 * body);
  }
  int Cameras() const { return model_->ncam; }

  void Step(double seconds) {
    while (data_->time < seconds) {
      mj_step(model_.get(), data_.get());
    }
  }

  // Steps two seconds. Fails for each body that moves over 1 cm or tilts over 5 degrees.
  void ExpectToRest() {
    std::map<int, std::pair<Eigen::Vector3d, Eigen::Vector3d>> start;
    for (int body = 1; body < model_->nbody; ++body) {
      start[body] = {Position(body), Up(body)};
    }
    Step(2.0);
    EXPECT_EQ(data_->warning[mjWARN_BADQACC].number, 0) << "unstable, and started again";
    for (const auto& [body, pose] : start) {
      const char* name = mj_id2name(model_.get(), mjOBJ_BODY, body);
      EXPECT_LT((Position(body) - pose.first).norm(), 0.01) << name;
      EXPECT_GT(Up(body).dot(pose.second), std::cos(0.087)) << name;
    }
  }

 private:
  Eigen::Vector3d Up(int body) const {
    const mjtNum* R = data_->xmat + 9 * body;  // row-major
    return {R[2], R[5], R[8]};
  }

  struct Deleter {
    void operator()(mjModel* model) const { mj_deleteModel(model); }
    void operator()(mjData* data) const { mj_deleteData(data); }
  };
  std::unique_ptr<mjModel, Deleter> model_;
  std::unique_ptr<mjData, Deleter> data_;
};

// One object in the simulator, which reads URDF too.
TEST(Urdf, GivesMassAndInertiaOfOneObject) {
  const TemporaryFolder folder;
  MapSnapshot map = sqslam::testing::MadeRoom();
  map.objects = {map.objects[14]};  // the ball, 0.11 m
  WriteUrdf(folder.Path() / "ball.urdf", map);
  std::array<char, 1000> error{};
  // MuJoCo moves the only body of a file into the world unless it is told otherwise.
  std::string text = ReadFile(folder.Path() / "ball.urdf", "a robot");
  text.insert(text.find("  <link"),
              "<mujoco><compiler fusestatic=\"false\" discardvisual=\"false\"/></mujoco>\n");
  folder.Write("ball.urdf", text);
  const std::unique_ptr<mjModel, void (*)(mjModel*)> model(
      mj_loadXML((folder.Path() / "ball.urdf").c_str(), nullptr, error.data(),
                 static_cast<int>(error.size())),
      [](mjModel* m) { mj_deleteModel(m); });
  ASSERT_NE(model, nullptr) << error.data();
  const int body = mj_name2id(model.get(), mjOBJ_BODY, "sports_ball_15");
  ASSERT_GT(body, 0);
  const double mass = model->body_mass[body];
  EXPECT_GT(mass, 0.05);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(model->body_inertia[3 * body + axis], 0.4 * mass * 0.11 * 0.11, 1e-5 * mass);
  }
  EXPECT_EQ(model->nmesh, 1);
  EXPECT_THROW(WriteUrdf(folder.Path() / "two.urdf", sqslam::testing::MadeRoom()), InputError);
  map.metric = false;
  EXPECT_THROW(WriteUrdf(folder.Path() / "unit.urdf", map), InputError);
}

class Mjcf : public ::testing::Test {
 protected:
  Mjcf() {
    map_.objects[2].fit.reliability = 0.9;
    map_.objects.pop_back();  // the leaning skateboard: objects of a map stand upright
  }
  MjcfSummary Export() { return WriteMjcf(File(), map_, MakeSceneGraph(map_, ClassTable::Named("default"))); }
  fs::path File() const { return folder_.Path() / "room.xml"; }

  MapSnapshot map_ = sqslam::testing::MadeRoom();
  TemporaryFolder folder_;
};

TEST_F(Mjcf, RestsForTwoSeconds) {
  const MjcfSummary summary = Export();
  EXPECT_THAT(summary.notes, ::testing::IsEmpty());
  Simulation simulation(File());
  ASSERT_TRUE(simulation);
  simulation.ExpectToRest();
}

TEST_F(Mjcf, FixesFurnitureAndFreesSmallThings) {
  Export();
  const Simulation simulation(File());
  ASSERT_TRUE(simulation);
  for (const char* name : {"2 cup", "4 bottle", "6 book", "11 cushion", "14 box", "15 sports_ball"}) {
    EXPECT_TRUE(simulation.IsFree(simulation.Body(name))) << name;
  }
  for (const char* name : {"1 dining_table", "9 chair", "12 bookshelf", "13 book"}) {
    EXPECT_FALSE(simulation.IsFree(simulation.Body(name))) << name;
  }
  EXPECT_EQ(simulation.Cameras(), 10);
}

TEST_F(Mjcf, TakesPrimitivesWhereExponentsSaySo) {
  map_.objects[1].superquadric.shape.e1 = 0.6;  // neither a cylinder nor an ellipsoid
  Export();
  const Simulation simulation(File());
  ASSERT_TRUE(simulation);
  EXPECT_EQ(simulation.GeomType("2 cup"), mjGEOM_MESH);
  EXPECT_EQ(simulation.GeomType("3 cup"), mjGEOM_CYLINDER);
  EXPECT_EQ(simulation.GeomType("5 book"), mjGEOM_MESH);  // another stands on it
  EXPECT_EQ(simulation.GeomType("6 book"), mjGEOM_BOX);
  EXPECT_EQ(simulation.GeomType("15 sports_ball"), mjGEOM_ELLIPSOID);
  // 0.3 kg for a typical cup of 0.09 x 0.08 x 0.095 m.
  EXPECT_NEAR(simulation.Mass("3 cup"), 0.3 * (0.08 * 0.08 * 0.09) / (0.09 * 0.08 * 0.095), 1e-3);
}

TEST_F(Mjcf, MakesBodiesOfParts) {
  const SolidPart seat{{0.0, 0.0, -0.05}, {{1.0, 1.0, 0.05}, 0.15, 0.15}};
  const SolidPart back{{0.0, -0.85, 0.5}, {{1.0, 0.15, 0.5}, 0.15, 0.15}};
  const SolidPart leg{{0.0, 0.0, -0.55}, {{0.2, 0.2, 0.45}, 0.15, 1.0}};
  map_.objects[8].parts = map_.objects[9].parts = {seat, back, leg};
  Export();
  Simulation simulation(File());
  ASSERT_TRUE(simulation);
  EXPECT_EQ(simulation.Geoms("9 chair"), 3);
  EXPECT_EQ(simulation.Geoms("10 chair"), 1) << "a cushion lies on it, which says where the seat is";
  EXPECT_NEAR(simulation.Mass("9 chair"), simulation.Mass("10 chair"), 1e-4);
  simulation.ExpectToRest();
}

TEST_F(Mjcf, SeparatesThingsThatPenetrate) {
  map_.objects[1].superquadric.T_map_object.translation.x() = -0.46;   // 2 cm into the bottle
  map_.objects[4].superquadric.T_map_object.translation.z() -= 0.006;  // into the table
  for (SnapshotObject& object : map_.objects) {
    object.fit.covariance.diagonal().setConstant(1e-4);
  }
  EXPECT_THAT(Export().notes, ::testing::IsEmpty());
  Simulation simulation(File());
  ASSERT_TRUE(simulation);
  EXPECT_NEAR(
      (simulation.Position(simulation.Body("2 cup")) - simulation.Position(simulation.Body("4 bottle")))
          .head<2>()
          .norm(),
      0.082, 1e-3);
  simulation.ExpectToRest();
}

TEST_F(Mjcf, ReportsWhatCovariancesDoNotExplain) {
  map_.objects[1].superquadric.T_map_object.translation.x() = -0.46;
  EXPECT_THAT(Export().notes, ::testing::Contains(HasSubstr("2 cup was moved by")));
}

TEST_F(Mjcf, RefusesMapsWithoutScaleGravityOrObjects) {
  const auto error = [this] {
    try {
      Export();
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("none");
  };
  map_.metric = false;
  EXPECT_THAT(error(), HasSubstr("the map has no scale, expected sqslam scale before, or --scale METRES"));
  map_.metric = true;
  map_.gravity_known = false;
  EXPECT_THAT(error(), HasSubstr("not aligned with gravity"));
  map_.gravity_known = true;
  map_.objects.clear();
  EXPECT_THAT(error(), HasSubstr("no reliable objects"));
}

// Files of your own: SQSLAM_TEST_SCENES=a.xml:b.xml
TEST(RealScene, RestsForTwoSeconds) {
  const char* files = std::getenv("SQSLAM_TEST_SCENES");
  if (files == nullptr) {
    GTEST_SKIP() << "SQSLAM_TEST_SCENES names no exported scenes";
  }
  for (const std::string& file : Split(files, ':')) {
    SCOPED_TRACE(file);
    Simulation simulation(file);
    ASSERT_TRUE(simulation);
    simulation.ExpectToRest();
  }
}

}  // namespace
}  // namespace sqslam::app
