#include "slam/scene/question.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <set>

#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::question {

const std::map<std::string, Term>& Terms() {
  static const std::map<std::string, Term> kTerms = [] {
    std::map<std::string, Term> terms;
    const auto add = [&terms](std::initializer_list<const char*> phrases, Role role, int value = 0) {
      for (const char* phrase : phrases) {
        terms[phrase] = {role, value};
      }
    };
    add({"the",   "a",      "an",       "all",   "any",   "every", "is",   "are",
         "that",  "which",  "what",     "where", "show",  "me",    "find", "list",
         "there", "stands", "standing", "lies",  "lying", "with",  "it",   "s"},
        Role::kFiller);
    add({"and", "or", ","}, Role::kJoin);
    add({"not"}, Role::kNot);
    add({"on", "on top of", "upon"}, Role::kRelation, kOn);
    add({"in", "inside", "inside of"}, Role::kRelation, kIn);
    add({"under", "below", "beneath", "underneath"}, Role::kRelation, kUnder);
    add({"above", "over"}, Role::kRelation, kAbove);
    add({"next to", "beside", "near", "by"}, Role::kRelation, kNextTo);
    add({"leans against", "leaning against", "against", "leaning on"}, Role::kRelation, kLeans);
    add({"within"}, Role::kWithin);
    add({"left of", "to left of", "on left of"}, Role::kSide, kLeft);
    add({"right of", "to right of", "on right of"}, Role::kSide, kRight);
    add({"in front of"}, Role::kSide, kInFront);
    add({"behind"}, Role::kSide, kBehind);
    add({"largest", "biggest"}, Role::kSuperlative, kLargest);
    add({"smallest"}, Role::kSuperlative, kSmallest);
    add({"tallest"}, Role::kSuperlative, kTallest);
    add({"highest"}, Role::kSuperlative, kHighest);
    add({"lowest"}, Role::kSuperlative, kLowest);
    add({"nearest", "closest"}, Role::kSuperlative, kNearest);
    add({"farthest", "furthest"}, Role::kSuperlative, kFarthest);
    add({"certain", "reliable"}, Role::kCertainty, 1);
    add({"uncertain", "unreliable"}, Role::kCertainty, 0);
    add({"object", "thing", "anything", "everything", "something"}, Role::kThings);
    add({"floor", "ground"}, Role::kRoom, static_cast<int>(SceneNodeKind::kFloor));
    add({"wall"}, Role::kRoom, static_cast<int>(SceneNodeKind::kWall));
    add({"surface"}, Role::kRoom, static_cast<int>(SceneNodeKind::kSurface));
    return terms;
  }();
  return kTerms;
}

namespace {

using Words = std::vector<std::string>;

// Words in lower case; commas are words, other punctuation separates. Fillers are left out.
Words WordsOf(const std::string& question) {
  Words words(1);
  for (const char raw : question) {
    const char c = static_cast<char>(std::tolower(static_cast<unsigned char>(raw)));
    if (c == ',') {
      words.insert(words.end(), {",", ""});
    } else if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || (c & 0x80) != 0) {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  std::erase_if(words, [](const std::string& word) {
    const auto term = Terms().find(word);
    return word.empty() || word == "." || (term != Terms().end() && term->second.role == Role::kFiller);
  });
  if (!words.empty() && words.back().ends_with('.')) {
    words.back().pop_back();
  }
  return words;
}

// Returns the word and what it may be the plural of.
Words Singulars(const std::string& word) {
  Words forms = {word};
  for (const auto& [ending, replacement] :
       {std::pair("s", ""), {"es", ""}, {"ies", "y"}, {"ves", "f"}, {"ves", "fe"}}) {
    if (word.ends_with(ending)) {
      forms.push_back(word.substr(0, word.size() - std::string(ending).size()) + replacement);
    }
  }
  return forms;
}

std::optional<double> NumberOf(const std::string& word) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc() && end == word.data() + word.size() ? std::optional(number) : std::nullopt;
}

// Reads the sentence from left to right.
class Parser {
 public:
  Parser(const std::string& question, const MapSnapshot& map, const SceneGraph& graph,
         const ClassTable& classes)
      : words_(WordsOf(question)), map_(map), graph_(graph), classes_(classes) {
    for (std::size_t i = 0; i < map.objects.size(); ++i) {
      Name(map.objects[i].label, i);
      Name(map.objects[i].name, i);
      for (const std::string& word : classes.Of(map.objects[i].label).synonyms) {
        Name(word, i);
      }
    }
    for (const auto& [label, traits] : classes.All()) {
      Know(label, traits.legs);
      for (const std::string& word : traits.synonyms) {
        Know(word, traits.legs);
      }
    }
  }

  Question Parse() {
    Question question;
    question.things = BeginsWithCondition() ? AllObjects() : ReadThings();
    while (at_ < words_.size()) {
      if (const std::optional<Term> join = Take(Role::kJoin)) {
        continue;  // "on the table and next to the cup"
      }
      question.conditions.push_back(ReadCondition());
    }
    return question;
  }

 private:
  void Name(const std::string& word, std::size_t object) {
    if (!word.empty()) {
      std::string key = word;
      std::ranges::replace(key, ' ', '_');
      std::ranges::transform(key, key.begin(), [](unsigned char c) { return std::tolower(c); });
      objects_[key].insert(object);
    }
  }
  void Know(const std::string& word, bool legs) {
    objects_[word];
    if (legs) {
      with_legs_.insert(word);
    }
  }

  [[noreturn]] void Expect(const std::string& what) const {
    throw UsageError("question: expected {} {}", what,
                     at_ < words_.size() ? fmt::format("before '{}'", words_[at_]) : "at the end");
  }

  // Returns the term at the current word, of as many words as possible, and its length.
  std::pair<const Term*, std::size_t> TermHere() const {
    for (std::size_t length = std::min<std::size_t>(3, words_.size() - at_); length > 0; --length) {
      const auto from = words_.begin() + static_cast<std::ptrdiff_t>(at_);
      const std::string phrase =
          fmt::format("{}", fmt::join(from, from + static_cast<std::ptrdiff_t>(length), " "));
      for (const std::string& form : Singulars(phrase)) {
        if (const auto it = Terms().find(form); it != Terms().end()) {
          return {&it->second, length};
        }
      }
    }
    return {nullptr, 0};
  }
  std::optional<Term> Take(Role role) {
    if (at_ >= words_.size()) {
      return std::nullopt;
    }
    const auto [term, length] = TermHere();
    if (term == nullptr || term->role != role) {
      return std::nullopt;
    }
    at_ += length;
    return *term;
  }
  bool TakeWord(const char* word) {
    const bool there = at_ < words_.size() && words_[at_] == word;
    at_ += there ? 1 : 0;
    return there;
  }
  std::optional<double> TakeNumber() {
    const std::optional<double> number = at_ < words_.size() ? NumberOf(words_[at_]) : std::nullopt;
    at_ += number ? 1 : 0;
    return number;
  }

  // Reads the name of a class of up to three words.
  const std::string* TakeClass() {
    for (std::size_t length = std::min<std::size_t>(3, words_.size() - at_); length > 0; --length) {
      const auto from = words_.begin() + static_cast<std::ptrdiff_t>(at_);
      const std::string phrase =
          fmt::format("{}", fmt::join(from, from + static_cast<std::ptrdiff_t>(length), "_"));
      for (const std::string& form : Singulars(phrase)) {
        if (const auto it = objects_.find(form); it != objects_.end()) {
          at_ += length;
          return &it->first;
        }
      }
    }
    return nullptr;
  }

  void AddNodes(SceneNodeKind kind, std::vector<bool>& members) const {
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
      members[i] = members[i] || graph_.nodes[i].kind == kind;
    }
  }

  // True for "on the table": what is there, of any class.
  bool BeginsWithCondition() const {
    const Term* term = words_.empty() ? nullptr : TermHere().first;
    return term != nullptr && (term->role == Role::kNot || term->role == Role::kRelation ||
                               term->role == Role::kWithin || term->role == Role::kSide);
  }
  Things AllObjects() const {
    Things things{std::vector<bool>(graph_.nodes.size()), {}};
    AddNodes(SceneNodeKind::kObject, things.members);
    return things;
  }

  // Reads one class, with the id of one of its objects if that follows.
  void ReadClass(std::vector<bool>& members) {
    if (Take(Role::kThings)) {
      AddNodes(SceneNodeKind::kObject, members);
      return;
    }
    if (const std::optional<Term> room = Take(Role::kRoom)) {
      AddNodes(static_cast<SceneNodeKind>(room->value), members);
      return;
    }
    const std::string* name = TakeClass();
    if (name == nullptr) {
      if (at_ >= words_.size() || TermHere().first != nullptr) {
        Expect("a class of objects, such as 'cups'");
      }
      FailAtWord();
    }
    const std::set<std::size_t>& named = objects_.at(*name);
    const std::optional<double> id = TakeNumber();
    for (const std::size_t i : named) {
      members[i] = members[i] || !id || map_.objects[i].id == *id;
    }
    if (named.empty() && with_legs_.contains(*name)) {
      AddNodes(SceneNodeKind::kSurface, members);
    }
  }

  [[noreturn]] void FailAtWord() const {
    Words known = ToVector(objects_, [](const auto& entry) { return entry.first; });
    std::ranges::transform(Terms(), std::back_inserter(known), [](const auto& term) { return term.first; });
    throw UsageError("question: '{}' is not known{}", words_[at_], DidYouMean(words_[at_], known));
  }

  Things ReadThings() {
    Things things{std::vector<bool>(graph_.nodes.size()), {}};
    std::optional<bool> certain;
    while (at_ < words_.size()) {
      const std::size_t before = at_;
      const std::optional<double> count = TakeNumber();
      if (const std::optional<Term> superlative = Take(Role::kSuperlative)) {
        things.choice =
            Choice{static_cast<Superlative>(superlative->value), static_cast<int>(count.value_or(1.0))};
      } else if (const std::optional<Term> term = count ? std::nullopt : Take(Role::kCertainty)) {
        certain = term->value == 1;
      } else {
        at_ = before;
        break;
      }
    }
    do {
      ReadClass(things.members);
    } while (JoinsClasses());
    for (std::size_t i = 0; certain && i < map_.objects.size(); ++i) {
      things.members[i] = things.members[i] && IsReliable(map_.objects[i]) == *certain;
    }
    return things;
  }

  // Takes "and" or a comma if the name of a class follows, not a further condition.
  bool JoinsClasses() {
    const std::size_t before = at_;
    while (Take(Role::kJoin)) {
    }
    if (at_ > before && at_ < words_.size()) {
      const Term* term = TermHere().first;
      if (term == nullptr || term->role == Role::kThings || term->role == Role::kRoom) {
        return true;
      }
    }
    at_ = before;
    return false;
  }

  Condition ReadCondition() {
    Condition condition;
    condition.negated = Take(Role::kNot).has_value();
    if (const std::optional<Term> relation = Take(Role::kRelation)) {
      condition.value = relation->value;
    } else if (Take(Role::kWithin)) {
      condition.role = Role::kWithin;
      condition.length = ReadLength();
    } else if (const std::optional<Term> side = Take(Role::kSide)) {
      condition.role = Role::kSide;
      condition.value = side->value;
    } else if (const std::optional<Term> superlative = Take(Role::kSuperlative)) {
      condition.role = Role::kSuperlative;
      condition.value = superlative->value;
      if (condition.value < kNearest || !(TakeWord("to") || TakeWord("from"))) {
        Expect("'to' or 'from'");
      }
    } else if (at_ < words_.size() && TermHere().first == nullptr) {
      FailAtWord();
    } else {
      Expect("a condition, such as 'on the table',");
    }
    condition.things = ReadThings();
    if (condition.role == Role::kSide) {
      condition.frame = ReadFrame();
    }
    return condition;
  }

  double ReadLength() {
    std::string unit;
    std::optional<double> length = TakeNumber();
    if (!length && at_ < words_.size()) {  // 30cm
      const std::size_t digits = words_[at_].find_first_not_of("0123456789.");
      length = digits == std::string::npos ? std::nullopt : NumberOf(words_[at_].substr(0, digits));
      unit = length ? words_[at_++].substr(digits) : "";
    } else if (at_ < words_.size()) {
      unit = words_[at_++];
    }
    const std::map<std::string, double> units = {{"m", 1.0},     {"metre", 1.0},  {"metres", 1.0},
                                                 {"meter", 1.0}, {"meters", 1.0}, {"cm", 0.01},
                                                 {"mm", 0.001},  {"unit", 0.0},   {"units", 0.0}};
    const auto known = units.find(unit);
    if (!length || known == units.end() || !TakeWord("of")) {
      Expect("a length, such as '0.5 m of',");
    }
    const bool metres = known->second > 0.0;
    ThrowIf<UsageError>(
        metres && !map_.metric,
        "question: the map has no scale, expected a length in 'units', or sqslam scale first");
    ThrowIf<UsageError>(!metres && map_.metric,
                        "question: the map is in metres, expected a length in m, cm or mm");
    return metres ? *length * known->second : *length;
  }

  std::int64_t ReadFrame() {
    if (TakeWord("seen") && TakeWord("from")) {
      TakeWord("frame");
      if (const std::optional<double> frame = TakeNumber()) {
        return static_cast<std::int64_t>(*frame);
      }
    }
    Expect("'seen from' and the number of a frame");
  }

  Words words_;
  std::size_t at_ = 0;
  const MapSnapshot& map_;
  const SceneGraph& graph_;
  const ClassTable& classes_;
  std::map<std::string, std::set<std::size_t>> objects_;  // word -> objects it may mean
  std::set<std::string> with_legs_;                       // words for classes with legs
};

}  // namespace

Question Parse(const std::string& question, const MapSnapshot& map, const SceneGraph& graph,
               const ClassTable& classes) {
  return Parser(question, map, graph, classes).Parse();
}

}  // namespace sqslam::question
