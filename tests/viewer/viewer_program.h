#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/app/run_program.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/baseline.h"

namespace sqslam::viewer {

// Runs the viewer in a folder, on a display of its own unless `display` is false.
inline testing::ProgramRun RunViewer(const TemporaryFolder& folder, const std::string& arguments,
                                     bool display = true) {
  const std::string out = (folder.Path() / "out").string();
  const std::string err = (folder.Path() / "err").string();
  // Its own exit code: that of xvfb-run is another one where its cleaning up fails.
  const std::string inner =
      std::string("'") + SQSLAM_VIEWER + " " + arguments + " >" + out + " 2>" + err + "; echo $? >code'";
  const std::string prefix = display ? "xvfb-run -a -s '-screen 0 1280x1024x24' " : "env -u DISPLAY ";
  const std::string command =
      "cd " + folder.Path().string() + " && " + prefix + "sh -c " + inner + " >/dev/null 2>&1";
  if (std::system(command.c_str()) == -1) {
    return {};
  }
  const std::string code = testing::Slurp(folder.Path() / "code");
  return {code.empty() ? -1 : std::stoi(code), testing::Slurp(out), testing::Slurp(err)};
}

class ViewerScript : public ::testing::Test {
 protected:
  testing::ProgramRun Play(const std::string& script, const std::string& arguments) {
    folder_.Write("script.txt", script);
    return RunViewer(folder_, arguments + " --resolution 960,600 --play-events script.txt");
  }
  // Compares what a copied command draws with the picture that F12 left in the folder.
  void ExpectSamePicture(std::string command) {
    ASSERT_TRUE(command.starts_with("sqslam "));
    const std::string output = (folder_.Path() / "headless.png").string();
    command = command.substr(7, command.find('\n') - 7);
    const std::size_t name = command.find("--output=map.png");
    ASSERT_NE(name, std::string::npos);
    command.replace(name, 16, "--output=" + output);
    const testing::ProgramRun headless = testing::RunProgram(command);
    ASSERT_EQ(headless.exit_code, 0) << headless.err;
    cv::Mat shot;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.Path())) {
      if (entry.path().filename().string().ends_with("-1.png")) {
        shot = cv::imread(entry.path().string());
      }
    }
    const cv::Mat drawn = cv::imread(output);
    ASSERT_EQ(shot.size(), drawn.size());
    EXPECT_LT(PictureDifference(shot, drawn), 0.01);
  }

  TemporaryFolder folder_;
};

}  // namespace sqslam::viewer
