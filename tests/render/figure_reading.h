#pragma once

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "render/page/page.h"

namespace sqslam {

// Returns the pixels of a figure.
inline cv::Mat Pixels(const FigurePage& page) {
  const std::string png = EncodeFigure(page, "figure.png");
  return cv::imdecode(cv::Mat(1, static_cast<int>(png.size()), CV_8UC1, const_cast<char*>(png.data())),
                      cv::IMREAD_UNCHANGED);
}

inline void CollectTexts(const boost::property_tree::ptree& node, std::vector<std::string>& texts) {
  for (const auto& [name, child] : node) {
    if (name == "text" && !child.get_optional<std::string>("<xmlattr>.aria-hidden")) {
      texts.push_back(child.data());
    }
    CollectTexts(child, texts);
  }
}

// Returns the texts of an SVG; throws if it is not valid XML.
inline std::vector<std::string> SvgTexts(const std::string& svg) {
  std::istringstream stream(svg);
  boost::property_tree::ptree tree;
  boost::property_tree::read_xml(stream, tree);
  std::vector<std::string> texts;
  CollectTexts(tree, texts);
  return texts;
}

}  // namespace sqslam
