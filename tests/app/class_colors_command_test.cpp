#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "app/export/glb_file.h"
#include "app/export/map_view.h"
#include "render/scene/style.h"
#include "run_program.h"
#include "slam/io/result_files.h"
#include "slam/snapshot/recording.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using testing::RunProgram;
using testing::Slurp;

// Two maps that share only the cup: with a book and a ball, and with a tv and two classes of one's own.
class ClassColorsCommandTest : public ::testing::Test {
 protected:
  void SetUp() override {
    MapSnapshot map = HandMadeMap();
    Write("desk", map);
    map.objects[0].label = "gadget";
    map.objects[2].label = "tv";
    map.objects.push_back(map.objects[2]);
    map.objects.back().id = 3;
    map.objects.back().label = "gizmo";
    map.objects.back().superquadric.T_map_object.translation.y() += 0.5;
    Write("office", map);
  }

  void Write(const std::string& name, const MapSnapshot& map) const {
    fs::create_directories(Path(name));
    RecordingWriter writer(Path(name) / "map.sqmap", {});
    writer.Add(map);
    writer.Close();
    WriteObjects(Path(name) / "objects.json", map.objects);
  }

  fs::path Path(const std::string& name) const { return folder_.Path() / name; }

  // Returns what a command writes to a file; `settings`: of the style.
  std::string Output(const std::string& command, const std::string& map, const std::string& file,
                     const std::string& settings) const {
    const fs::path output = Path(map) / file;
    const auto run = RunProgram(
        fmt::format("{} {} -o {} --quiet {}", command, Path(map).string(), output.string(), settings));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return Slurp(output);
  }

  // Returns whether the cup has this colour, by kind of output.
  std::map<std::string, bool> CupHas(const std::string& color, const std::string& map,
                                     const std::string& settings) const {
    std::map<std::string, bool> found;
    Output("export", map, "map.obj", settings);
    const Eigen::Vector3d rgb = ParseColor(color);
    found["obj"] = Slurp(Path(map) / "map.mtl")
                       .find(fmt::format("newmtl cup\nKa 0 0 0\nKd {:.4f} {:.4f} {:.4f}\n", rgb.x(), rgb.y(),
                                         rgb.z())) != std::string::npos;
    found["figure"] =
        Output("figure maps", map, "maps.svg", "--no-images " + settings).find(color) != std::string::npos;
    Output("render", map, "map.png", "--resolution 640,480 " + settings);
    const cv::Mat picture = cv::imread((Path(map) / "map.png").string());
    const cv::Vec3b bgr(static_cast<std::uint8_t>(std::lround(255.0 * rgb.z())),
                        static_cast<std::uint8_t>(std::lround(255.0 * rgb.y())),
                        static_cast<std::uint8_t>(std::lround(255.0 * rgb.x())));
    cv::Mat legend;
    cv::inRange(picture, bgr, bgr, legend);
    found["picture"] = cv::countNonZero(legend) > 20;  // the legend's swatch
    const std::string glb = Output("export", map, "map.glb", settings);
    found["glb"] = MaterialOf(glb, "cup", rgb);
    return found;
  }

  static bool MaterialOf(const std::string& glb, const std::string& name, const Eigen::Vector3d& rgb) {
    std::uint32_t length = 0;
    std::memcpy(&length, glb.data() + 12, sizeof(length));
    const json gltf = json::parse(glb.substr(20, length));
    for (const json& material : gltf["materials"]) {
      if (material["name"] == name) {
        const double red = material["pbrMetallicRoughness"]["baseColorFactor"][0].get<double>();
        return std::abs(red - std::pow((rgb.x() + 0.055) / 1.055, 2.4)) < 1e-4;
      }
    }
    return false;
  }

  std::string PageColor(const std::string& map, const SceneStyle& style) const {
    const RecordingReader reader(Path(map) / "map.sqmap");
    const app::MapView view =
        app::ReadMapView(reader, app::ReadHistory(reader), Path(map) / "map.sqmap", {.style = style});
    const json scene = json::parse(view.scene);
    for (const json& object : scene["objects"]) {
      if (object["label"] == "cup") {
        return object["color"];
      }
    }
    return "";
  }

  TemporaryFolder folder_;
};

TEST_F(ClassColorsCommandTest, KeepsColourOfClassWhateverElseIsThere) {
  const std::string cup = FormatColor(LabelColors()("cup"));
  for (const char* map : {"desk", "office"}) {
    for (const auto& [output, same] : CupHas(cup, map, "")) {
      EXPECT_TRUE(same) << map << ", " << output;
    }
    EXPECT_EQ(PageColor(map, {}), cup) << map;
  }
}

TEST_F(ClassColorsCommandTest, ObeysOwnColourInEveryOutput) {
  const std::string own = "#22aa55";
  for (const auto& [output, same] : CupHas(own, "desk", "--set 'objects.colors.cup=" + own + "'")) {
    EXPECT_TRUE(same) << output;
  }
  for (const auto& [output, same] : CupHas(own, "desk", "")) {
    EXPECT_FALSE(same) << output;
  }
  const std::string style = Path("mine.yaml").string();
  std::ofstream(style) << "objects:\n  colors:\n    cup: \"" << own << "\"\n";
  for (const auto& [output, same] : CupHas(own, "office", "--style " + style)) {
    EXPECT_TRUE(same) << output;
  }
  EXPECT_EQ(PageColor("desk", LoadStyle(style)), own);
}

TEST_F(ClassColorsCommandTest, WritesOwnColourIntoExportedPage) {
  const std::string plain = Output("export", "desk", "map.html", "");
  const std::string own = Output("export", "desk", "map.html", "--set 'objects.colors.cup=#22aa55'");
  EXPECT_NE(plain, own);
}

TEST_F(ClassColorsCommandTest, RefusesStyleForFilesWithoutColours) {
  const auto run = RunProgram("export " + Path("desk").string() + " -o " + Path("objects.json").string() +
                              " --set 'objects.colors.cup=#22aa55'");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("--set"));
}

}  // namespace
}  // namespace sqslam
