// Maps a sequence with boxes of a detector of one's own: own_detector INPUT RESULT

#include <iostream>
#include <opencv2/imgproc.hpp>

#include "slam/run/run_pipeline.h"

// Finds things in strong colours.
class ColorDetector : public sqslam::ObjectDetector {
 public:
  std::vector<sqslam::Detection> Detect(const cv::Mat& bgr) override {
    cv::Mat hsv;
    cv::cvtColor(bgr, hsv, cv::COLOR_BGR2HSV);
    cv::Mat strong;
    cv::inRange(hsv, cv::Scalar(0, 150, 60), cv::Scalar(180, 255, 255), strong);
    cv::Mat labels, stats, centers;
    const int count = cv::connectedComponentsWithStats(strong, labels, stats, centers);
    std::vector<sqslam::Detection> detections;
    for (int i = 1; i < count; ++i) {  // 0 is the background
      if (stats.at<int>(i, cv::CC_STAT_AREA) > 400) {
        const auto side = [&](int column) { return static_cast<double>(stats.at<int>(i, column)); };
        detections.push_back({"thing",
                              0.9,
                              {side(cv::CC_STAT_LEFT), side(cv::CC_STAT_TOP), side(cv::CC_STAT_WIDTH),
                               side(cv::CC_STAT_HEIGHT)}});
      }
    }
    return detections;
  }
  std::string Name() const override { return "strong colours"; }
};

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: own_detector INPUT RESULT\n";
    return 2;
  }
  sqslam::RunRequest request;
  request.sequence.path = argv[1];
  request.output = argv[2];
  request.options.deterministic = true;
  request.detector = std::make_shared<ColorDetector>();  // instead of boxes.txt and of networks
  try {
    sqslam::RunHost host;
    const sqslam::FinishedRun run = sqslam::RunPipeline(request, host);
    std::cout << "boxes by " << run.stats.detector << ": " << run.stats.objects << " objects\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
