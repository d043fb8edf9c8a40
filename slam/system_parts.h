#pragma once

#include <memory>
#include <string>

#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"
#include "slam/recognition/vocabulary.h"
#include "slam/snapshot/kept_map.h"
#include "slam/system_options.h"

// The parts that System and Localizer are both put together from.
namespace sqslam {

MapperOptions OptionsOfMapper(const SystemOptions& options);

// The visual words that options.vocabulary names; null for none. Throws InputError.
std::shared_ptr<const Vocabulary> LoadVocabulary(const SystemOptions& options);

// The same for a kept map. Throws InputError that begins with `name` where the map was made with other words,
// UsageError where the options name none: without words nothing is found again.
std::shared_ptr<const Vocabulary> LoadVocabularyFor(const KeptMap& map, const std::string& name,
                                                    const SystemOptions& options);

// The main submap of a kept map, without words. Throws InputError that begins with `name`.
Map MainMapOf(const KeptMap& map, const std::string& name, const SystemOptions& options);

}  // namespace sqslam
