#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "slam/geometry/solid_part.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The parts of an object of a recording, found in its depth maps.
struct ObjectParts {
  std::int32_t id = 0;
  Eigen::Vector3d half_size = Eigen::Vector3d::Ones();  // of the hull that they were found in, map units
  std::vector<SolidPart> parts;
};

// [{center, half_size, shape: [e1, e2]}], in half sizes of the hull. Reading throws InputError for a part
// that is not finite, has no size or reaches out of the hull's box.
nlohmann::ordered_json PartsToJson(const std::vector<SolidPart>& parts);
std::vector<SolidPart> PartsFromJson(const nlohmann::ordered_json& json);

// Returns the parts stored in a recording; none if they were never looked for. Throws InputError if they are
// broken.
std::vector<ObjectParts> ReadObjectParts(const std::filesystem::path& recording);

// Stores parts beside the depth maps of a finished recording, replacing earlier ones. Throws InputError.
void StoreObjectParts(const std::filesystem::path& recording, const std::vector<ObjectParts>& parts);

// Gives the objects of a snapshot in map units their parts, except where a hull has another size than the one
// that the parts were found in, as while the map grows.
void AddParts(const std::vector<ObjectParts>& parts, MapSnapshot& snapshot);

}  // namespace sqslam
