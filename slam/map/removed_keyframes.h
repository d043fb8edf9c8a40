#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "slam/map/anchored_pose.h"

namespace sqslam {

// Pose of a keyframe that the map no longer holds.
struct RemovedKeyframe {
  AnchoredPose pose;  // relative to its parent, which may have been removed later
  double scale = 1.0;

  static void VisitState(auto& self, auto&& visit) { visit(self.pose, self.scale); }
};

// Removed keyframes by id. Never change once added, so that copies share them.
class RemovedKeyframes {
 public:
  RemovedKeyframes() = default;
  explicit RemovedKeyframes(const std::map<KeyframeId, RemovedKeyframe>& all) {
    for (const auto& [id, removed] : all) {
      Add(id, removed);
    }
  }

  void Add(KeyframeId id, const RemovedKeyframe& removed) {
    std::shared_ptr<const Page>& page = pages_[id / kPage];
    auto grown = page ? std::make_shared<Page>(*page) : std::make_shared<Page>();
    size_ += grown->insert_or_assign(id, removed).second ? 1 : 0;
    page = std::move(grown);
  }

  // Takes over all of another one; no id may be in both.
  void Absorb(RemovedKeyframes&& other) {
    for (const auto& [id, removed] : other.All()) {
      Add(id, removed);
    }
    other = {};
  }

  // Returns null if the keyframe is not one of them.
  const RemovedKeyframe* Find(KeyframeId id) const {
    const auto page = pages_.find(id / kPage);
    if (page == pages_.end()) {
      return nullptr;
    }
    const auto it = page->second->find(id);
    return it != page->second->end() ? &it->second : nullptr;
  }
  const RemovedKeyframe& At(KeyframeId id) const {
    const RemovedKeyframe* removed = Find(id);
    return removed != nullptr ? *removed : throw std::out_of_range("a keyframe that the map never had");
  }
  bool Contains(KeyframeId id) const { return Find(id) != nullptr; }
  int Size() const { return size_; }

  // Returns a number above the ids of all of them, or 0.
  KeyframeId IdBound() const { return pages_.empty() ? 0 : pages_.rbegin()->second->rbegin()->first + 1; }

  std::map<KeyframeId, RemovedKeyframe> All() const {
    std::map<KeyframeId, RemovedKeyframe> all;
    for (const auto& [number, page] : pages_) {
      all.insert(page->begin(), page->end());
    }
    return all;
  }

  // Returns the pose of a keyframe, removed or not. `present`: returns that of one that is there, else
  // nullopt.
  ScaledPose PoseOf(KeyframeId id, const auto& present) const {
    std::vector<const RemovedKeyframe*> way;  // from the keyframe to its nearest ancestor in the map
    auto found = present(id);
    while (!found) {
      way.push_back(&At(id));
      id = way.back()->pose.reference;
      found = present(id);
    }
    ScaledPose pose = *found;
    for (; !way.empty(); way.pop_back()) {
      const RemovedKeyframe& removed = *way.back();
      const double parent_scale = pose.scale;
      pose = Resolve(removed.pose, pose);
      pose.scale = removed.scale * parent_scale / removed.pose.scale;
    }
    return pose;
  }

  static void VisitState(auto& self, auto&& visit) {
    std::map<KeyframeId, RemovedKeyframe> all = self.All();
    visit(all);
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(self)>>) {
      self = RemovedKeyframes(all);
    }
  }

 private:
  static constexpr KeyframeId kPage = 64;  // ids of a page
  using Page = std::map<KeyframeId, RemovedKeyframe>;

  std::map<KeyframeId, std::shared_ptr<const Page>> pages_;  // by id / kPage
  int size_ = 0;
};

}  // namespace sqslam
