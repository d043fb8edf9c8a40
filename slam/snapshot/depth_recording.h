#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "slam/snapshot/depth_map.h"

namespace sqslam {

// The depth maps in a recording (map.sqmap): a table beside the snapshots, one row a keyframe, which programs
// that do not know it pass over. A row holds the depth as it was estimated, with the settings that it was
// estimated with, and once it has been held against its neighbours what of it is kept. Depths are stored as
// inverse depths of 16 bits between the smallest and the largest of a map, images as JPEG.
//
// Depths and poses are given and taken in metres where the recording keeps a MapScale; the rows stay in the
// map's units.
//
// Each Put is one transaction: a kill at any moment leaves what was put before. All methods throw InputError
// that names the file, on a full disk too.
class DepthRecording {
 public:
  // kBeside: writes while another connection goes on writing the recording, which also closes it.
  enum class Access { kRead, kWrite, kBeside };

  // A recording that was not densified yet has no rows; kWrite and kBeside add the table.
  explicit DepthRecording(const std::filesystem::path& recording, Access access = Access::kRead);
  ~DepthRecording();
  DepthRecording(DepthRecording&&) noexcept;

  // Keyframes with a kept depth map, by frame.
  std::vector<std::int64_t> Keyframes() const;

  // The kept depth map of a keyframe.
  DepthMap Kept(std::int64_t keyframe) const;

  // The keyframe's depth before it was held against its neighbours; without `views`.
  DepthMap Estimate(std::int64_t keyframe) const;

  double Metres() const;  // of a unit of the rows; 1 where the recording keeps no scale

  // The settings that the keyframe's depth was estimated with; empty where it has none.
  std::string Settings(std::int64_t keyframe) const;

  void PutEstimate(const DepthMap& map, const std::string& settings);  // drops what was kept of an older one
  void PutKept(const DepthMap& map);                                   // of a keyframe with an estimate
  void Remove(std::int64_t keyframe);

  // Keyframes with an estimate, by frame.
  std::vector<std::int64_t> Estimated() const;

  // Text kept beside the depth maps, such as options of what is made of them; empty where none was put.
  void PutText(const std::string& name, const std::string& text);
  std::string Text(const std::string& name) const;

  void Close();  // folds what was written into the one file; also done by the destructor

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
