#include "slam/tracking/relocalizer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/synthetic_map.h"
#include "tests/support/tracked_frame.h"

namespace sqslam {
namespace {

using testing::AsTracked;
using testing::CenterDistance;
using testing::ExactRing;
using testing::GiveWords;
using testing::MakeRingMap;
using testing::MakeSyntheticMap;
using testing::NewFrame;
using testing::PoseOnRing;
using testing::RandomWords;
using testing::RingMapOptions;
using testing::SyntheticMap;

class RelocalizerTest : public ::testing::Test {
 protected:
  RelocalizerTest() { GiveWords(*words_, ring_.map); }

  TrackingViewPtr View(const Map& map, std::int64_t submap = 0) const {
    TrackingView view = MakeTrackingView(map);
    view.submap = submap;
    return std::make_shared<const TrackingView>(std::move(view));
  }
  static AtlasViewPtr Atlas(const std::vector<TrackingViewPtr>& views) {
    AtlasView atlas;
    for (const TrackingViewPtr& view : views) {
      atlas.submaps[view->submap] = view;
    }
    return std::make_shared<const AtlasView>(std::move(atlas));
  }
  // A frame that looks where a keyframe of the ring looked, from a little beside it.
  TrackedFrame Beside(KeyframeId keyframe) const {
    return NewFrame(ring_
                        .See(PoseOnRing(15.0 * static_cast<double>(keyframe) + 2.0),
                             {.pixel_noise = 0.1, .flipped_bits = 10, .clutter = 100})
                        .features);
  }
  static std::vector<KeyframeId> Ids(const std::vector<Relocalizer::Candidate>& places) {
    std::vector<KeyframeId> ids;
    for (const auto& [view, id] : places) {
      ids.push_back(id);
    }
    return ids;
  }

  std::shared_ptr<const Vocabulary> words_ = RandomWords();
  SyntheticMap ring_ = MakeRingMap(ExactRing());
  Relocalizer relocalizer_{words_};
};

TEST_F(RelocalizerTest, ProposesLastReferenceThenSimilarPlaces) {
  const TrackingViewPtr view = View(ring_.map);
  const auto ids = Ids(relocalizer_.Candidates(Atlas({view}), view, AsTracked(ring_.map, 20), Beside(8)));
  ASSERT_GE(ids.size(), 2U);
  EXPECT_EQ(ids[0], 20);
  EXPECT_EQ(ids[1], 8);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 20), 1);
  EXPECT_LE(ids.size(), 6U);
}

TEST_F(RelocalizerTest, ProposesLastReferenceOnlyOnce) {
  const TrackingViewPtr view = View(ring_.map);
  const auto ids = Ids(relocalizer_.Candidates(Atlas({view}), view, AsTracked(ring_.map, 8), Beside(8)));
  EXPECT_EQ(ids.front(), 8);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 8), 1);
}

TEST_F(RelocalizerTest, ProposesOnlyLastReferenceWithoutVocabulary) {
  Relocalizer without(nullptr);
  const TrackingViewPtr view = View(ring_.map);
  EXPECT_EQ(Ids(without.Candidates(Atlas({view}), view, AsTracked(ring_.map, 20), Beside(8))),
            std::vector<KeyframeId>{20});
  EXPECT_TRUE(without.Candidates(nullptr, view, std::nullopt, Beside(8)).empty());
}

TEST_F(RelocalizerTest, ForgetsRemovedKeyframes) {
  const TrackingViewPtr before = View(ring_.map);
  EXPECT_EQ(relocalizer_.Candidates(Atlas({before}), before, std::nullopt, Beside(8)).front().keyframe, 8);
  ring_.map.RemoveKeyframe(8);
  const TrackingViewPtr after = View(ring_.map);
  const auto places = relocalizer_.Candidates(Atlas({after}), after, std::nullopt, Beside(8));
  ASSERT_FALSE(places.empty());
  for (const auto& [view, id] : places) {
    EXPECT_EQ(view, after);
    EXPECT_NE(id, 8);
  }
}

TEST_F(RelocalizerTest, UsesNewestViewBeforeTheAtlasHasIt) {
  const TrackingViewPtr view = View(ring_.map);
  EXPECT_EQ(relocalizer_.Candidates(nullptr, view, std::nullopt, Beside(8)).front().keyframe, 8);
}

TEST_F(RelocalizerTest, ProposesPlacesOfOtherSubmaps) {
  SyntheticMap other = MakeSyntheticMap({});
  GiveWords(*words_, other.map);
  const TrackingViewPtr here = View(other.map, 100);
  RingMapOptions far = ExactRing();
  far.first_id = 100;  // no id is used twice in an atlas
  SyntheticMap ring = MakeRingMap(far);
  GiveWords(*words_, ring.map);
  const TrackingViewPtr there = View(ring.map, 3);
  const auto places = relocalizer_.Candidates(Atlas({here, there}), here, AsTracked(other.map, 2), Beside(8));
  ASSERT_GE(places.size(), 2U);
  EXPECT_EQ(places[0].view, here);
  EXPECT_EQ(places[1].view, there);
  EXPECT_EQ(places[1].keyframe, 108);
}

TEST_F(RelocalizerTest, RelocatesLostFrameWithinAMillimetre) {
  const PoseTracker tracker(ring_.camera, {});
  const TrackingViewPtr view = View(ring_.map);
  for (const KeyframeId keyframe : {2, 8, 17}) {
    TrackedFrame best = Beside(keyframe);
    for (const auto& [place_view, id] :
         relocalizer_.Candidates(Atlas({view}), view, AsTracked(ring_.map, 12), Beside(keyframe))) {
      TrackedFrame frame = Beside(keyframe);
      if (tracker.Relocate(*place_view, place_view->keyframes.at(id), frame) &&
          frame.inliers > best.inliers) {
        best = frame;
      }
    }
    EXPECT_GT(best.inliers, 150);
    EXPECT_LT(CenterDistance(best.T_camera_map, PoseOnRing(15.0 * static_cast<double>(keyframe) + 2.0)),
              1e-3);
  }
}

}  // namespace
}  // namespace sqslam
