#include "render/video/palette.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sqslam {
namespace {

constexpr int kBits = 5;  // of a channel, by which colours are told apart
constexpr std::size_t kMaxColors = 256;

struct ColorCount {
  std::array<int, 3> bgr{};  // kBits each
  std::int64_t pixels = 0;
  std::array<std::int64_t, 3> sum{};  // of the pixels' full values
};

std::size_t CellOf(const cv::Vec3b& pixel) {
  constexpr int kShift = 8 - kBits;
  return (static_cast<std::size_t>(pixel[0] >> kShift) << (2 * kBits)) |
         (static_cast<std::size_t>(pixel[1] >> kShift) << kBits) |
         static_cast<std::size_t>(pixel[2] >> kShift);
}

// A range of colours that get one colour of the palette.
struct ColorBox {
  std::size_t first = 0, end = 0;
  int axis = 0;             // the longest
  std::int64_t weight = 0;  // its length times the pixels; the heaviest box is cut next
};

ColorBox MakeBox(const std::vector<ColorCount>& colors, std::size_t first, std::size_t end) {
  ColorBox box{first, end};
  std::array<int, 3> low = colors[first].bgr, high = low;
  std::int64_t pixels = 0;
  for (std::size_t i = first; i < end; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      low[c] = std::min(low[c], colors[i].bgr[c]);
      high[c] = std::max(high[c], colors[i].bgr[c]);
    }
    pixels += colors[i].pixels;
  }
  for (int c = 1; c < 3; ++c) {
    const auto at = static_cast<std::size_t>(c), best = static_cast<std::size_t>(box.axis);
    box.axis = high[at] - low[at] > high[best] - low[best] ? c : box.axis;
  }
  const auto axis = static_cast<std::size_t>(box.axis);
  box.weight = (high[axis] - low[axis]) * pixels;
  return box;
}

// Cuts a box at its median pixel.
std::size_t MedianOf(const ColorBox& box, std::vector<ColorCount>& colors) {
  const auto axis = static_cast<std::size_t>(box.axis);
  const auto begin = colors.begin();
  std::stable_sort(begin + static_cast<std::ptrdiff_t>(box.first),
                   begin + static_cast<std::ptrdiff_t>(box.end),
                   [axis](const ColorCount& a, const ColorCount& b) { return a.bgr[axis] < b.bgr[axis]; });
  std::int64_t pixels = 0, half = 0;
  for (std::size_t i = box.first; i < box.end; ++i) {
    pixels += colors[i].pixels;
  }
  std::size_t cut = box.first;
  while (cut + 1 < box.end && 2 * (half + colors[cut].pixels) <= pixels) {
    half += colors[cut++].pixels;
  }
  return std::max(cut, box.first + 1);
}

std::vector<ColorCount> CountColors(const cv::Mat& bgr) {
  constexpr int kShift = 8 - kBits;
  std::vector<ColorCount> cells(std::size_t{1} << (3 * kBits));
  for (auto pixel = bgr.begin<cv::Vec3b>(); pixel != bgr.end<cv::Vec3b>(); ++pixel) {
    ColorCount& cell = cells[CellOf(*pixel)];
    ++cell.pixels;
    for (std::size_t c = 0; c < 3; ++c) {
      cell.sum[c] += (*pixel)[static_cast<int>(c)];
      cell.bgr[c] = (*pixel)[static_cast<int>(c)] >> kShift;
    }
  }
  std::erase_if(cells, [](const ColorCount& cell) { return cell.pixels == 0; });
  return cells;
}

}  // namespace

PaletteImage ReduceColors(const cv::Mat& bgr) {
  PaletteImage image{cv::Mat1b(bgr.size()), {}};
  image.argb.fill(0xff000000U);
  std::vector<ColorCount> colors = CountColors(bgr);
  std::vector<ColorBox> boxes;
  if (!colors.empty()) {
    boxes.push_back(MakeBox(colors, 0, colors.size()));
  }
  while (!boxes.empty() && boxes.size() < kMaxColors) {
    const auto heaviest = std::ranges::max_element(boxes, {}, &ColorBox::weight);
    if (heaviest->weight == 0) {
      break;
    }
    const ColorBox box = *heaviest;
    const std::size_t cut = MedianOf(box, colors);
    *heaviest = MakeBox(colors, box.first, cut);
    boxes.push_back(MakeBox(colors, cut, box.end));
  }
  std::vector<std::uint8_t> number(std::size_t{1} << (3 * kBits));
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    std::int64_t pixels = 0;
    std::array<std::int64_t, 3> sum{};
    for (std::size_t i = boxes[b].first; i < boxes[b].end; ++i) {
      const auto& [blue, green, red] = colors[i].bgr;
      number[static_cast<std::size_t>((blue << (2 * kBits)) | (green << kBits) | red)] =
          static_cast<std::uint8_t>(b);
      pixels += colors[i].pixels;
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += colors[i].sum[c];
      }
    }
    const auto mean = [&](std::size_t c) {
      return static_cast<std::uint32_t>((sum[c] + pixels / 2) / pixels);
    };
    image.argb[b] = 0xff000000U | (mean(2) << 16U) | (mean(1) << 8U) | mean(0);
  }
  for (int y = 0; y < bgr.rows; ++y) {
    const auto* row = bgr.ptr<cv::Vec3b>(y);
    std::transform(row, row + bgr.cols, image.index.ptr(y),
                   [&](const cv::Vec3b& pixel) { return number[CellOf(pixel)]; });
  }
  return image;
}

}  // namespace sqslam
