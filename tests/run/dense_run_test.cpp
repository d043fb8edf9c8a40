#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "slam/dense/densify.h"
#include "slam/run/run_pipeline.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "tests/app/written_sequence.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr int kLiveFrames = 120;

// Holds the frames back as soon as keyframes have settled, until depth maps are in the recording.
class DepthHost : public RunHost {
 public:
  explicit DepthHost(fs::path recording, bool stop) : recording_(std::move(recording)), stop_(stop) {}

  bool Stopped() const override { return stopped_; }
  bool AdmitFrame() override {
    constexpr std::size_t kSettling = 12;  // keyframes from which on the first have settled
    constexpr std::size_t kEnough = 5;     // depth maps
    for (int wait = 0; wait < 80 && seen_ < kEnough && keyframes_ >= kSettling; ++wait) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      seen_ = DepthRecording(recording_).Keyframes().size();
    }
    stopped_ = stop_ && seen_ >= kEnough;
    return !stopped_;
  }
  void Mapped(const MapSnapshotPtr& map) override { keyframes_ = map->keyframes.size(); }
  void Say(const std::string& text) override { news_.push_back(text); }

  std::size_t SeenDuringTheRun() const { return seen_; }
  const std::vector<std::string>& News() const { return news_; }

 private:
  const fs::path recording_;
  const bool stop_;
  std::atomic<bool> stopped_ = false;
  std::atomic<std::size_t> keyframes_ = 0;
  std::size_t seen_ = 0;
  std::vector<std::string> news_;
};

class DenseRunTest : public ::testing::Test {
 protected:
  RunRequest Request() const {
    RunRequest request;
    request.sequence.path = sequence_.Path();
    request.sequence.resize = "1";
    request.output = Result();
    request.options.vocabulary = "none";
    request.options.detection.network = "none";
    request.options.tracking.keyframes.max_interval = 0.13;  // s: many keyframes of a short way, and all stay
    request.options.tracking.keyframes.max_pending = 10;
    request.options.mapping.culling.redundant_observations = 20;
    request.options.dense.views.min_overlap = 0.3;
    request.options.dense.stereo.planes = 48;
    request.dense = DenseTime::kLive;
    return request;
  }
  fs::path Result() const { return folder_.Path() / "result"; }

  // Densifies a result whose depth maps are forgotten first, or not.
  DensifySummary MakeDense(const fs::path& result, bool anew) const {
    if (anew) {
      DepthRecording recording(result / "map.sqmap", DepthRecording::Access::kWrite);
      for (const std::int64_t keyframe : recording.Estimated()) {
        recording.Remove(keyframe);
      }
    }
    return Densify({.result = result, .images = {}, .options = Request().options.dense},
                   [](int, int, const std::string&) { return true; });
  }

  const testing::WrittenSequence sequence_{testing::HandHeldPath(kLiveFrames)};
  const TemporaryFolder folder_;
};

// Median relative difference of the pixels that have a depth in both.
double Difference(const DepthMap& a, const DepthMap& b) {
  std::vector<double> differences;
  for (int y = 0; y < a.depth.rows; ++y) {
    for (int x = 0; x < a.depth.cols; ++x) {
      const float z = a.depth.at<float>(y, x);
      const float other = b.depth.at<float>(y, x);
      if (z > 0.0F && other > 0.0F) {
        differences.push_back(std::abs(z / other - 1.0));
      }
    }
  }
  std::nth_element(differences.begin(), differences.begin() + std::ssize(differences) / 2, differences.end());
  return differences.empty() ? 1.0 : differences[differences.size() / 2];
}

TEST_F(DenseRunTest, WritesLiveDepthMapsThatDensifyKeeps) {
  DepthHost host(Result() / "map.sqmap", false);
  const FinishedRun run = RunPipeline(Request(), host);
  EXPECT_GE(host.SeenDuringTheRun(), 1U);
  EXPECT_THAT(host.News(), Contains(HasSubstr(" depth maps during the run")));
  const fs::path anew = folder_.Path() / "anew";
  fs::copy(Result(), anew, fs::copy_options::recursive);
  MakeDense(anew, true);
  const DepthRecording live(Result() / "map.sqmap"), final(anew / "map.sqmap");
  ASSERT_EQ(live.Keyframes(), final.Keyframes());
  EXPECT_GT(live.Keyframes().size(), host.SeenDuringTheRun());
  double complete = 0.0, complete_anew = 0.0;
  for (const std::int64_t keyframe : live.Keyframes()) {
    const DepthMap a = live.Kept(keyframe);
    const DepthMap b = final.Kept(keyframe);
    EXPECT_LT(Difference(a, b), 0.01);
    const auto pixels = static_cast<double>(a.depth.total() * live.Keyframes().size());
    complete += cv::countNonZero(a.depth > 0.0) / pixels;
    complete_anew += cv::countNonZero(b.depth > 0.0) / pixels;
  }
  EXPECT_NEAR(complete, complete_anew, 0.06);
}

TEST_F(DenseRunTest, KeepsDepthMapsForDensifyWhenStopped) {
  DepthHost host(Result() / "map.sqmap", true);
  const FinishedRun run = RunPipeline(Request(), host);
  EXPECT_TRUE(run.interrupted);
  ASSERT_GE(host.SeenDuringTheRun(), 1U);
  std::vector<std::int64_t> kept;
  {
    const DepthRecording depths(Result() / "map.sqmap");
    kept = depths.Keyframes();
    const MapSnapshotPtr map = RecordingReader(Result() / "map.sqmap").Last();
    for (const std::int64_t keyframe : kept) {  // they lie in the map as it is at the end
      const auto own = std::ranges::find(map->keyframes, keyframe, &SnapshotKeyframe::id);
      ASSERT_NE(own, map->keyframes.end());
      EXPECT_LT((depths.Kept(keyframe).T_map_camera.translation - own->T_map_camera.translation).norm(),
                1e-9);
    }
  }
  ASSERT_GE(kept.size(), 1U);
  const DensifySummary rest = MakeDense(Result(), false);
  EXPECT_EQ(rest.resumed, static_cast<int>(kept.size()));
  EXPECT_GT(rest.estimated, 0);
}

}  // namespace
}  // namespace sqslam
