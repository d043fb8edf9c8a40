#include "slam/snapshot/object_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "slam/snapshot/depth_recording.h"
#include "slam/util/error.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
namespace {

constexpr const char* kPartsText = "parts";  // DepthRecording::Text

Eigen::Vector3d VectorFrom(const Json& json) {
  return Eigen::Vector3d(json.get<std::array<double, 3>>().data());
}

}  // namespace

Json PartsToJson(const std::vector<SolidPart>& parts) {
  return ToVector(parts, [](const SolidPart& part) {
    return Json{{"center", part.centre},
                {"half_size", part.shape.half_size},
                {"shape", {part.shape.e1, part.shape.e2}}};
  });
}

std::vector<SolidPart> PartsFromJson(const Json& json) {
  constexpr double kRounding = 1e-6;
  constexpr std::size_t kMaxParts = 64;
  if (json.size() > kMaxParts) {
    throw InputError("parts: {} of them, expected at most {}", json.size(), kMaxParts);
  }
  return ToVector(json, [](const Json& entry) {
    const std::array<double, 2> exponents = entry.at("shape");
    const SolidPart part{VectorFrom(entry.at("center")),
                         {VectorFrom(entry.at("half_size")), exponents[0], exponents[1]}};
    const bool inside = (part.centre.cwiseAbs() + part.shape.half_size).maxCoeff() <= 1.0 + kRounding;
    const bool shaped = std::ranges::all_of(exponents, [](double e) { return e >= 0.0 && e <= 2.0; });
    if (!inside || !shaped || !(part.shape.half_size.minCoeff() > 0.0) || !part.centre.allFinite()) {
      throw InputError(
          "parts: expected half sizes above 0, a place in the unit box and exponents from 0 to 2");
    }
    return part;
  });
}

std::vector<ObjectParts> ReadObjectParts(const fs::path& recording) {
  const std::string text = DepthRecording(recording).Text(kPartsText);
  if (text.empty()) {
    return {};
  }
  try {
    return ToVector(Json::parse(text), [](const Json& entry) {
      return ObjectParts{entry.at("id"), VectorFrom(entry.at("half_size")), PartsFromJson(entry.at("parts"))};
    });
  } catch (const std::exception& e) {
    throw InputError("{}: its parts of objects are broken ({}), expected those that sqslam densify writes",
                     recording.string(), e.what());
  }
}

void StoreObjectParts(const fs::path& recording, const std::vector<ObjectParts>& parts) {
  const Json list = ToVector(parts, [](const ObjectParts& object) {
    return Json{{"id", object.id}, {"half_size", object.half_size}, {"parts", PartsToJson(object.parts)}};
  });
  DepthRecording(recording, DepthRecording::Access::kWrite).PutText(kPartsText, list.dump());
}

void AddParts(const std::vector<ObjectParts>& parts, MapSnapshot& snapshot) {
  constexpr double kMaxChange = 0.25;  // of the logarithm of a half size
  for (SnapshotObject& object : snapshot.objects) {
    const auto found = std::ranges::find(parts, object.id, &ObjectParts::id);
    if (found != parts.end()) {
      const Eigen::Array3d ratio = object.superquadric.shape.half_size.array() / found->half_size.array();
      if (ratio.log().abs().maxCoeff() < kMaxChange) {
        object.parts = found->parts;
      }
    }
  }
}

}  // namespace sqslam
