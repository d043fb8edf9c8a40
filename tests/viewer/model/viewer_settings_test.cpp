#include "app/viewer/model/viewer_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::viewer {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Sets variables of the environment for one test.
class ViewerSettingsTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"XDG_CONFIG_HOME", "XDG_STATE_HOME", "HOME"}) {
      const char* value = std::getenv(name);
      before_[name] = value != nullptr ? value : "";
    }
  }
  void TearDown() override {
    for (const auto& [name, value] : before_) {
      Set(name, value);
    }
  }
  static void Set(const std::string& name, const std::string& value) {
    value.empty() ? ::unsetenv(name.c_str()) : ::setenv(name.c_str(), value.c_str(), 1);
  }

  TemporaryFolder folder_;
  std::vector<std::string> warnings_;
  fs::path file_ = folder_.Path() / "sqslam" / "viewer.yaml";

 private:
  std::map<std::string, std::string> before_;
};

TEST_F(ViewerSettingsTest, FollowsXdgFolders) {
  Set("HOME", "/home/ada");
  Set("XDG_CONFIG_HOME", "/etc/ada");
  Set("XDG_STATE_HOME", "");
  EXPECT_EQ(SettingsFile(), "/etc/ada/sqslam/viewer.yaml");
  EXPECT_EQ(MemoryFile(), "/home/ada/.local/state/sqslam/viewer.yaml");
  Set("XDG_CONFIG_HOME", "not/absolute");
  EXPECT_EQ(SettingsFile(), "/home/ada/.config/sqslam/viewer.yaml");
  Set("XDG_CONFIG_HOME", "");
  Set("HOME", "");
  EXPECT_EQ(SettingsFile(), "");
  Save(ViewerSettings());  // nowhere to keep anything: no error
  EXPECT_EQ(Load<ViewerSettings>("", warnings_).theme, Theme::kDark);
}

TEST_F(ViewerSettingsTest, ReadsBackAllValues) {
  ViewerSettings settings;
  settings.kept_in = file_;
  settings.theme = Theme::kLight;
  settings.style = "blueprint";
  settings.font_size = 21.5;
  settings.show_image = false;
  Save(settings);
  const auto loaded = Load<ViewerSettings>(file_, warnings_);
  EXPECT_THAT(warnings_, IsEmpty());
  EXPECT_EQ(loaded.theme, Theme::kLight);
  EXPECT_EQ(loaded.style, "blueprint");
  EXPECT_EQ(loaded.font_size, 21.5);
  EXPECT_FALSE(loaded.show_image);

  ViewerMemory memory;
  memory.kept_in = file_;
  memory.window_width = 1234;
  memory.layout.side = 412.5;
  memory.Remember("/data/a b, [c]/map.sqmap");
  memory.Remember("/data/\u00e4/map.sqmap");
  Save(memory);
  const auto state = Load<ViewerMemory>(file_, warnings_);
  EXPECT_THAT(warnings_, IsEmpty());
  EXPECT_EQ(state.window_width, 1234);
  EXPECT_EQ(state.layout.side, 412.5);
  EXPECT_THAT(state.recent_files, ElementsAre("/data/\u00e4/map.sqmap", "/data/a b, [c]/map.sqmap"));
}

TEST_F(ViewerSettingsTest, IgnoresUnknownKeys) {
  folder_.Write("sqslam/viewer.yaml", "future: {a: 1}\ntheme: light\n");
  const auto loaded = Load<ViewerSettings>(file_, warnings_);
  EXPECT_THAT(warnings_, IsEmpty());
  EXPECT_EQ(loaded.theme, Theme::kLight);
}

TEST_F(ViewerSettingsTest, KeepsOtherValuesWhenOneIsInvalid) {
  folder_.Write("sqslam/viewer.yaml", "theme: pink\n\nfont_size: 300\nstyle: minimal\n");
  const auto loaded = Load<ViewerSettings>(file_, warnings_);
  EXPECT_EQ(loaded.theme, Theme::kDark);
  EXPECT_EQ(loaded.font_size, 15.0);
  EXPECT_EQ(loaded.style, "minimal");
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("viewer.yaml:1: theme is 'pink', expected one of dark, light"),
                                     HasSubstr("viewer.yaml:3: font_size is '300'")));
}

TEST_F(ViewerSettingsTest, WarnsAndUsesDefaultsWhenFileIsBroken) {
  folder_.Write("sqslam/viewer.yaml", "theme: light\nstyle: [\n");
  EXPECT_EQ(Load<ViewerSettings>(file_, warnings_).theme, Theme::kDark);
  folder_.Write("sqslam/viewer.yaml", "just words");
  Load<ViewerMemory>(file_, warnings_);
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("invalid YAML; the defaults are used"),
                                     HasSubstr("expected lines 'name: value'; the defaults are used")));
  folder_.Write("sqslam/viewer.yaml", "");
  Load<ViewerMemory>(file_, warnings_);
  Load<ViewerMemory>(folder_.Path() / "none", warnings_);
  EXPECT_EQ(warnings_.size(), 2U);
}

TEST_F(ViewerSettingsTest, RemembersFewAbsoluteFilesWithoutRepetition) {
  ViewerMemory memory;
  for (int i = 0; i < 20; ++i) {
    memory.Remember("/maps/" + std::to_string(i));
  }
  EXPECT_EQ(memory.recent_files.size(), ViewerMemory::kMaxRecentFiles);
  EXPECT_EQ(memory.recent_files.front(), "/maps/19");
  memory.Remember("/maps/x/../15");
  EXPECT_EQ(memory.recent_files.front(), "/maps/15");
  EXPECT_EQ(memory.recent_files.size(), ViewerMemory::kMaxRecentFiles);
  memory.Remember("here.sqmap");
  EXPECT_TRUE(fs::path(memory.recent_files.front()).is_absolute());
  memory.Remember(folder_.Write("there.sqmap", ""));
  memory.ForgetMissing();
  EXPECT_THAT(memory.recent_files, ElementsAre((folder_.Path() / "there.sqmap").string()));
}

TEST_F(ViewerSettingsTest, ReportsUnwritableFiles) {
  folder_.Write("sqslam", "a file where the folder should be");
  ViewerSettings settings;
  settings.kept_in = file_;
  EXPECT_THROW(Save(settings), InputError);
}

}  // namespace
}  // namespace sqslam::viewer
