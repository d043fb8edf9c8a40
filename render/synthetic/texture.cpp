#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <ranges>
#include <string_view>

#include "render/synthetic/textured_mesh.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// A texture being painted. Lengths are pixels; `unit` is one centimetre.
struct Canvas {
  cv::Mat image;
  cv::RNG random;
  std::vector<cv::Scalar> colors;  // BGR
  std::string title;
  double unit = 1.0;

  int Width() const { return image.cols; }
  int Height() const { return image.rows; }
  double Uniform(double low, double high) { return random.uniform(low, high); }
  cv::Point RandomPoint() { return {random.uniform(0, Width()), random.uniform(0, Height())}; }
  cv::Scalar Color(int i) const { return colors[static_cast<std::size_t>(i) % colors.size()]; }
  cv::Scalar RandomColor() { return Color(random.uniform(0, static_cast<int>(colors.size()))); }
};

// Smooth noise of standard deviation about 1, with octaves from `coarse` pixels per cell down to two. Built
// from coarse to fine, so that only the last step runs at full size.
cv::Mat FractalNoise(cv::Size size, double coarse, double persistence, cv::RNG& random) {
  cv::Mat sum;
  double amplitude = 1.0;
  double power = 0.0;
  for (double cell = std::max(coarse, 2.0); cell >= 1.5; cell *= 0.5) {
    cv::Mat octave(static_cast<int>(size.height / cell) + 2, static_cast<int>(size.width / cell) + 2, CV_32F);
    random.fill(octave, cv::RNG::NORMAL, 0.0, amplitude);
    if (!sum.empty()) {
      cv::resize(sum, sum, octave.size(), 0.0, 0.0, cv::INTER_CUBIC);
      octave += sum;
    }
    sum = octave;
    power += amplitude * amplitude;
    amplitude *= persistence;
  }
  cv::resize(sum, sum, size, 0.0, 0.0, cv::INTER_LINEAR);
  return sum / std::sqrt(power);
}

cv::Mat ThreeChannels(const cv::Mat& single) {
  cv::Mat merged;
  cv::merge(std::vector<cv::Mat>(3, single), merged);
  return merged;
}

// Adds noise to all channels alike: image * (1 + strength * noise).
void Modulate(Canvas& canvas, const cv::Mat& noise, double strength) {
  const cv::Mat gain = ThreeChannels(1.0 + strength * noise);
  cv::Mat pixels;
  canvas.image.convertTo(pixels, CV_32FC3);
  cv::multiply(pixels, gain, pixels);
  pixels.convertTo(canvas.image, CV_8UC3);
}

void Grain(Canvas& canvas, double strength) {
  Modulate(canvas, FractalNoise(canvas.image.size(), 3.0 * canvas.unit, 0.75, canvas.random), strength);
}

// Blends towards `color` where noise exceeds a level: stains, clouds, veins.
void Clouds(Canvas& canvas, const cv::Scalar& color, double coarse, double sharpness) {
  const cv::Mat noise = FractalNoise(canvas.image.size(), coarse, 0.6, canvas.random);
  cv::Mat weight = 0.5 + sharpness * noise;
  cv::min(cv::max(weight, 0.0), 1.0, weight);
  cv::Mat pixels;
  canvas.image.convertTo(pixels, CV_32FC3);
  const cv::Mat paint(canvas.image.size(), CV_32FC3, color);
  cv::Mat mixed = pixels + ThreeChannels(weight).mul(paint - pixels);
  mixed.convertTo(canvas.image, CV_8UC3);
}

std::string RandomWord(cv::RNG& random) {
  static constexpr std::string_view kLetters = "aeioubcdfghklmnprstvwxyz0123456789";
  std::string word(static_cast<std::size_t>(random.uniform(2, 9)), ' ');
  for (char& c : word) {
    c = kLetters[static_cast<std::size_t>(random.uniform(0, static_cast<int>(kLetters.size())))];
  }
  return word;
}

void Text(Canvas& canvas, const std::string& text, cv::Point corner, double height, const cv::Scalar& color,
          int thickness) {
  cv::putText(canvas.image, text, corner, cv::FONT_HERSHEY_SIMPLEX, height / 22.0, color, thickness,
              cv::LINE_AA);
}

// Fills a rectangle with lines of words, letters `height` pixels high.
void Paragraph(Canvas& canvas, const cv::Rect& box, double height, const cv::Scalar& color) {
  const int thickness = std::max(1, static_cast<int>(height / 9.0));
  for (double y = box.y + height; y < box.br().y; y += 1.9 * height) {
    double x = box.x;
    const double right = box.br().x - canvas.Uniform(0.0, 0.3) * box.width;
    while (x < right) {
      const std::string word = RandomWord(canvas.random);
      Text(canvas, word, {static_cast<int>(x), static_cast<int>(y)}, height, color, thickness);
      x += 0.85 * height * (static_cast<double>(word.size()) + 0.8);
    }
  }
}

// Draws small filled shapes of many sizes at random places, `density` per square centimetre.
void Motifs(Canvas& canvas, double density, double smallest, double largest) {
  const double area = canvas.Width() * canvas.Height() / (canvas.unit * canvas.unit);
  const int count = static_cast<int>(density * area) + 3;
  for (int i = 0; i < count; ++i) {
    const cv::Point at = canvas.RandomPoint();
    const double size = smallest * std::pow(largest / smallest, std::pow(canvas.Uniform(0.0, 1.0), 2.0));
    const double angle = canvas.Uniform(0.0, 360.0);
    const cv::Scalar color = canvas.RandomColor();
    switch (canvas.random.uniform(0, 4)) {
      case 0:
        cv::circle(canvas.image, at, static_cast<int>(size) + 1, color, cv::FILLED, cv::LINE_AA);
        break;
      case 1:
        cv::ellipse(canvas.image, at, cv::Size2d(size + 1.0, 0.4 * size + 1.0), angle, 0, 360, color,
                    cv::FILLED, cv::LINE_AA);
        break;
      case 2: {
        const cv::RotatedRect box(
            at, cv::Size2f(static_cast<float>(2.0 * size + 1.0), static_cast<float>(size + 1.0)),
            static_cast<float>(angle));
        std::vector<cv::Point2f> corners(4);
        box.points(corners.data());
        const std::vector<cv::Point> polygon(corners.begin(), corners.end());
        cv::fillConvexPoly(canvas.image, polygon, color, cv::LINE_AA);
        break;
      }
      default: {
        std::vector<cv::Point> polygon;
        for (int k = 0; k < 5; ++k) {
          const double phi = angle + 72.0 * k + canvas.Uniform(-25.0, 25.0);
          polygon.emplace_back(at.x + static_cast<int>(size * std::cos(phi / 57.3)),
                               at.y + static_cast<int>(size * std::sin(phi / 57.3)));
        }
        cv::fillConvexPoly(canvas.image, polygon, color, cv::LINE_AA);
      }
    }
  }
}

void Barcode(Canvas& canvas, const cv::Rect& box) {
  cv::rectangle(canvas.image, box, {245, 245, 245}, cv::FILLED);
  for (int x = box.x + 3; x < box.br().x - 3;) {
    const int width = canvas.random.uniform(1, 5);
    cv::rectangle(canvas.image, {x, box.y + 3, width, box.height - 6}, {20, 20, 20}, cv::FILLED);
    x += width + canvas.random.uniform(2, 5);
  }
}

// Paints the print of a cardboard box or a tin: panels about 12 cm wide around the body, each different.
void PaintPackage(Canvas& canvas) {
  Clouds(canvas, canvas.Color(1), 6.0 * canvas.unit, 0.35);
  const double panel = std::min(12.0 * canvas.unit, static_cast<double>(canvas.Width()));
  const int panels = std::max(1, static_cast<int>(std::lround(canvas.Width() / panel)));
  const int w = canvas.Width() / panels;
  const int h = canvas.Height();
  for (int i = 0; i < panels; ++i) {
    const int x = i * w;
    const cv::Rect stripe(x, static_cast<int>(h * canvas.Uniform(0.08, 0.3)), w,
                          static_cast<int>(h * canvas.Uniform(0.15, 0.3)));
    cv::rectangle(canvas.image, stripe, canvas.Color(2 + i), cv::FILLED);
    const cv::Point center(x + static_cast<int>(w * canvas.Uniform(0.3, 0.7)),
                           static_cast<int>(h * canvas.Uniform(0.5, 0.75)));
    const double radius = std::min(w, h) * canvas.Uniform(0.14, 0.24);
    cv::circle(canvas.image, center, static_cast<int>(radius), canvas.Color(3 + i), cv::FILLED, cv::LINE_AA);
    cv::circle(canvas.image, center, static_cast<int>(0.7 * radius), canvas.Color(1 + i), 3, cv::LINE_AA);
    Text(canvas, canvas.title, {x + static_cast<int>(0.04 * w), stripe.br().y - stripe.height / 4},
         std::min(0.55 * stripe.height, 1.6 * w / (static_cast<double>(canvas.title.size()) + 1.0)),
         canvas.Color(4), 4);
    const int text_width = static_cast<int>(0.45 * w);
    Paragraph(canvas, {x + static_cast<int>(0.05 * w), static_cast<int>(0.8 * h), text_width, h / 6},
              0.28 * canvas.unit, canvas.Color(4 + i));
    Paragraph(canvas, {x + static_cast<int>(0.5 * w), static_cast<int>(0.42 * h), text_width, h / 5},
              0.4 * canvas.unit, canvas.Color(5 + i));
    if (w > 6.0 * canvas.unit && h > 5.0 * canvas.unit) {
      Barcode(canvas, {x + static_cast<int>(0.62 * w), static_cast<int>(0.82 * h), static_cast<int>(0.3 * w),
                       static_cast<int>(0.13 * h)});
    }
  }
  Motifs(canvas, 0.1, 0.08 * canvas.unit, 0.4 * canvas.unit);
  Grain(canvas, 0.06);
}

void PaintBook(Canvas& canvas) {
  Clouds(canvas, canvas.Color(1), 5.0 * canvas.unit, 0.5);
  const int w = canvas.Width();
  const int h = canvas.Height();
  Motifs(canvas, 0.12, 0.1 * canvas.unit, 1.6 * canvas.unit);
  cv::rectangle(canvas.image, cv::Rect(w / 10, h / 8, w * 6 / 10, h / 4), canvas.Color(0), cv::FILLED);
  Text(canvas, canvas.title, {w / 9, h / 8 + h / 6},
       std::min(0.12 * h, 0.9 * w / (static_cast<double>(canvas.title.size()) + 1.0)), canvas.Color(2), 4);
  Paragraph(canvas, {w / 9, h * 6 / 10, w * 5 / 10, h / 5}, 0.45 * canvas.unit, canvas.Color(2));
  Grain(canvas, 0.07);
}

void PaintCeramic(Canvas& canvas) {
  Clouds(canvas, canvas.Color(1), 4.0 * canvas.unit, 0.3);
  for (const double level : {0.12, 0.86}) {
    const int y = static_cast<int>(level * canvas.Height());
    cv::rectangle(canvas.image, cv::Rect(0, y, canvas.Width(), canvas.Height() / 20 + 1), canvas.Color(2),
                  cv::FILLED);
  }
  Motifs(canvas, 0.5, 0.1 * canvas.unit, 1.2 * canvas.unit);
  Grain(canvas, 0.06);
}

void PaintMarble(Canvas& canvas) {
  for (int i = 1; i < static_cast<int>(canvas.colors.size()); ++i) {
    Clouds(canvas, canvas.Color(i), (6.0 / i) * canvas.unit, 0.9);
  }
  Motifs(canvas, 0.25, 0.07 * canvas.unit, 0.5 * canvas.unit);
  Grain(canvas, 0.09);
}

void PaintWood(Canvas& canvas) {
  // Noise stretched along x, and boards of different tone.
  cv::Mat squeezed =
      FractalNoise({canvas.Width() / 14 + 2, canvas.Height()}, 3.0 * canvas.unit, 0.85, canvas.random);
  cv::resize(squeezed, squeezed, canvas.image.size(), 0.0, 0.0, cv::INTER_CUBIC);
  Modulate(canvas, squeezed, 0.13);
  const int board = std::max(8, static_cast<int>(14.0 * canvas.unit));
  for (int y = 0; y < canvas.Height(); y += board) {
    cv::Mat rows = canvas.image.rowRange(y, std::min(y + board, canvas.Height()));
    rows.convertTo(rows, -1, canvas.Uniform(0.88, 1.1));
    cv::line(canvas.image, {0, y}, {canvas.Width(), y}, canvas.Color(1), 2, cv::LINE_AA);
  }
  const int knots = static_cast<int>(canvas.Width() * canvas.Height() / (90.0 * canvas.unit * canvas.unit));
  for (int i = 0; i < knots; ++i) {
    const cv::Point at = canvas.RandomPoint();
    const double size = canvas.Uniform(0.15, 0.7) * canvas.unit;
    cv::ellipse(canvas.image, at, cv::Size2d(2.2 * size, size), 0, 0, 360, canvas.Color(1), cv::FILLED,
                cv::LINE_AA);
    cv::ellipse(canvas.image, at, cv::Size2d(3.4 * size, 1.7 * size), canvas.Uniform(-8, 8), 0, 360,
                canvas.Color(1), 2, cv::LINE_AA);
  }
  const int scratches =
      static_cast<int>(canvas.Width() * canvas.Height() / (40.0 * canvas.unit * canvas.unit));
  for (int i = 0; i < scratches; ++i) {
    const cv::Point at = canvas.RandomPoint();
    const double phi = canvas.Uniform(0.0, 6.28);
    const double length = canvas.Uniform(0.3, 3.0) * canvas.unit;
    cv::line(
        canvas.image, at,
        at + cv::Point(static_cast<int>(length * std::cos(phi)), static_cast<int>(length * std::sin(phi))),
        canvas.RandomColor(), 1, cv::LINE_AA);
  }
  Grain(canvas, 0.07);
}

void PaintPlaster(Canvas& canvas) {
  Clouds(canvas, canvas.Color(1), 30.0 * canvas.unit, 0.35);
  Motifs(canvas, 0.012, 0.3 * canvas.unit, 2.0 * canvas.unit);
  Modulate(canvas, FractalNoise(canvas.image.size(), 2.0 * canvas.unit, 0.9, canvas.random), 0.05);
}

void PaintTerrazzo(Canvas& canvas) {
  Motifs(canvas, 0.09, 0.5 * canvas.unit, 4.0 * canvas.unit);
  Grain(canvas, 0.07);
}

void PaintPoster(Canvas& canvas) {
  for (int i = 1; i < static_cast<int>(canvas.colors.size()); ++i) {
    Clouds(canvas, canvas.Color(i), (20.0 / i) * canvas.unit, 0.8);
  }
  Motifs(canvas, 0.008, 0.6 * canvas.unit, 9.0 * canvas.unit);
  const int w = canvas.Width();
  const int h = canvas.Height();
  Text(canvas, canvas.title, {w / 14, h / 5}, std::min(h / 8.0, 1.0 * w / (1.0 + canvas.title.size())),
       canvas.Color(0), 6);
  Paragraph(canvas, {w / 14, h * 3 / 4, w * 8 / 10, h / 6}, 1.2 * canvas.unit, canvas.Color(0));
  cv::rectangle(canvas.image, cv::Rect(0, 0, w, h), {235, 238, 240}, static_cast<int>(2.5 * canvas.unit));
  Grain(canvas, 0.05);
}

void PaintPage(Canvas& canvas) {
  const int w = canvas.Width();
  const int h = canvas.Height();
  Text(canvas, canvas.title, {w / 10, h / 8}, 0.9 * canvas.unit, canvas.Color(1), 2);
  Paragraph(canvas, {w / 10, h / 6, w * 8 / 10, h / 3}, 0.42 * canvas.unit, canvas.Color(1));
  cv::rectangle(canvas.image, cv::Rect(w / 10, h * 11 / 20, w * 4 / 10, h / 5), canvas.Color(2), cv::FILLED);
  std::vector<cv::Point> curve;
  for (int i = 0; i <= 12; ++i) {
    curve.emplace_back(w / 10 + w * 4 * i / 120,
                       h * 11 / 20 + static_cast<int>(h * canvas.Uniform(0.02, 0.18)));
  }
  cv::polylines(canvas.image, curve, false, canvas.Color(3), 2, cv::LINE_AA);
  Paragraph(canvas, {w * 11 / 20, h * 11 / 20, w * 35 / 100, h / 5}, 0.38 * canvas.unit, canvas.Color(1));
  Paragraph(canvas, {w / 10, h * 8 / 10, w * 8 / 10, h / 8}, 0.42 * canvas.unit, canvas.Color(1));
  Grain(canvas, 0.03);
}

const std::map<std::string, void (*)(Canvas&)> kPainters = {
    {"package", PaintPackage},   {"book", PaintBook},     {"ceramic", PaintCeramic},
    {"marble", PaintMarble},     {"wood", PaintWood},     {"plaster", PaintPlaster},
    {"terrazzo", PaintTerrazzo}, {"poster", PaintPoster}, {"page", PaintPage}};

}  // namespace

cv::Mat PaintTexture(const TextureDescription& texture, double width, double height, double pixels_per_metre,
                     int variation) {
  const auto painter = kPainters.find(texture.pattern);
  ThrowIf<InputError>(painter == kPainters.end(), "texture pattern '{}': expected one of {}", texture.pattern,
                      fmt::join(std::views::keys(kPainters), ", "));
  Canvas canvas;
  canvas.random =
      cv::RNG(0x9E3779B97F4A7C15ULL * (texture.seed * 8 + static_cast<std::uint64_t>(variation) + 1));
  for (const auto& [r, g, b] : texture.colors) {
    canvas.colors.emplace_back(b, g, r);
  }
  canvas.title = texture.title;
  canvas.unit = 0.01 * pixels_per_metre;
  const cv::Size size(std::max(16, static_cast<int>(std::lround(width * pixels_per_metre))),
                      std::max(16, static_cast<int>(std::lround(height * pixels_per_metre))));
  canvas.image = cv::Mat(size, CV_8UC3, canvas.Color(0));
  painter->second(canvas);
  return canvas.image;
}

}  // namespace sqslam
