#include <algorithm>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/mapping/mapper.h"

// Loop closing and merging of submaps, and the whole map's adjustment afterwards.
namespace sqslam {

// Closes a loop or merges two submaps, where the keyframe shows a place that is mapped already. True where it
// did.
bool Mapper::CloseLoop(KeyframeId keyframe) {
  const LoopOptions& options = options_.mapping.loops;
  if (!options.close || (last_loop_ != kNoKeyframe && keyframe - last_loop_ < options.rest)) {
    return false;
  }
  const StageTimes::Scope timer(times_, "mapping.loops");
  std::vector<const Map*> maps{&active_->Map()};
  for (const auto& [number, submap] : submaps_) {
    if (&submap != active_) {
      maps.push_back(&submap.Map());
    }
  }
  const std::optional<LoopCandidate> loop = places_.Recognize(maps, keyframe);
  if (!loop) {
    return false;
  }
  adjustment_.Stop();
  last_loop_ = keyframe;
  const auto known = std::ranges::find_if(
      submaps_, [&](const auto& entry) { return entry.second.Map().HasKeyframe(loop->known); });
  if (&known->second == active_) {
    CorrectLoop(active_->Map(), camera_, *loop, options, loop_edges_);
    ++counters_.loops;
  } else {
    MergeSubmaps(*loop, known->second);
    ++counters_.merges;
  }
  AdjustInBackground();
  return true;
}

// The younger submap becomes a part of the older one.
void Mapper::MergeSubmaps(const LoopCandidate& loop, Submap& known) {
  const Sim3d S_known_active = SimilarityOfMaps(active_->Map(), known.Map(), loop);
  const bool keep_known = known.Number() < active_->Number();
  Submap& kept = keep_known ? known : *active_;
  Submap& dropped = keep_known ? *active_ : known;
  const Sim3d S_kept_dropped = keep_known ? S_known_active : S_known_active.Inverse();
  const std::int64_t number = dropped.Number();
  dropped.Transform(S_kept_dropped);
  kept.Absorb(std::move(dropped));
  MoveOrigins(number, S_kept_dropped, kept.Number());
  submaps_.erase(number);
  atlas_.submaps.erase(number);
  active_ = &kept;
  loop_edges_.insert(std::minmax(loop.current, loop.known));
  FuseLoop(active_->Map(), camera_, loop, options_.mapping.loops);
  OptimizeLocally(loop.current);
}

// The whole map, on a copy, while mapping goes on.
void Mapper::AdjustInBackground() {
  const int iterations = options_.mapping.loops.bundle_iterations;
  if (iterations > 0) {
    adjustment_.Start({active_->Number(), atlas_.origins.at(active_->Number()).S_map_origin,
                       ExtractBundleProblem(active_->Map(), camera_)},
                      {iterations, iterations, 1});
  }
}

// Takes the result of the bundle adjustment in the background. True where the active map was changed.
bool Mapper::TakeAdjustment() {
  std::optional<BackgroundAdjustment::Job> job = adjustment_.TakeFinished();
  if (!job) {
    return false;
  }
  const StageTimes::Scope timer(times_, "mapping.take_adjustment");
  const Sim3d S_now_then = atlas_.origins.at(job->submap).S_map_origin * job->S_map_origin.Inverse();
  Submap& submap = submaps_.at(job->submap);
  ApplyAdjustment(std::move(job->problem), S_now_then, submap.Map());
  atlas_.submaps[job->submap] = submap.MakeView();
  return job->submap == active_->Number();
}

// The content of `submap` was moved by S_new_old and lies in `new_submap` now.
void Mapper::MoveOrigins(std::int64_t submap, const Sim3d& S_new_old, std::int64_t new_submap) {
  for (auto& [number, origin] : atlas_.origins) {
    if (origin.submap == submap) {
      origin = {new_submap, S_new_old * origin.S_map_origin};
    }
  }
}

}  // namespace sqslam
