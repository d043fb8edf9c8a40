#include "app/export/map_view.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "app/report/report.h"
#include "run_program.h"
#include "slam/scene/query.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/render/baseline.h"
#include "tests/render/hand_made_map.h"
#include "tests/scene/made_room.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::RunProgram;
using testing::Slurp;

constexpr int kFirstObjectAlone = 30;  // frame at which the map holds but one object

// A recording of two states: the book alone, then all; the last keyframe with its image.
class MapViewTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const fs::path image = folder_.Path() / "70.png";
    cv::Mat picture(240, 320, CV_8UC3, cv::Scalar(90, 120, 160));
    cv::circle(picture, {160, 120}, 40, {30, 60, 200}, cv::FILLED);
    cv::imwrite(image.string(), picture);
    MapSnapshot map = HandMadeMap();
    map.image_path = image.string();
    map.objects[1].fit.reliability = 0.1;
    for (SnapshotObject& object : map.objects) {
      map.detections.push_back({{}, object.id});
    }
    MapSnapshot first = map;
    first.frame_index = kFirstObjectAlone;
    first.timestamp = 1.0;
    first.objects.resize(1);
    first.detections.clear();
    first.image_path.clear();
    RecordingWriter writer(folder_.Path() / "map.sqmap", {});
    writer.Add(first);
    writer.Add(map);
    writer.Close();
  }

  std::string Export() {
    const fs::path page = folder_.Path() / "map.html";
    const auto run = RunProgram("export " + folder_.Path().string() + " --output " + page.string());
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return page.string();
  }

  TemporaryFolder folder_;
};

class MapViewInBrowserTest : public MapViewTest {
 protected:
  void SetUp() override {
    MapViewTest::SetUp();
    if (std::system("command -v chromium >/dev/null && command -v python3 >/dev/null") != 0) {
      GTEST_SKIP() << "no chromium or python3: packages-test.txt";
    }
  }

  // Runs the page in Chromium (tests/support/browser.py) and returns its report. The steps of `then` follow
  // once the view is there.
  json InBrowser(const std::string& page, json then) {
    json steps = json::array({{{"wait", "document.querySelector('[data-ready],[data-failed]') !== null"}}});
    for (json& step : then) {
      steps.push_back(std::move(step));
    }
    const fs::path out = folder_.Path() / "seen.json";
    std::string quoted = steps.dump();
    for (std::size_t at = 0; (at = quoted.find('\'', at)) != std::string::npos; at += 4) {
      quoted.replace(at, 1, "'\\''");
    }
    const std::string command = fmt::format("python3 {}/tests/support/browser.py {} 640,400 '{}' >{}",
                                            SQSLAM_SOURCE_DIR, page, quoted, out.string());
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return json::parse(Slurp(out), nullptr, false);
  }
};

TEST_F(MapViewTest, WritesOneFileThatNamesItsLibrary) {
  const std::string page = Slurp(Export());
  EXPECT_THAT(page, HasSubstr("three.js authors, MIT licence"));
  for (const char* of_others : {"<link", " src=", "url(", "import("}) {
    EXPECT_THAT(page.substr(0, page.find("three.js authors")), Not(HasSubstr(of_others)));
  }
  EXPECT_LT(page.size(), 2u << 20);
}

TEST_F(MapViewTest, WritesTrueCameraPathInPagesOnly) {
  const auto run = RunProgram("export " + folder_.Path().string() + " -o x.glb --ground-truth auto");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr(".html"));
}

TEST_F(MapViewTest, LimitsImages) {
  const RecordingReader reader(folder_.Path() / "map.sqmap");
  app::ViewHistory history = app::ReadHistory(reader);
  for (const SnapshotKeyframe& keyframe : reader.Last()->keyframes) {
    history.image_files[keyframe.frame_index] = reader.Last()->image_path;
  }
  for (const int most : {0, 1, 2, 8}) {
    app::MapViewOptions options;
    options.images = most;
    const app::MapView view = app::ReadMapView(reader, history, folder_.Path() / "map.sqmap", {}, options);
    EXPECT_LE(static_cast<int>(view.images.size()), most);
    EXPECT_EQ(view.images.empty(), most == 0);
  }
}

TEST_F(MapViewTest, KeepsMillisecondsInLongRuns) {
  MapSnapshot map = HandMadeMap();
  map.keyframes[1].timestamp = map.keyframes[0].timestamp + 12345.678;
  RecordingWriter(folder_.Path() / "long.sqmap", {}).Add(map);
  const RecordingReader reader(folder_.Path() / "long.sqmap");
  const app::MapView view = app::ReadMapView(reader, {}, folder_.Path() / "long.sqmap", {});
  const json scene = json::parse(view.scene);
  EXPECT_EQ(scene["keyframes"].back()["time"].get<double>(), 12345.678);
  EXPECT_EQ(scene["path"]["times"].back().get<double>(), 12345.678);
}

TEST_F(MapViewTest, ReadsStatesOnce) {
  int read = 0;
  const RecordingReader reader(folder_.Path() / "map.sqmap", [&](MapSnapshotPtr map) {
    read += map->frame_index == kFirstObjectAlone ? 1 : 0;
    return map;
  });
  const app::ViewHistory history = app::ReadHistory(reader);
  EXPECT_TRUE(app::BestPhoto(reader, history));
  app::ReadMapView(reader, history, folder_.Path() / "map.sqmap", {});
  EXPECT_EQ(read, 1);
}

TEST_F(MapViewInBrowserTest, OpensInBrowserWithoutMessages) {
  const fs::path shot = folder_.Path() / "view.png";
  const json seen = InBrowser(
      Export(),
      {{{"eval", "document.querySelectorAll('.sq > :not(canvas)').forEach(e => e.style.display = 'none')"}},
       {{"shot", shot.string()}}});
  EXPECT_THAT(seen["console"], IsEmpty()) << seen["console"];
  EXPECT_EQ(seen["requests"].size(), 1u) << seen["requests"];  // the page itself
  ExpectBaseline(cv::imread(shot.string()), "map_page");
}

// Every question gets the answers, or the error, of AnswerQuery.
TEST_F(MapViewInBrowserTest, AnswersQuestionsAsTheCommandDoes) {
  RecordingWriter(folder_.Path() / "room.sqmap", {}).Add(testing::MadeRoom());
  MapSnapshot map = *RecordingReader(folder_.Path() / "room.sqmap").Last();
  std::ranges::sort(map.keyframes, {}, &SnapshotKeyframe::timestamp);
  const SceneGraph graph = SceneGraphOf(map, folder_.Path());
  const ClassTable classes = ClassTable::Named("default");
  const std::string page = (folder_.Path() / "room.html").string();
  ASSERT_EQ(RunProgram("export " + (folder_.Path() / "room.sqmap").string() + " -o " + page).exit_code, 0);
  json steps = json::array();
  std::vector<std::string> expected;
  for (const char* question : {"show me all the mugs",
                               "Which cups are on the table?",
                               "certain cups on the dining table",
                               "uncertain objects",
                               "books on a book",
                               "books in the shelves",
                               "apples inside bowls",
                               "chairs not under the table",
                               "things under cup 2",
                               "cups, bottles and bowls on the table",
                               "largest book",
                               "2 largest objects",
                               "lowest cup",
                               "tallest thing on the floor",
                               "cup nearest to the bottle",
                               "cup farthest from the bottle",
                               "objects next to cup 2",
                               "objects within 15 cm of the bottle",
                               "objects within 0.5m of the floor",
                               "on the table",
                               "objects leaning against the shelf",
                               "chairs right of the table seen from 0",
                               "chairs left of the table seen from frame 90",
                               "things above the chair and next to the bowl",
                               "cups on the tabel",
                               "cups on",
                               "nearest cup",
                               "cups within 0.3 units of the bowl",
                               "cups within 3 units of the bowl",
                               "cups of the bowl",
                               "cups left of the bowl"}) {
    std::string answer;
    try {
      for (const QueryAnswer& found : AnswerQuery(question, map, graph, classes)) {
        answer += fmt::format("{} ", map.objects[static_cast<std::size_t>(found.object)].id);
      }
    } catch (const UsageError& error) {
      answer = std::string(error.what()).substr(std::string("question: ").size());
    }
    expected.push_back(std::string(question) + ": " + answer);
    steps.push_back({{"eval", fmt::format("(() => {{ try {{ return sq.answer(sq.view, {}).map(({{index}}) => "
                                          "sq.view.data.objects[index].id + ' ').join('') }} catch (error) "
                                          "{{ return error.message }} }})()",
                                          json(question).dump())}});
  }
  const json seen = InBrowser(page, steps);
  ASSERT_EQ(seen["results"].size(), expected.size()) << seen;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const std::string question = expected[i].substr(0, expected[i].find(": "));
    EXPECT_EQ(question + ": " + seen["results"][i].get<std::string>(), expected[i]);
  }
}

TEST_F(MapViewInBrowserTest, FadesAllButTheAnswers) {
  const auto ask = [](const char* text) {
    return json{
        {"eval", fmt::format("sq.search(sq.view, '{}'), "
                             "sq.view.objects.map(o => (o.row.hidden ? '-' : '+') + (sq.isFaint(sq.view, o) "
                             "? 'faint' : 'shown')).join(' ') + "
                             "'|' + document.querySelector('.sq-ask div').textContent",
                             text)}};
  };
  const json seen =
      InBrowser(Export(), {ask("largest object"), ask("mugs"), ask("book"), ask("cupz"), ask("")});
  EXPECT_THAT(
      seen["results"],
      ElementsAre("+shown -faint -faint|book 0", "-faint +shown -faint|cup 1", "+shown -faint -shown|",
                  "-shown -faint -shown|'cupz' is not known; did you mean 'cup'?", "+shown +faint +shown|"))
      << seen;
}

TEST_F(MapViewInBrowserTest, SelectsObjectsByClick) {
  const json seen = InBrowser(
      Export(),
      {{{"click",
         "(() => { const at = sq.view.project(sq.view.objects[0].center); return [at.x, at.y]; })()"}},
       {{"eval", "document.querySelector('.sq-detail h2').textContent"}},
       {{"eval", "document.querySelectorAll('.sq-detail .sq-photo polygon.sq-chosen').length"}},
       {{"key", "Escape"}},
       {{"eval", "sq.view.state.selected"}}});
  EXPECT_THAT(seen["results"], ElementsAre("book 0", 1, -1)) << seen;
}

TEST_F(MapViewInBrowserTest, ShowsKeyframeImagesWithOutlines) {
  const json seen = InBrowser(
      Export(),
      {{{"click",
         "(() => { const at = sq.view.project(new THREE.Vector3(...sq.view.data.keyframes[7].pose)); "
         "return [at.x, at.y]; })()"}},
       {{"eval", "document.querySelector('.sq-box figcaption span').textContent"}},
       {{"eval", "document.querySelectorAll('.sq-box polygon').length"}},
       {{"eval", "sq.clock(59.97)"}}});
  EXPECT_THAT(seen["results"], ElementsAre("Keyframe 7, frame 70, 0:02.3", 3, "1:00.0")) << seen;
}

// Checks the page, also with an open list, against the rules of axe-core.
TEST_F(MapViewInBrowserTest, BreaksNoRuleOfAccessibility) {
  const fs::path axe = fs::path(SQSLAM_PROGRAM).parent_path() / "../node_modules/axe-core/axe.min.js";
  if (!fs::exists(axe)) {
    GTEST_SKIP() << "no axe-core: scripts/test.sh installs it where there is npm";
  }
  const char* check =
      "axe.run().then((found) => found.violations.map((one) => one.id + ' ' + one.nodes[0].failureSummary))";
  const json seen = InBrowser(Export(), {{{"run", axe.string()}},
                                         {{"eval", check}},
                                         {{"eval", "sq.select(sq.view, 0), sq.openPhoto(sq.view, 7)"}},
                                         {{"eval", check}},
                                         {{"key", "Escape"}},
                                         {{"size", {360, 740}}},
                                         {{"eval", check}}});
  EXPECT_EQ(seen["results"], json({json::array(), nullptr, json::array(), json::array()})) << seen;
}

TEST_F(MapViewInBrowserTest, KeepsArrowKeysWhereTheFocusIs) {
  const json seen = InBrowser(Export(), {{{"eval", "sq.view.objects[0].row.focus()"}},
                                         {{"key", "ArrowDown"}},
                                         {{"eval", "document.activeElement.textContent"}},
                                         {{"eval", "sq.view.state.motion"}},
                                         {{"eval", "sq.view.canvas.focus(), sq.view.eye.position.x"}},
                                         {{"key", "ArrowLeft"}},
                                         {{"eval", "sq.view.state.motion"}},
                                         {{"eval", "sq.view.eye.position.x"}},
                                         {{"key", "KeyW"}},
                                         {{"eval", "sq.view.state.motion"}}});
  const json& results = seen["results"];
  ASSERT_EQ(results.size(), 7u) << seen;
  EXPECT_THAT(results[1].get<std::string>(), HasSubstr("sports ball"));
  EXPECT_EQ(results[2], "orbit");
  EXPECT_EQ(results[4], "orbit");
  EXPECT_NE(results[3], results[5]);
  EXPECT_EQ(results[6], "fly");
}

TEST_F(MapViewInBrowserTest, JumpsWhenMotionIsUnwanted) {
  const json seen = InBrowser(
      Export(), {{{"media", {{"prefers-reduced-motion", "reduce"}}}},
                 {{"eval",
                   "sq.moveTo(sq.view, {eye: new THREE.Vector3(9, 8, 7), at: new THREE.Vector3()}), "
                   "sq.view.eye.position.toArray().join()"}}});
  EXPECT_THAT(seen["results"], ElementsAre("9,8,7")) << seen;
}

// The command draws what the page shows.
TEST_F(MapViewInBrowserTest, CopiesCommandOfItsView) {
  const fs::path shot = folder_.Path() / "view.png", drawn = folder_.Path() / "map.png";
  const json seen =
      InBrowser(Export(), {{{"eval",
                             "sq.view.state.layers.labels = false, sq.setTheme(sq.view, 'light'), "
                             "sq.fold(sq.view), sq.commandOf(sq.view)"}},
                           {{"eval",
                             "document.querySelectorAll('.sq > :not(canvas)').forEach(e => "
                             "e.style.display = 'none')"}},
                           {{"shot", shot.string()}}});
  std::string command = seen["results"][0];
  ASSERT_THAT(command, HasSubstr("sqslam render " + folder_.Path().string())) << seen;
  command.replace(command.find("--output=map.png"), 16, "--output=" + drawn.string());
  const auto run = RunProgram(command.substr(7) + " --set text.legend=false --set text.scale=false");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const cv::Mat page = cv::imread(shot.string()), picture = cv::imread(drawn.string());
  ASSERT_EQ(page.size(), picture.size());
  cv::Mat1b shown, made;  // where the book is
  cv::inRange(page, cv::Scalar(0, 20, 90), cv::Scalar(60, 110, 220), shown);
  cv::inRange(picture, cv::Scalar(0, 20, 90), cv::Scalar(60, 110, 220), made);
  EXPECT_GT(cv::countNonZero(shown & made), 0.8 * cv::countNonZero(shown | made));
}

TEST_F(MapViewInBrowserTest, DrawsPointsInTheirColours) {
  MapSnapshot map = HandMadeMap();
  map.objects.clear();
  for (SnapshotPoint& point : map.points) {
    point.rgb = {128, 128, 128};
  }
  RecordingWriter(folder_.Path() / "grey.sqmap", {}).Add(map);
  const std::string page = (folder_.Path() / "grey.html").string();
  ASSERT_EQ(RunProgram("export " + (folder_.Path() / "grey.sqmap").string() + " -o " + page).exit_code, 0);
  const fs::path shot = folder_.Path() / "grey.png";
  InBrowser(page, {{{"eval",
                     "sq.view.points.material.uniforms.size.value = 12, "
                     "sq.view.points.material.uniforms.contrast.value = 0, sq.view.draw()"}},
                   {{"shot", shot.string()}}});
  const cv::Mat picture = cv::imread(shot.string());
  cv::Mat1b grey;
  cv::inRange(picture, cv::Scalar(127, 127, 127), cv::Scalar(129, 129, 129), grey);
  EXPECT_GT(cv::countNonZero(grey), 500);
}

TEST_F(MapViewInBrowserTest, ShowsEarlierStatesBySlider) {
  const json seen = InBrowser(
      Export(),
      {{{"eval", "sq.view.objects.map(o => o.solid.visible ? 1 : 0).join('')"}},
       {{"eval", "sq.setTime(sq.view, 1.5), sq.view.objects.map(o => o.solid.visible ? 1 : 0).join('')"}},
       {{"eval", "sq.view.points.geometry.drawRange.count <= 400"}},
       {{"eval", "sq.setTime(sq.view, 0.5), sq.view.objects.map(o => o.solid.visible ? 1 : 0).join('')"}}});
  EXPECT_THAT(seen["results"], ElementsAre("111", "100", true, "000")) << seen;
}

}  // namespace
}  // namespace sqslam
