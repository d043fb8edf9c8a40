#include "app/viewer/model/object_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "slam/scene/query.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

// Returns "cup 2", "cup 2 and cup 3" or "cup 2, cup 3, bottle 4 and 7 more".
std::string NamesOf(const std::vector<QueryAnswer>& answers, const MapSnapshot& map) {
  constexpr std::size_t kMaxNames = 3;
  const std::size_t count = answers.size();
  const std::size_t named = count <= kMaxNames ? count : kMaxNames;
  std::string text;
  for (std::size_t i = 0; i < named; ++i) {
    text += i == 0 ? "" : i + 1 == count ? " and " : ", ";
    text += ObjectName(map.objects[static_cast<std::size_t>(answers[i].object)]);
  }
  return text + (named < count ? fmt::format(" and {} more", count - named) : "");
}

}  // namespace

void ObjectSearch::Update(const std::string& text, const std::vector<ObjectRow>& rows,
                          const MapSnapshotPtr& map, const std::filesystem::path& folder) {
  if (text == text_ && map == map_) {
    return;
  }
  text_ = text;
  map_ = map;
  filter_ = RowFilter(text);
  answers_.reset();
  message_ = filter_.Problem();
  failed_ = !message_.empty();
  const bool found = std::ranges::any_of(rows, [this](const ObjectRow& row) { return filter_.Shows(row); });
  if (!found && !filter_.Compares() && map) {
    Ask(map, folder);
  }
}

void ObjectSearch::Ask(const MapSnapshotPtr& map, const std::filesystem::path& folder) {
  constexpr std::string_view kPrefix = "question: ";
  static const ClassTable kClasses = ClassTable::Named("default");
  try {
    if (graph_of_ != map) {
      graph_ = SceneGraphOf(*map, folder);
      graph_of_ = map;
    }
    const std::vector<QueryAnswer> answers = AnswerQuery(text_, *map, graph_, kClasses);
    answers_.emplace();
    for (const QueryAnswer& answer : answers) {
      answers_->insert(map->objects[static_cast<std::size_t>(answer.object)].id);
    }
    message_ = answers.empty() ? "no object of the map is an answer" : NamesOf(answers, *map);
  } catch (const std::exception& error) {  // also a broken dense.ply
    message_ = error.what();
    message_.erase(0, message_.starts_with(kPrefix) ? kPrefix.size() : 0);
    failed_ = true;
  }
}

bool ObjectSearch::Shows(const ObjectRow& row) const {
  return answers_ ? answers_->contains(row.object.id) : filter_.Shows(row);
}

}  // namespace sqslam::viewer
