#include "app/viewer/frames/replay.h"

#include <fmt/format.h>

#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include "app/result/map_file.h"
#include "app/viewer/frames/run_frames.h"
#include "render/video/video_alignment.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// What can be read without asking the thread that draws.
class Reader {
 public:
  explicit Reader(const fs::path& path) : file_(app::MapFile(path)), recording_(file_) {
    if (recording_.Size() == 0) {
      throw InputError(fmt::format("{}: holds no snapshot, expected a map", file_.string()));
    }
    last_ = recording_.Last();
  }

  OpenedRecording Opened() const {
    OpenedRecording opened{file_, recording_.Info(), last_, {}};
    try {
      const fs::path stats = file_.parent_path() / "stats.json";
      if (fs::exists(stats)) {
        opened.stats = ReadStats(stats);
      }
    } catch (const InputError&) {  // the map is what matters
    }
    return opened;
  }

  Timeline MakeTimeline() {
    frames_ = std::make_unique<RunFrames>(recording_, file_);
    Timeline timeline;
    timeline.moments = frames_->Moments(recording_, *last_);
    return timeline;
  }

  int Size() const { return recording_.Size(); }
  MapSnapshotPtr Snapshot(int index) const { return recording_.Read(index); }

  ShownFramePtr Read(const Moment& moment) {
    // Both take about as long.
    std::future<cv::Mat> image =
        std::async(std::launch::async, [&] { return frames_->ImageOf(moment.frame_index); });
    const MapSnapshotPtr aligned = Aligned(moment.snapshot);
    auto shown = std::make_shared<ShownFrame>();
    shown->frame_index = moment.frame_index;
    shown->timestamp = moment.timestamp;
    shown->image = image.get();
    if (shown->image.empty()) {
      shown->no_image =
          frames_->WhyNoImages().empty() ? "This image cannot be read." : frames_->WhyNoImages();
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
  // In the frame of the finished map; the last few are kept.
  MapSnapshotPtr Aligned(int snapshot) {
    for (const auto& [index, map] : kept_) {
      if (index == snapshot) {
        return map;
      }
    }
    MapSnapshotPtr map = last_;
    if (snapshot != recording_.Size() - 1) {
      const MapSnapshotPtr read = recording_.Read(snapshot);
      map = std::make_shared<const MapSnapshot>(Transformed(AlignByKeyframes(*read, *last_), *read));
    }
    constexpr std::size_t kKept = 32;
    kept_.emplace_front(snapshot, map);
    kept_.resize(std::min(kept_.size(), kKept));
    return map;
  }

  fs::path file_;
  RecordingReader recording_;
  MapSnapshotPtr last_;
  std::unique_ptr<RunFrames> frames_;
  std::deque<std::pair<int, MapSnapshotPtr>> kept_;
};

}  // namespace

struct Replay::Impl {
  explicit Impl(fs::path wanted) : path(std::move(wanted)), thread([this] { Work(); }) {}

  void Work() {
    try {
      Reader reader(path);
      OpenedRecording opened = reader.Opened();
      Publish([&] { news.opened = std::move(opened); });
      Timeline timeline = reader.MakeTimeline();
      Publish([&] { news.timeline = timeline; });
      Serve(reader, std::move(timeline));
    } catch (const std::exception& e) {
      Publish([&] { news.error = e.what(); });
    }
    Publish([&] { busy = false; });
  }

  // Frames that are asked for go first. Where the file is damaged, the rest of it is still shown.
  void Serve(Reader& reader, Timeline timeline) {
    const auto try_to = [&](auto&& read) {
      try {
        read();
      } catch (const std::exception& e) {
        Publish([&] { news.error = e.what(); });
      }
    };
    for (int summed = 0;;) {
      std::optional<Moment> wanted;
      {
        std::unique_lock lock(mutex);
        busy = false;
        if (summed == reader.Size()) {
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
          Publish([&] { news.frame = std::move(frame); });
        });
        continue;
      }
      try_to([&] { timeline.series.Add(*reader.Snapshot(summed)); });
      ++summed;
      const bool tell = summed % 16 == 0 || summed == reader.Size();
      Publish([&] {
        news.progress = static_cast<double>(summed) / reader.Size();
        if (tell) {
          news.timeline = timeline;
        }
      });
    }
  }

  template <typename Change>
  void Publish(Change&& change) {
    const std::lock_guard lock(mutex);
    change();
  }

  fs::path path;
  mutable std::mutex mutex;
  std::condition_variable changed;
  News news;  // guarded by mutex, as all below
  std::optional<Moment> request;
  bool ending = false;
  bool busy = true;
  std::thread thread;
};

Replay::Replay(const fs::path& path) : impl_(std::make_unique<Impl>(path)) {}

Replay::~Replay() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
  }
  impl_->changed.notify_all();
  impl_->thread.join();
}

void Replay::Request(const Moment& moment) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->request = moment;
  }
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
  const News& news = impl_->news;
  return news.opened || news.timeline || news.frame || !news.error.empty();
}

bool Replay::Idle() const {
  const std::lock_guard lock(impl_->mutex);
  const News& news = impl_->news;
  return !impl_->busy && !impl_->request && !news.opened && !news.timeline && !news.frame &&
         news.error.empty();
}

}  // namespace sqslam::viewer
