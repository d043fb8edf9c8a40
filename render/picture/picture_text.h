#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace sqslam {

inline constexpr int kFractionalBits = 4;  // of OpenCV's drawing coordinates

// "potted_plant" as people write it.
std::string ReadableLabel(std::string label);

// Lays a colour (red, green, blue in [0, 1]) over the image where `coverage` (8UC1) says, its top-left corner
// at `origin`; what falls outside is cut off. The image is 8UC3 or 8UC4 with straight alpha.
void Blend(cv::Mat& image, const cv::Mat& coverage, cv::Point origin, const Eigen::Vector3d& color,
           double opacity = 1.0);

// Shapes with smooth edges. Widths and radii in pixels.
void DrawLine(cv::Mat& image, cv::Point2d from, cv::Point2d to, double width, const Eigen::Vector3d& color,
              double opacity = 1.0);
void DrawPanel(cv::Mat& image, const cv::Rect& area, double radius, const Eigen::Vector3d& color,
               double opacity = 1.0);
void DrawFrame(cv::Mat& image, const cv::Rect& area, double width, const Eigen::Vector3d& color,
               double opacity = 1.0);

// Text in DejaVu Sans. Sizes are the height of the letters' box in pixels.
class TextPainter {
 public:
  enum class Align { kLeft, kCenter, kRight };

  TextPainter();
  ~TextPainter();
  TextPainter(TextPainter&&) noexcept;

  int Width(const std::string& text, double size, bool bold = false) const;

  // `anchor` is on the middle of the line: its left end, centre or right end.
  void Draw(cv::Mat& image, const std::string& text, cv::Point anchor, double size,
            const Eigen::Vector3d& color, Align align = Align::kLeft, bool bold = false) const;

  // The same with a soft edge in another colour, for text over a scene.
  void DrawOver(cv::Mat& image, const std::string& text, cv::Point anchor, double size,
                const Eigen::Vector3d& color, const Eigen::Vector3d& halo, Align align = Align::kLeft) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
