#include "slam/snapshot/object_account.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

namespace sqslam {
namespace {

std::string Counted(int count, const char* singular, const char* plural) {
  return fmt::format("{} {}", count, count == 1 ? singular : plural);
}

std::string MissingText(const std::string& label, const ClassAccount& account) {
  std::string text = fmt::format("no {} in the map: {}", label, Counted(account.boxes, "box", "boxes"));
  if (account.ignored > 0) {
    text += fmt::format(", {} ignored for class, score or size", account.ignored);
  }
  if (account.ignored == account.boxes) {
    return text;
  }
  const int landmarks = account.Landmarks();
  if (landmarks == 0) {
    return text + ", which began no landmark: frames without a pose, or too few map points in the boxes";
  }
  text += fmt::format(", {}", Counted(landmarks, "landmark", "landmarks"));
  if (account.merged > 0) {
    text += fmt::format(", {} merged into others", account.merged);
  }
  const std::string left_out = LeftOutText(account);
  text += (left_out.empty() ? "" : ", ") + left_out;
  ClassAccount at_rest = account;
  at_rest[LeftOut::kMoving] = 0;
  const auto most = std::ranges::max_element(at_rest.left_out);
  if (*most > 0) {
    text += fmt::format(": {}", RemedyFor(static_cast<LeftOut>(most - at_rest.left_out.begin())));
  }
  return text;
}

}  // namespace

int ClassAccount::Landmarks() const {
  return std::accumulate(left_out.begin(), left_out.end(), shown + merged);
}

void Add(const ObjectAccount& other, ObjectAccount& account) {
  for (const auto& [label, theirs] : other) {
    ClassAccount& ours = account[label];
    ours.boxes += theirs.boxes;
    ours.ignored += theirs.ignored;
    ours.used += theirs.used;
    ours.merged += theirs.merged;
    ours.shown += theirs.shown;
    std::ranges::transform(ours.left_out, theirs.left_out, ours.left_out.begin(), std::plus());
  }
}

int CountLeftOut(const ObjectAccount& account, LeftOut reason) {
  int count = 0;
  for (const auto& [label, of_class] : account) {
    count += of_class[reason];
  }
  return count;
}

const char* TextOf(LeftOut reason) {
  switch (reason) {
    case LeftOut::kMoving:
      return "moving";
    case LeftOut::kFewViews:
      return "seen in too few views";
    case LeftOut::kNoDepth:
      return "without a depth";
    case LeftOut::kContradictingBoxes:
      return "with contradicting boxes";
    case LeftOut::kUnreliable:
      return "too unreliable";
    case LeftOut::kNoQuadric:
      return "without a quadric";
  }
  return "";
}

const char* RemedyFor(LeftOut reason) {
  switch (reason) {
    case LeftOut::kMoving:
      return "a map holds what stands still";
    case LeftOut::kFewViews:
      return "show it for longer, or use a lower --stride";
    case LeftOut::kNoDepth:
      return "move past it sideways, or around it";
    case LeftOut::kContradictingBoxes:
      return "show it whole and from near, or use a better detector";
    case LeftOut::kUnreliable:
      return "walk around it";
    case LeftOut::kNoQuadric:
      return "show it from different sides";
  }
  return "";
}

std::string LeftOutText(const ClassAccount& account) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < kLeftOutReasons; ++i) {
    if (account.left_out[i] > 0) {
      parts.push_back(fmt::format("{} {}", account.left_out[i], TextOf(static_cast<LeftOut>(i))));
    }
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::vector<std::string> MissingObjectLines(const ObjectAccount& account) {
  constexpr int kMinBoxes = 10;
  constexpr std::size_t kMaxClasses = 5;
  std::vector<std::string> lines;
  std::vector<std::string> moving;
  std::vector<std::pair<std::string, ClassAccount>> missing;
  int shown = 0;
  for (const auto& [label, of_class] : account) {
    if (of_class[LeftOut::kMoving] > 0) {
      moving.push_back(fmt::format("{} {}", of_class[LeftOut::kMoving], label));
    }
    shown += of_class.shown > 0 ? 1 : 0;
    if (of_class.shown == 0 && of_class.boxes >= kMinBoxes) {
      missing.emplace_back(label, of_class);
    }
  }
  if (!moving.empty()) {
    lines.push_back(fmt::format("moving, so not in the map: {}", fmt::join(moving, ", ")));
  }
  if (static_cast<int>(missing.size()) <= shown) {
    return lines;
  }
  std::ranges::stable_sort(missing, std::greater(), [](const auto& entry) { return entry.second.boxes; });
  for (const auto& [label, of_class] : missing) {
    if (lines.size() - (moving.empty() ? 0 : 1) == kMaxClasses) {
      lines.push_back(fmt::format("{} more classes without an object: see report.html or stats.json",
                                  missing.size() - kMaxClasses));
      break;
    }
    lines.push_back(MissingText(label, of_class));
  }
  return lines;
}

}  // namespace sqslam
