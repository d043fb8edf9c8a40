#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace sqslam {

// Why a landmark is no object of the map: the first test that it failed, in this order.
enum class LeftOut {
  kMoving,              // no solid at rest explains its boxes
  kFewViews,            // it has too few boxes
  kNoDepth,             // neither map points nor its boxes determine its distance
  kContradictingBoxes,  // its solid agrees too little with its boxes
  kUnreliable,          // its estimate is too doubtful
  kNoQuadric,           // its boxes determine no quadric (representation "quadric")
};
constexpr auto EnumNames(LeftOut) {
  return std::array{"moving", "few_views", "no_depth", "contradicting_boxes", "unreliable", "no_quadric"};
}
inline constexpr std::size_t kLeftOutReasons = EnumNames(LeftOut()).size();

// Fate of the boxes of one class. A landmark counts under the label that it had last.
struct ClassAccount {
  int boxes = 0;                                // of all frames
  int ignored = 0;                              // of them: dropped for their class, score or size
  int used = 0;                                 // of them: those that belong to a landmark
  int merged = 0;                               // landmarks that were duplicates
  int shown = 0;                                // landmarks that are objects of the map
  std::array<int, kLeftOutReasons> left_out{};  // the other landmarks, by LeftOut

  int& operator[](LeftOut reason) { return left_out[static_cast<std::size_t>(reason)]; }
  int operator[](LeftOut reason) const { return left_out[static_cast<std::size_t>(reason)]; }
  int Landmarks() const;  // that were begun
  bool operator==(const ClassAccount&) const = default;
};

using ObjectAccount = std::map<std::string, ClassAccount>;  // by class

void Add(const ObjectAccount& other, ObjectAccount& account);
int CountLeftOut(const ObjectAccount& account, LeftOut reason);

// Returns the reason as said of landmarks ("2 moving"), and what helps against it.
const char* TextOf(LeftOut reason);
const char* RemedyFor(LeftOut reason);

// "2 moving, 1 seen in too few views"; empty if no landmark of the class was left out.
std::string LeftOutText(const ClassAccount& account);

// Returns what the map lacks and why, one line a thing: moving things, then the classes without any object,
// those with most boxes first, at most five; none of fewer than ten boxes, which detectors see anywhere.
std::vector<std::string> MissingObjectLines(const ObjectAccount& account);

}  // namespace sqslam
