#include "slam/detection/network_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

fs::path FindWeights(const fs::path& yaml, const std::string& file) {
  std::vector<fs::path> places = {yaml.parent_path() / file};
  try {
    places.push_back(DataPath("assets") / "detectors" / file);
  } catch (const InputError&) {  // no assets: the place beside the YAML file is left
  }
  std::vector<std::string> names;
  for (const fs::path& place : places) {
    if (fs::is_regular_file(place)) {
      return fs::absolute(place);
    }
    names.push_back(place.string());
  }
  throw InputError(fmt::format(
      "{}: its weights '{}' are missing, expected one of {}; scripts/fetch-detector.sh obtains a network",
      yaml.string(), file, fmt::join(names, ", ")));
}

}  // namespace

NetworkOptions LoadNetwork(const std::string& name_or_file, const std::vector<std::string>& settings) {
  const fs::path path = ConfigFile("configs/detectors", "detector", name_or_file);
  NetworkOptions options;
  LoadOptions(path, options);
  for (const std::string& setting : settings) {
    SetOption(setting, options);
  }
  CheckOptions(options);
  if (options.file.empty()) {
    throw UsageError(fmt::format("{}: no 'file', expected the name of an .onnx file", path.string()));
  }
  if (options.width % 32 != 0 || options.height % 32 != 0) {
    throw UsageError(fmt::format("{}: input of {}x{}, expected multiples of 32", path.string(), options.width,
                                 options.height));
  }
  options.file = FindWeights(path, options.file).string();
  return options;
}

std::string Fingerprint(const NetworkOptions& options) {
  std::ifstream in(options.file, std::ios::binary);
  const std::string weights((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const auto* bytes = reinterpret_cast<const Bytef*>(weights.data());
  std::string line = DumpOptions(options);
  std::replace(line.begin(), line.end(), '\n', ' ');
  return fmt::format("{}weights: {:08x}", line, crc32_z(0, bytes, weights.size()));
}

}  // namespace sqslam
