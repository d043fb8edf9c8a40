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
  fs::path file_ = folder_.Path() / "sqslam" / "viewer.yaml";

 private:
  std::map<std::string, std::string> before_;
};

TEST_F(ViewerSettingsTest, FilesLieWhereTheDesktopSays) {
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
  Save("", ViewerSettings());  // nowhere to keep anything: no error
  EXPECT_EQ(Load<ViewerSettings>("").values.theme, Theme::kDark);
}

TEST_F(ViewerSettingsTest, EverythingComesBack) {
  ViewerSettings settings;
  settings.theme = Theme::kLight;
  settings.style = "blueprint";
  settings.font_size = 21.5;
  settings.show_image = false;
  Save(file_, settings);
  const auto loaded = Load<ViewerSettings>(file_);
  EXPECT_TRUE(loaded.warnings.empty());
  EXPECT_EQ(loaded.values.theme, Theme::kLight);
  EXPECT_EQ(loaded.values.style, "blueprint");
  EXPECT_EQ(loaded.values.font_size, 21.5);
  EXPECT_FALSE(loaded.values.show_image);

  ViewerMemory memory;
  memory.window_width = 1234;
  memory.layout.side = 412.5;
  memory.Remember("/data/a b, [c]/map.sqmap");
  memory.Remember("/data/\u00e4/map.sqmap");
  Save(file_, memory);
  const auto state = Load<ViewerMemory>(file_);
  EXPECT_TRUE(state.warnings.empty()) << state.warnings.front();
  EXPECT_EQ(state.values.window_width, 1234);
  EXPECT_EQ(state.values.layout.side, 412.5);
  EXPECT_THAT(state.values.recent_files, ElementsAre("/data/\u00e4/map.sqmap", "/data/a b, [c]/map.sqmap"));
}

TEST_F(ViewerSettingsTest, KeysOfOtherVersionsArePassedOver) {
  folder_.Write("sqslam/viewer.yaml", "future: {a: 1}\ntheme: light\n");
  const auto loaded = Load<ViewerSettings>(file_);
  EXPECT_TRUE(loaded.warnings.empty());
  EXPECT_EQ(loaded.values.theme, Theme::kLight);
}

TEST_F(ViewerSettingsTest, OneWrongValueCostsNoOther) {
  folder_.Write("sqslam/viewer.yaml", "theme: pink\n\nfont_size: 300\nstyle: minimal\n");
  const auto loaded = Load<ViewerSettings>(file_);
  EXPECT_EQ(loaded.values.theme, Theme::kDark);
  EXPECT_EQ(loaded.values.font_size, 15.0);
  EXPECT_EQ(loaded.values.style, "minimal");
  EXPECT_THAT(loaded.warnings,
              ElementsAre(HasSubstr("viewer.yaml:1: theme is 'pink', expected one of dark, light"),
                          HasSubstr("viewer.yaml:3: font_size is '300'")));
}

TEST_F(ViewerSettingsTest, ABrokenFileGivesTheDefaultsAndAWarning) {
  folder_.Write("sqslam/viewer.yaml", "theme: light\nstyle: [\n");
  EXPECT_EQ(Load<ViewerSettings>(file_).values.theme, Theme::kDark);
  EXPECT_THAT(Load<ViewerSettings>(file_).warnings,
              ElementsAre(HasSubstr("no valid YAML; the defaults are used")));
  folder_.Write("sqslam/viewer.yaml", "just words");
  EXPECT_THAT(Load<ViewerMemory>(file_).warnings, ElementsAre(HasSubstr("expected lines 'name: value'")));
  folder_.Write("sqslam/viewer.yaml", "");
  EXPECT_TRUE(Load<ViewerMemory>(file_).warnings.empty());
  EXPECT_TRUE(Load<ViewerMemory>(folder_.Path() / "none").warnings.empty());
}

TEST_F(ViewerSettingsTest, RecentFilesAreAbsoluteOnceAndFew) {
  ViewerMemory memory;
  for (int i = 0; i < 20; ++i) {
    memory.Remember("/maps/" + std::to_string(i));
  }
  EXPECT_EQ(memory.recent_files.size(), ViewerMemory::kMostRecent);
  EXPECT_EQ(memory.recent_files.front(), "/maps/19");
  memory.Remember("/maps/x/../15");
  EXPECT_EQ(memory.recent_files.front(), "/maps/15");
  EXPECT_EQ(memory.recent_files.size(), ViewerMemory::kMostRecent);
  memory.Remember("here.sqmap");
  EXPECT_TRUE(fs::path(memory.recent_files.front()).is_absolute());
  memory.Remember(folder_.Write("there.sqmap", ""));
  memory.ForgetMissing();
  EXPECT_THAT(memory.recent_files, ElementsAre((folder_.Path() / "there.sqmap").string()));
}

TEST_F(ViewerSettingsTest, WhatCannotBeWrittenIsToldAbout) {
  folder_.Write("sqslam", "a file where the folder should be");
  EXPECT_THROW(Save(file_, ViewerSettings()), InputError);
}

}  // namespace
}  // namespace sqslam::viewer
