#pragma once

#include <memory>
#include <string>

#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"
#include "slam/recognition/vocabulary.h"
#include "slam/snapshot/kept_map.h"
#include "slam/system_options.h"

// Parts shared by System and Localizer.
namespace sqslam {

MapperOptions OptionsOfMapper(const SystemOptions& options);

// Loads the vocabulary of options.vocabulary; null for none. Throws InputError.
std::shared_ptr<const Vocabulary> LoadVocabulary(const SystemOptions& options);

// Same for a kept map. Throws InputError that begins with `name` if the map was made with another vocabulary,
// UsageError if the options name none, as relocalisation needs one.
std::shared_ptr<const Vocabulary> LoadVocabularyFor(const KeptMap& map, const std::string& name,
                                                    const SystemOptions& options);

// Returns the main submap of a kept map, without bags of words. Throws InputError that begins with `name`.
Map MainMapOf(const KeptMap& map, const std::string& name, const SystemOptions& options);

}  // namespace sqslam
