#include "app/viewer/frames/replay.h"

#include <fmt/format.h>

#include <condition_variable>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "app/result/map_input.h"
#include "render/video/video_alignment.h"
#include "slam/io/input_images.h"
#include "slam/io/sequence.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// The frames behind a recording, as far as they are still available: times, images and boxes from the mapped
// sequence, poses from trajectory.txt beside the recording.
class RunFrames {
 public:
  // Never throws: missing data is left out, and WhyNoImages() gives the reason. `camera`: of the map, for
  // the size of images and boxes.
  RunFrames(const RecordingReader& recording, const fs::path& map_file, const Camera& camera);

  // Returns every frame from the first snapshot to the last; only the snapshots where the sequence is gone or
  // has become shorter.
  std::vector<Moment> Moments(const RecordingReader& recording) const;

  // T_map_camera in the finished map.
  std::optional<Rigid3d> PoseOf(std::int64_t frame) const {
    const auto found = poses_.find(frame);
    return found == poses_.end() ? std::nullopt : std::optional(found->second);
  }
  std::vector<Detection> BoxesOf(std::int64_t frame) const {
    return sequence_ && HasFrame(*sequence_, frame)
               ? sequence_->frames[static_cast<std::size_t>(frame)].detections
               : std::vector<Detection>();
  }

  // 8UC3, or empty. Fastest for frames in ascending order.
  cv::Mat ImageOf(std::int64_t frame) { return images_ ? images_->Read(frame) : cv::Mat(); }
  const std::string& WhyNoImages() const { return why_no_images_; }

 private:
  std::optional<Sequence> sequence_;
  std::map<std::int64_t, Rigid3d> poses_;
  std::optional<InputImages> images_;
  std::string why_no_images_ = "This image cannot be read.";
};

RunFrames::RunFrames(const RecordingReader& recording, const fs::path& map_file, const Camera& camera) {
  try {
    Sequence sequence = OpenSequence({.path = recording.Info().sequence_path,
                                      .resize = fmt::format("{},{}", camera.width, camera.height)});
    CheckNumbering(recording, sequence);
    sequence_ = std::move(sequence);
    images_.emplace(*sequence_);
  } catch (const std::exception& error) {  // moved, deleted, changed, or a live camera
    why_no_images_ = error.what();
  }
  try {
    if (sequence_) {
      poses_ = ReadPosesByFrame(map_file.parent_path() / "trajectory.txt", *sequence_);
    }
  } catch (const InputError&) {  // broken file: only the poses of snapshots are known
  }
}

std::vector<Moment> RunFrames::Moments(const RecordingReader& recording) const {
  std::vector<Moment> moments;
  const int snapshots = recording.Size();
  int snapshot = 0;
  for (std::int64_t frame = recording.FrameIndex(0);
       sequence_ && HasFrame(*sequence_, frame) && frame <= recording.FrameIndex(snapshots - 1); ++frame) {
    while (snapshot + 1 < snapshots && recording.FrameIndex(snapshot + 1) <= frame) {
      ++snapshot;
    }
    const bool tracked = poses_.empty() || poses_.contains(frame);
    moments.push_back(
        {frame, sequence_->frames[static_cast<std::size_t>(frame)].timestamp, snapshot, tracked});
  }
  const auto shown = moments.empty() ? std::nullopt : std::optional(moments.back().frame_index);
  for (int i = 0; i < snapshots; ++i) {
    if (!shown || recording.FrameIndex(i) > *shown) {
      moments.push_back({recording.FrameIndex(i), recording.Timestamp(i), i});
    }
  }
  return moments;
}

// Reads moments of a recording; not shared between threads.
class Reader {
 public:
  explicit Reader(const fs::path& path)
      : file_(path), recording_(app::OpenMap(file_, {}, HiddenObjects::kKeep)), last_(recording_.Last()) {}

  OpenedRecording Opened() const { return {recording_.Info(), last_}; }

  Timeline MakeTimeline() {
    frames_.emplace(recording_, file_, last_->camera);
    return {frames_->Moments(recording_), {}};
  }

  int Size() const { return recording_.Size(); }
  MapSnapshotPtr Snapshot(int index) const { return recording_.Read(index); }

  ShownFramePtr Read(const Moment& moment) {
    // Read in parallel: both take about as long.
    std::future<cv::Mat> image =
        std::async(std::launch::async, [&] { return frames_->ImageOf(moment.frame_index); });
    const MapSnapshotPtr aligned = Aligned(moment.snapshot);
    auto shown = std::make_shared<ShownFrame>();
    shown->frame_index = moment.frame_index;
    shown->timestamp = moment.timestamp;
    shown->image = image.get();
    if (shown->image.empty()) {
      shown->no_image = frames_->WhyNoImages();
    }
    if (moment.frame_index == aligned->frame_index) {
      shown->detections = aligned->detections;
      shown->map = aligned;
      return shown;
    }
    for (const Detection& box : frames_->BoxesOf(moment.frame_index)) {
      shown->detections.push_back({box, -1});
    }
    auto map = std::make_shared<MapSnapshot>(*aligned);
    map->T_map_camera = frames_->PoseOf(moment.frame_index);
    shown->map = std::move(map);
    return shown;
  }

 private:
  // Returns a snapshot in the frame of the finished map; caches the last few.
  MapSnapshotPtr Aligned(int snapshot) {
    for (const auto& [index, map] : cache_) {
      if (index == snapshot) {
        return map;
      }
    }
    MapSnapshotPtr map = last_;
    if (snapshot != recording_.Size() - 1) {
      const MapSnapshotPtr read = recording_.Read(snapshot);
      map = std::make_shared<const MapSnapshot>(Transformed(AlignByKeyframes(*read, *last_), *read));
    }
    constexpr std::size_t kMaxCached = 32;
    cache_.emplace_front(snapshot, map);
    cache_.resize(std::min(cache_.size(), kMaxCached));
    return map;
  }

  fs::path file_;
  RecordingReader recording_;
  MapSnapshotPtr last_;
  std::optional<RunFrames> frames_;
  std::deque<std::pair<int, MapSnapshotPtr>> cache_;
};

}  // namespace

struct Replay::Impl {
  explicit Impl(fs::path wanted) : path(std::move(wanted)), thread([this] { Work(); }) {}

  void Work() {
    try {
      Reader reader(path);
      OpenedRecording opened = reader.Opened();
      Tell([&] { news.opened = std::move(opened); });
      Timeline timeline = reader.MakeTimeline();
      Tell([&] { news.timeline = timeline; });
      Serve(reader, std::move(timeline));
    } catch (const std::exception& e) {
      Tell([&] { news.error = e.what(); });
    }
    Tell([&] { busy = false; });
  }

  // Requested frames go first. An error in the file does not stop the rest.
  void Serve(Reader& reader, Timeline timeline) {
    const auto try_to = [&](auto&& work) {
      try {
        work();
      } catch (const std::exception& e) {
        Tell([&] { news.error = e.what(); });
      }
    };
    auto histories = std::make_shared<ObjectHistories>();
    for (int read = 0;;) {
      std::optional<Moment> wanted;
      {
        std::unique_lock lock(mutex);
        busy = false;
        if (read == reader.Size()) {
          changed.wait(lock, [&] { return ending || request; });
        }
        if (ending) {
          return;
        }
        wanted = std::exchange(request, std::nullopt);
        busy = true;
      }
      if (wanted) {
        try_to([&] {
          ShownFramePtr frame = reader.Read(*wanted);
          Tell([&] { news.frame = std::move(frame); });
        });
        continue;
      }
      try_to([&] {
        const MapSnapshotPtr map = reader.Snapshot(read);
        timeline.series.Add(*map);
        AddSamples(read, *map, *histories);
      });
      ++read;
      Tell([&] {
        news.progress = static_cast<double>(read) / reader.Size();
        if (read % 16 == 0 || read == reader.Size()) {
          news.timeline = timeline;
        }
        if (read == reader.Size()) {
          news.histories = std::move(histories);
        }
      });
    }
  }

  void Tell(auto&& change) {
    const std::lock_guard lock(mutex);
    change();
  }

  fs::path path;
  mutable std::mutex mutex;
  std::condition_variable changed;
  News news;  // guarded by `mutex`, like all members below
  std::optional<Moment> request;
  bool ending = false;
  bool busy = true;
  std::thread thread;
};

Replay::Replay(const fs::path& path) : impl_(std::make_unique<Impl>(path)) {}

Replay::~Replay() {
  impl_->Tell([&] { impl_->ending = true; });
  impl_->changed.notify_all();
  impl_->thread.join();
}

void Replay::Request(const Moment& moment) {
  impl_->Tell([&] { impl_->request = moment; });
  impl_->changed.notify_all();
}

Replay::News Replay::Poll() {
  const std::lock_guard lock(impl_->mutex);
  News news = std::exchange(impl_->news, {});
  impl_->news.progress = news.progress;
  return news;
}

bool Replay::HasNews() const {
  const std::lock_guard lock(impl_->mutex);
  return !impl_->news.Empty();
}

bool Replay::Idle() const {
  const std::lock_guard lock(impl_->mutex);
  return !impl_->busy && !impl_->request && impl_->news.Empty();
}

}  // namespace sqslam::viewer
