#pragma once

#include <Eigen/Core>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>

namespace sqslam {

inline constexpr int kFractionalBits = 4;  // in OpenCV's drawing coordinates

cv::Scalar ToBgr(const Eigen::Vector3d& color);  // of OpenCV, 0 to 255

// Returns all pixels from `low` to `high`, with a margin.
cv::Rect PixelsAround(cv::Point2d low, cv::Point2d high, double margin);

// Blends a colour (RGB in [0, 1]) into the image, weighted by `coverage` (8UC1), whose top-left corner is at
// `origin`; parts outside are cut off. The image is 8UC3, or 8UC4 with straight alpha.
void Blend(cv::Mat& image, const cv::Mat& coverage, cv::Point origin, const Eigen::Vector3d& color,
           double opacity = 1.0);

// Draw shapes with smooth edges. Widths and radii in pixels.
void DrawLine(cv::Mat& image, cv::Point2d from, cv::Point2d to, double width, const Eigen::Vector3d& color,
              double opacity = 1.0);
void DrawPanel(cv::Mat& image, const cv::Rect& area, double radius, const Eigen::Vector3d& color,
               double opacity = 1.0);
void DrawFrame(cv::Mat& image, const cv::Rect& area, double width, const Eigen::Vector3d& color,
               double opacity = 1.0);

// Draws text in DejaVu Sans. Sizes are font sizes in pixels. Not thread-safe.
class TextPainter {
 public:
  enum class Align { kLeft, kCenter, kRight };

  int Width(const std::string& text, double size) const { return Coverage(text, size).cols; }

  // `anchor`: left end, centre or right end of the text, at the middle of its height. `halo`: a soft edge in
  // another colour, for text over a scene.
  void Draw(cv::Mat& image, const std::string& text, cv::Point anchor, double size,
            const Eigen::Vector3d& color, Align align = Align::kLeft,
            const std::optional<Eigen::Vector3d>& halo = std::nullopt) const;

 private:
  const cv::Mat& Coverage(const std::string& text, double size) const;

  mutable std::map<std::pair<std::string, int>, cv::Mat> lines_;  // cache, by text and font size
};

}  // namespace sqslam
