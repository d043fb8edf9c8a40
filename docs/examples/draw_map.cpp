// Draws a map into an image, without a display: draw_map RESULT IMAGE

#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "render/picture/picture.h"
#include "slam/snapshot/recording.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: draw_map RESULT IMAGE\n";
    return 2;
  }
  try {
    const sqslam::RecordingReader recording(std::filesystem::path(argv[1]) / "map.sqmap");
    sqslam::PictureOptions options;
    options.width = 640;
    options.height = 480;
    options.style = sqslam::LoadStyle("blueprint");
    options.camera.view = "isometric";
    const cv::Mat picture = sqslam::RenderPicture(*recording.Last(), options);  // 8UC3, BGR
    cv::imwrite(argv[2], picture);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
