#pragma once

#include <memory>
#include <string>

#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"
#include "slam/recognition/vocabulary.h"
#include "slam/snapshot/saved_map.h"
#include "slam/system.h"
#include "slam/system_options.h"

// Parts shared by System and Localizer.
namespace sqslam {

MapperOptions OptionsOfMapper(const SystemOptions& options);

// Loads the vocabulary of options.vocabulary; null for none. Throws InputError.
std::shared_ptr<const Vocabulary> LoadVocabulary(const SystemOptions& options);

// Same for a saved map. Throws InputError that begins with `name` if the map was made with another
// vocabulary, UsageError if the options name none, as relocalisation needs one.
std::shared_ptr<const Vocabulary> LoadVocabularyFor(const SavedMap& map, const std::string& name,
                                                    const SystemOptions& options);

// Returns the main submap of a saved map, without bags of words. Throws InputError that begins with `name`.
Map MainMapOf(const SavedMap& map, const std::string& name, const SystemOptions& options);

// Merges two maps that show a common place: moves the second into the frame and scale of the first, fuses
// common points and objects, and optimises everything. The first keeps its ids; those of the second are
// raised, and so are its frames and times unless they are later anyway. Unconnected submaps of both are tried
// too. The names of the maps begin messages. Throws InputError if a map is broken or was made with another
// vocabulary, NoMapError if they show no common place.
RunResult MergeMaps(const SavedMap& first, const std::string& first_name, const SavedMap& second,
                    const std::string& second_name, const SystemOptions& options);

}  // namespace sqslam
