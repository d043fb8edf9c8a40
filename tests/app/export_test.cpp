#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkFloatArray.h>
#include <vtkGLTFDocumentLoader.h>
#include <vtkMassProperties.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkTransform.h>
#include <vtkTransformPolyDataFilter.h>
#include <vtkTriangleFilter.h>

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "app/export/glb_file.h"
#include "render/scene/style.h"
#include "render/solids/scene_order.h"
#include "run_program.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/object_parts.h"
#include "slam/snapshot/recording.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::RunProgram;
using testing::Slurp;

// A node as another program sees it: its geometry in the world of the file.
struct SeenNode {
  vtkSmartPointer<vtkPolyData> geometry;
  std::array<double, 16> matrix{};
  int camera = -1;
};

class ExportTest : public ::testing::Test {
 protected:
  void SetUp() override {
    map_ = HandMadeMap();
    map_.objects[1].superquadric.T_map_object.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
    map_.objects[1].observations = 17;
    Write(map_);
  }

  void Write(const MapSnapshot& map) {
    fs::remove(folder_.Path() / "map.sqmap");
    RecordingWriter writer(folder_.Path() / "map.sqmap", {});
    writer.Add(map);
    writer.Close();
  }

  std::string Export(const std::string& name, const std::string& more = "") {
    const fs::path output = folder_.Path() / name;
    const auto run =
        RunProgram("export " + folder_.Path().string() + " --output " + output.string() + " " + more);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return output.string();
  }

  static std::map<std::string, SeenNode> ReadGlb(const std::string& file) {
    const vtkNew<vtkGLTFDocumentLoader> loader;
    EXPECT_TRUE(loader->LoadModelMetaDataFromFile(file));
    std::vector<char> buffer;
    EXPECT_TRUE(loader->LoadFileBuffer(file, buffer));
    EXPECT_TRUE(loader->LoadModelData(buffer));
    EXPECT_TRUE(loader->BuildModelVTKGeometry());
    const auto model = loader->GetInternalModel();
    std::map<std::string, SeenNode> nodes;
    loader->BuildGlobalTransforms();
    for (const auto& node : model->Nodes) {
      SeenNode& seen = nodes[node.Name];
      std::memcpy(seen.matrix.data(), node.GlobalTransform->GetData(), sizeof(seen.matrix));
      seen.camera = node.Camera;
      if (node.Mesh >= 0) {
        const vtkNew<vtkTransform> transform;
        transform->SetMatrix(node.GlobalTransform);
        const vtkNew<vtkTransformPolyDataFilter> filter;
        filter->SetTransform(transform);
        filter->SetInputData(model->Meshes[static_cast<std::size_t>(node.Mesh)].Primitives.front().Geometry);
        filter->Update();
        seen.geometry = filter->GetOutput();
      }
    }
    return nodes;
  }

  TemporaryFolder folder_;
  MapSnapshot map_;
};

// glTF is y up: (x, y, z) of the map is (x, z, -y) there.
Eigen::Vector3d InFile(const Eigen::Vector3d& p_map) { return {p_map.x(), p_map.z(), -p_map.y()}; }

// Returns the list or tuple that is the value of a name after `from` in a text of USD.
json UsdValue(const std::string& text, const std::string& name, std::size_t from = 0) {
  const std::size_t at = text.find(name + " = ", from);
  std::string value = at == text.npos
                          ? "null"
                          : text.substr(at + name.size() + 3, text.find('\n', at) - at - name.size() - 3);
  value = value.ends_with("] (") ? value.substr(0, value.size() - 2) : value;
  std::ranges::replace(value, '(', '[');
  std::ranges::replace(value, ')', ']');
  return json::parse(value, nullptr, false);
}

TEST_F(ExportTest, WritesSceneDescription) {
  const fs::path file = folder_.Path() / "map.usda";
  const auto run = RunProgram("export " + (folder_.Path() / "map.sqmap").string() + " -o " + file.string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string text = Slurp(file);
  EXPECT_TRUE(text.starts_with("#usda 1.0\n"));
  for (const auto& [open, close] : {std::pair('{', '}'), {'(', ')'}, {'[', ']'}}) {
    EXPECT_EQ(std::ranges::count(text, open), std::ranges::count(text, close)) << open;
  }
  const std::size_t cup = text.find("def Mesh \"cup_1\"");
  ASSERT_NE(cup, text.npos);
  const json points = UsdValue(text, "points", cup), indices = UsdValue(text, "faceVertexIndices", cup);
  ASSERT_TRUE(points.is_array() && indices.is_array());
  EXPECT_EQ(indices.size(), 3 * UsdValue(text, "faceVertexCounts", cup).size());
  EXPECT_EQ(UsdValue(text, "normals", cup).size(), points.size());
  Eigen::AlignedBox3d box;
  for (const json& index : indices) {
    ASSERT_LT(index.get<std::size_t>(), points.size());
    const json& p = points[index.get<std::size_t>()];
    box.extend(Eigen::Vector3d(p[0], p[1], p[2]));
  }
  const SnapshotObject& object = map_.objects[1];
  EXPECT_TRUE(box.max().isApprox(object.superquadric.shape.half_size, 1e-5));
  const json centre = UsdValue(text, "xformOp:translate", cup), q = UsdValue(text, "xformOp:orient", cup);
  EXPECT_NEAR(centre[2].get<double>(), object.superquadric.T_map_object.translation.z(), 1e-6);
  EXPECT_NEAR(q[3].get<double>(), std::sin(0.2), 1e-6);  // w x y z, turned by 0.4
  const std::size_t cloud = text.find("def Points");
  EXPECT_EQ(UsdValue(text, "points", cloud).size(), map_.points.size());
  EXPECT_EQ(UsdValue(text, "primvars:displayColor", cloud).size(), map_.points.size());
  const std::size_t path = text.find("def BasisCurves");
  EXPECT_EQ(UsdValue(text, "points", path).size(), UsdValue(text, "curveVertexCounts", path)[0]);
}

TEST_F(ExportTest, PlacesEachObjectInGlbByName) {
  const auto nodes = ReadGlb(Export("map.glb"));
  for (const SnapshotObject& object : map_.objects) {
    const auto node = nodes.find(fmt::format("{} {}", object.id, object.label));
    ASSERT_NE(node, nodes.end()) << object.label;
    const PosedSuperquadric& solid = object.superquadric;
    double bounds[6];
    node->second.geometry->GetBounds(bounds);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d n = Eigen::Vector3d::Unit(axis == 1 ? 2 : axis == 2 ? 1 : 0);
      const double extent = SupportExtent(solid, n);
      const double center = InFile(solid.T_map_object.translation)[axis];
      EXPECT_NEAR(bounds[2 * axis], center - extent, 0.01 * extent) << object.label << " axis " << axis;
      EXPECT_NEAR(bounds[2 * axis + 1], center + extent, 0.01 * extent) << object.label << " axis " << axis;
    }
    const vtkNew<vtkMassProperties> mass;
    mass->SetInputData(node->second.geometry);
    EXPECT_NEAR(mass->GetVolume() / solid.shape.Volume(), 1.0, 0.01) << object.label;
  }
}

TEST_F(ExportTest, WritesPartsInsteadOfTheHull) {
  const std::vector<SolidPart> parts = {{{0.0, 0.0, 0.75}, {{1.0, 1.0, 0.25}, 0.15, 0.15}},
                                        {{-0.5, 0.0, -0.25}, {{0.2, 0.5, 0.75}, 0.15, 0.15}}};
  StoreObjectParts(folder_.Path() / "map.sqmap",
                   {{map_.objects[0].id, map_.objects[0].superquadric.shape.half_size, parts}});
  map_.objects[0].parts = parts;
  double volume = 0.0;
  for (const PosedSuperquadric& solid : SolidsOf(map_.objects[0])) {
    volume += solid.shape.Volume();
  }
  const auto nodes = ReadGlb(Export("map.glb"));
  const vtkNew<vtkMassProperties> mass;
  mass->SetInputData(nodes.at("0 book").geometry);
  EXPECT_NEAR(mass->GetVolume() / volume, 1.0, 0.01);
  const std::string obj = Slurp(Export("map.obj"));
  StoreObjectParts(folder_.Path() / "map.sqmap", {});
  EXPECT_GT(obj.size(), Slurp(Export("hulls.obj")).size());
}

TEST_F(ExportTest, WritesPointsPathAndCamerasToGlb) {
  Trajectory trajectory;
  for (int i = 0; i < 5; ++i) {
    trajectory.push_back({0.1 * i, {Eigen::Quaterniond::Identity(), {0.5 * i, 1.0, 2.0}}});
  }
  WriteTrajectory(folder_.Path() / "trajectory.txt", trajectory);
  const auto nodes = ReadGlb(Export("map.glb"));
  const auto& points = nodes.at("points").geometry;
  ASSERT_EQ(points->GetNumberOfPoints(), 400);
  const Eigen::Vector3d expected = InFile(map_.points[123].p_map.cast<double>());
  EXPECT_LT((Eigen::Map<const Eigen::Vector3d>(points->GetPoint(123)) - expected).norm(), 1e-6);
  const auto& path = nodes.at("trajectory").geometry;
  ASSERT_EQ(path->GetNumberOfPoints(), 5);
  EXPECT_NEAR(path->GetPoint(4)[0], 2.0, 1e-6);
  EXPECT_NEAR(path->GetPoint(4)[2], -1.0, 1e-6);
  const SeenNode& camera = nodes.at("keyframe 3");
  EXPECT_EQ(camera.camera, 0);
  // It looks along its -z: the third column of the matrix points away from the middle of the desk.
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(camera.matrix.data());
  const Rigid3d& pose = map_.keyframes[3].T_map_camera;
  EXPECT_LT((matrix.block<3, 1>(0, 2) + InFile(pose.rotation * Eigen::Vector3d::UnitZ())).norm(), 1e-6);
  EXPECT_LT((matrix.block<3, 1>(0, 1) + InFile(pose.rotation * Eigen::Vector3d::UnitY())).norm(), 1e-6);
  EXPECT_LT((matrix.block<3, 1>(0, 3) - InFile(pose.translation)).norm(), 1e-6);
}

// The JSON of a .glb, after its header has been checked.
json JsonOf(const std::string& bytes) {
  std::array<std::uint32_t, 5> words{};
  std::memcpy(words.data(), bytes.data(), sizeof(words));
  EXPECT_THAT(words, ElementsAre(0x46546C67u, 2u, bytes.size(), words[3], 0x4E4F534Au));
  EXPECT_EQ(words[3] % 4, 0u);
  return json::parse(bytes.substr(20, words[3]));
}

TEST_F(ExportTest, FollowsGlbSpecification) {
  const std::string bytes = Slurp(Export("map.glb"));
  const json gltf = JsonOf(bytes);
  std::uint32_t json_length = 0;
  std::memcpy(&json_length, bytes.data() + 12, 4);
  const std::size_t binary = 20 + json_length + 8;
  ASSERT_EQ(gltf["buffers"].size(), 1u);
  const std::size_t length = gltf["buffers"][0]["byteLength"];
  EXPECT_LE(binary + length, bytes.size());
  EXPECT_LT(bytes.size() - binary - length, 4u);
  const std::map<int, int> sizes = {{5123, 2}, {5125, 4}, {5126, 4}};
  const std::map<std::string, int> components = {{"SCALAR", 1}, {"VEC3", 3}, {"VEC4", 4}};
  for (const json& accessor : gltf["accessors"]) {
    const json& view = gltf["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    const std::size_t offset = view["byteOffset"];
    const std::size_t element =
        static_cast<std::size_t>(sizes.at(accessor["componentType"]) * components.at(accessor["type"]));
    EXPECT_EQ(offset % 4, 0u);
    EXPECT_EQ(accessor["count"].get<std::size_t>() * element, view["byteLength"].get<std::size_t>());
    EXPECT_LE(offset + view["byteLength"].get<std::size_t>(), length);
    EXPECT_TRUE(view.value("target", 0) == 34963 || element % 4 == 0);  // vertices at multiples of four
  }
  for (const json& mesh : gltf["meshes"]) {
    const json& position =
        gltf["accessors"][mesh["primitives"][0]["attributes"]["POSITION"].get<std::size_t>()];
    const json& view = gltf["bufferViews"][position["bufferView"].get<std::size_t>()];
    std::vector<Eigen::Vector3f> values(position["count"].get<std::size_t>());
    std::memcpy(values.data(), bytes.data() + binary + view["byteOffset"].get<std::size_t>(),
                values.size() * 12);
    for (int axis = 0; axis < 3; ++axis) {
      const auto less = [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; };
      EXPECT_EQ((*std::min_element(values.begin(), values.end(), less))[axis],
                position["min"][static_cast<std::size_t>(axis)].get<float>());
      EXPECT_EQ((*std::max_element(values.begin(), values.end(), less))[axis],
                position["max"][static_cast<std::size_t>(axis)].get<float>());
    }
  }
}

TEST(GlbFile, RefusesFilesBeyondFormatLimit) {
  const std::vector<Eigen::Vector3f> points(10, Eigen::Vector3f::Ones());  // 120 bytes
  nlohmann::ordered_json root;
  root["name"] = "root";
  const auto write = [&](std::size_t longest) {
    app::GlbFile file("test", longest);
    file.AddPositions(points);
    return file.Bytes(file.AddNode(root), "scene");
  };
  const std::string whole = write(app::GlbFile::kMaxBytes);
  EXPECT_EQ(write(whole.size()), whole);
  EXPECT_THAT(InputErrorOf([&] { write(whole.size() - 1); }),
              HasSubstr(fmt::format("expected at most {}, the limit", whole.size() - 1)));
  app::GlbFile file("test", 230);
  file.AddPositions(points);
  EXPECT_THAT(InputErrorOf([&] { file.AddPositions(points); }), HasSubstr("240 bytes or more"));
}

TEST_F(ExportTest, DescribesObjectsInGlb) {
  const json gltf = JsonOf(Slurp(Export("map.glb")));
  const auto cup = std::find_if(gltf["nodes"].begin(), gltf["nodes"].end(),
                                [](const json& node) { return node["name"] == "1 cup"; });
  ASSERT_NE(cup, gltf["nodes"].end());
  const json& extras = (*cup)["extras"];
  EXPECT_EQ(extras["label"], "cup");
  EXPECT_EQ(extras["id"], 1);
  EXPECT_EQ(extras["observations"], 17);
  EXPECT_EQ(extras["half_size"], json({0.12, 0.12, 0.2}));
  EXPECT_EQ(extras["e1"], 0.2);
  EXPECT_EQ(extras["e2"], 1.0);
  const json& mesh = gltf["meshes"][(*cup)["mesh"].get<std::size_t>()];
  const json& material = gltf["materials"][mesh["primitives"][0]["material"].get<std::size_t>()];
  EXPECT_EQ(material["name"], "cup");
  const double green = LabelColors()("cup").y();
  EXPECT_NEAR(material["pbrMetallicRoughness"]["baseColorFactor"][1].get<double>(),
              std::pow((green + 0.055) / 1.055, 2.4), 1e-6);
}

// The animation's sampler for a node, with the last of its times.
std::pair<json, double> ChannelOf(const json& gltf, const std::string& name, const std::string& path) {
  for (const json& channel : gltf["animations"][0]["channels"]) {
    const json& target = channel["target"];
    if (gltf["nodes"][target["node"].get<std::size_t>()]["name"] == name && target["path"] == path) {
      const json& sampler = gltf["animations"][0]["samplers"][channel["sampler"].get<std::size_t>()];
      return {sampler, gltf["accessors"][sampler["input"].get<std::size_t>()]["max"][0]};
    }
  }
  ADD_FAILURE() << "no channel for " << path << " of " << name;
  return {};
}

TEST_F(ExportTest, AnimatesFlightAndAppearanceInGlb) {
  MapSnapshot early = map_;
  early.objects.resize(1);
  early.timestamp = 1.0;
  fs::remove(folder_.Path() / "map.sqmap");
  RecordingWriter writer(folder_.Path() / "map.sqmap", {});
  writer.Add(early);
  writer.Add(map_);
  writer.Close();
  const json gltf = JsonOf(Slurp(Export("map.glb")));
  const auto [book, book_seen] = ChannelOf(gltf, "0 book", "scale");
  const auto [cup, cup_seen] = ChannelOf(gltf, "1 cup", "scale");
  EXPECT_EQ(book["interpolation"], "STEP");
  EXPECT_NEAR(book_seen, 1.0, 1e-6);
  EXPECT_NEAR(cup_seen, 7.0 / 3.0, 1e-6);
  const auto [flight, end] = ChannelOf(gltf, "flight", "translation");
  EXPECT_EQ(flight["interpolation"], "LINEAR");
  EXPECT_NEAR(end, 7.0 / 3.0, 1e-6);
  EXPECT_EQ(gltf["accessors"][flight["output"].get<std::size_t>()]["count"], 8);
  ChannelOf(gltf, "flight", "rotation");
}

TEST_F(ExportTest, LimitsGlbNamesToBlendersLength) {
  map_.objects[0].label = std::string(30, 'x') + "äöü" + std::string(40, 'y');
  map_.objects[0].id = 1234567;
  Write(map_);
  const json gltf = JsonOf(Slurp(Export("map.glb")));
  for (const json& node : gltf["nodes"]) {
    EXPECT_LE(node["name"].get<std::string>().size(), 63u);
  }
}

TEST_F(ExportTest, PassesGltfValidator) {
  const std::string validate =
      fmt::format("node {}/tests/support/validate_gltf.js {} >{} 2>&1", SQSLAM_SOURCE_DIR, Export("map.glb"),
                  (folder_.Path() / "issues.json").string());
  const int status = std::system(validate.c_str());
  if (WEXITSTATUS(status) == 77 || WEXITSTATUS(status) == 127) {
    GTEST_SKIP() << "no node, or no gltf-validator: scripts/test.sh installs it where there is npm";
  }
  const json issues = json::parse(Slurp(folder_.Path() / "issues.json"), nullptr, false);
  ASSERT_TRUE(issues.is_object()) << Slurp(folder_.Path() / "issues.json");
  EXPECT_EQ(issues["numErrors"], 0) << issues.dump(1);
  EXPECT_EQ(issues["numWarnings"], 0) << issues.dump(1);
}

TEST_F(ExportTest, WritesValidGlbOfEmptyMap) {
  map_.objects.clear();
  map_.points.clear();
  map_.keyframes.clear();
  Write(map_);
  const json gltf = JsonOf(Slurp(Export("map.glb")));
  EXPECT_EQ(gltf["nodes"].size(), 1u);
  for (const char* list : {"meshes", "accessors", "bufferViews", "buffers", "materials", "cameras"}) {
    EXPECT_FALSE(gltf.contains(list)) << list;  // glTF knows no empty list
  }
}

TEST_F(ExportTest, WritesObjWithNamesAndColours) {
  const std::string obj = Slurp(Export("desk.obj"));
  EXPECT_THAT(obj, HasSubstr("mtllib desk.mtl\n"));
  EXPECT_THAT(obj, HasSubstr("o cup_1\nusemtl cup\n"));
  const std::string mtl = Slurp(folder_.Path() / "desk.mtl");
  for (const SnapshotObject& object : map_.objects) {
    EXPECT_THAT(mtl, HasSubstr("newmtl " + object.label + "\n"));
  }
}

// Faces of a .obj by object, as indices of its own vertices.
struct ObjObject {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::vector<std::size_t>> faces;
};

std::vector<ObjObject> ReadObj(const std::string& file) {
  std::vector<ObjObject> objects;
  std::size_t before = 0;
  std::istringstream lines(Slurp(file));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "o") {
      before += objects.empty() ? 0 : objects.back().points.size();
      objects.emplace_back();
    } else if (kind == "v") {
      Eigen::Vector3d p;
      words >> p.x() >> p.y() >> p.z();
      objects.back().points.push_back(p);
    } else if (kind == "f") {
      objects.back().faces.emplace_back();
      for (std::string corner; words >> corner;) {
        objects.back().faces.back().push_back(std::stoul(corner) - 1 - before);
      }
    }
  }
  return objects;
}

TEST_F(ExportTest, WritesClosedMeshesWithoutDegenerateTriangles) {
  map_.objects[0].superquadric.shape = {{0.6, 0.4, 0.01}, 0.1, 0.1};  // a table top
  Write(map_);
  const std::vector<ObjObject> objects = ReadObj(Export("closed.obj"));
  ASSERT_EQ(objects.size(), map_.objects.size());
  for (std::size_t k = 0; k < objects.size(); ++k) {
    const auto& [points, faces] = objects[k];
    std::map<std::pair<std::size_t, std::size_t>, int> edges;
    double volume = 0.0;
    for (const std::vector<std::size_t>& face : faces) {
      ASSERT_GE(face.size(), 3U);
      for (std::size_t i = 0; i < face.size(); ++i) {
        ++edges[std::pair(face[i], face[(i + 1) % face.size()])];
      }
      for (std::size_t i = 2; i < face.size(); ++i) {
        const Eigen::Vector3d &a = points[face[0]], &b = points[face[i - 1]], &c = points[face[i]];
        EXPECT_GT((b - a).cross(c - a).norm(), 1e-12);
        volume += a.dot(b.cross(c)) / 6.0;
      }
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      EXPECT_EQ(edges.count(std::pair(edge.second, edge.first)), 1U) << "an edge of one face only";
    }
    EXPECT_NEAR(volume / map_.objects[k].superquadric.shape.Volume(), 1.0, 0.02);
  }
}

TEST_F(ExportTest, TurnsObjUpright) {
  const ObjObject up_y = ReadObj(Export("y.obj")).front();
  const ObjObject up_z = ReadObj(Export("z.obj", "--up z")).front();
  EXPECT_THAT(Slurp(folder_.Path() / "y.obj"), HasSubstr("; in this file y up\n"));
  for (std::size_t i = 0; i < up_z.points.size(); ++i) {
    EXPECT_LT((InFile(up_z.points[i]) - up_y.points[i]).norm(), 1e-6);
  }
  const auto run = RunProgram("export " + folder_.Path().string() + " --output x.glb --up z");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("--up: applies to a .obj only"));
}

TEST_F(ExportTest, MakesFolderOfOutput) { EXPECT_NE(Slurp(Export("new/folder/points.ply")), ""); }

TEST_F(ExportTest, WritesPointsOrMeshesToPly) {
  EXPECT_THAT(Slurp(Export("points.ply")).substr(0, 200), HasSubstr("element vertex 400\n"));
  const std::string meshes = Slurp(Export("meshes.ply", "--meshes")).substr(0, 500);
  EXPECT_THAT(meshes, HasSubstr("property uchar red\n"));
  EXPECT_THAT(meshes, HasSubstr("element face 6144\n"));
  const auto run = RunProgram("export " + folder_.Path().string() + " --output x.obj --meshes");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr(".ply"));
}

}  // namespace
}  // namespace sqslam
