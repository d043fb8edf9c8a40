#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include "slam/snapshot/depth_map.h"
#include "slam/snapshot/sqlite_file.h"

namespace sqslam {

// The depth maps in a recording (map.sqmap): a table beside the snapshots with one row per keyframe. A row
// holds the estimated depth with its settings, and the part that its neighbours confirmed once that is known.
// Depths are stored as 16-bit inverse depths between the smallest and the largest of a map, images as JPEG.
//
// Depths and poses are passed in metres if the recording has a MapScale; the rows stay in the map's units.
//
// Each Put is one transaction: a kill at any moment leaves earlier ones intact. All methods throw InputError
// that names the file, also on a full disk.
class DepthRecording {
 public:
  // kBeside: writes while another connection is still writing the recording and will close it.
  enum class Access { kRead, kWrite, kBeside };

  // A recording that was never densified has no rows.
  explicit DepthRecording(const std::filesystem::path& recording, Access access = Access::kRead);
  ~DepthRecording();
  DepthRecording(DepthRecording&&) noexcept = default;

  // Keyframes with a kept depth map, in the order of frames.
  std::vector<std::int64_t> Keyframes() const;

  // The kept depth map of a keyframe.
  DepthMap Kept(std::int64_t keyframe) const;

  // The keyframe's depth before filtering by its neighbours; without `views`.
  DepthMap Estimate(std::int64_t keyframe) const;

  double Metres() const { return metres_; }  // per unit of the rows; 1 if the recording has no scale

  // Settings of the keyframe's depth estimate; empty if it has none.
  std::string Settings(std::int64_t keyframe) const;

  // Takes over the estimates of another recording of the same map and scale, bit by bit.
  void TakeEstimates(const std::filesystem::path& recording);

  // Takes over all depth maps of another recording of the same map and scale, as shown from the first frame
  // on.
  void TakeFinished(const std::filesystem::path& recording);

  void PutEstimate(const DepthMap& map, const std::string& settings);  // drops an older saved map
  void PutKept(const DepthMap& map);                                   // of a keyframe with an estimate
  void Remove(std::int64_t keyframe);

  // Keyframes with an estimate, in the order of frames.
  std::vector<std::int64_t> Estimated() const;

  // Text stored with the depth maps, such as options of later steps; empty if there is none.
  void PutText(const std::string& name, const std::string& text);
  std::string Text(const std::string& name) const;

  void Close();  // merges the WAL into the one file; also done by the destructor

 private:
  sqlite::Statement Prepare(const char* sql, const auto&... values) const {
    return {db_.get(), path_, sql, values...};
  }
  void RunWithOther(const std::filesystem::path& recording, std::initializer_list<const char*> statements);
  std::vector<std::int64_t> List(const char* sql) const;
  DepthMap Read(std::int64_t keyframe, const char* sql) const;

  std::filesystem::path path_;
  sqlite::Database db_;
  Access access_;
  double metres_ = 1.0;
};

}  // namespace sqslam
