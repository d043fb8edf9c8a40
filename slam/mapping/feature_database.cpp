#include "slam/mapping/feature_database.h"

#include <string_view>

#include "slam/estimation/two_view.h"
#include "slam/features/matching.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

std::size_t HashOf(const std::vector<Descriptor>& descriptors) {
  return std::hash<std::string_view>()(
      {reinterpret_cast<const char*>(descriptors.data()), descriptors.size() * sizeof(Descriptor)});
}

}  // namespace

FrameFeaturesPtr FeatureDatabase::FeaturesOf(const std::filesystem::path& image,
                                             const std::function<FrameFeatures()>& extract) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = features_.find(image); known != features_.end()) {
      return known->second;
    }
  }
  auto features = std::make_shared<const FrameFeatures>(extract());
  const std::lock_guard lock(mutex_);
  if (features_.size() < std::size_t{kMaxImages}) {
    features_.emplace(image, features);
  }
  return features;
}

ImageMatches FeatureDatabase::MatchesOf(const FrameFeatures& a, const FrameFeatures& b) {
  constexpr int kMaxDistance = 64;  // bits
  const std::pair key(HashOf(a.descriptors), HashOf(b.descriptors));
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = matches_.find(key); known != matches_.end()) {
      return known->second;
    }
  }
  ImageMatches found = MatchAll(a, b, {}, {}, kMaxDistance, kMaxDistanceRatio);
  const std::vector<TwoViewMatch> raw = ToVector(found, [&](const auto& match) {
    return TwoViewMatch{a.keypoints[match.first].raw_pixel, b.keypoints[match.second].raw_pixel};
  });
  if (FundamentalSupport(raw) < kMinImageMatches) {
    found.clear();
  }
  const std::lock_guard lock(mutex_);
  return matches_.emplace(key, std::move(found)).first->second;
}

std::size_t FeatureDatabase::Searched() const {
  const std::lock_guard lock(mutex_);
  return matches_.size();
}

}  // namespace sqslam
