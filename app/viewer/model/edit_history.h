#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <utility>

namespace sqslam::viewer {

// Undo and redo of a document that is a value: every step keeps the whole state, so that nothing has to be
// played backwards. Documents are small (some edits of some dozen objects), steps few hundred.
template <typename State>
class EditHistory {
 public:
  static constexpr std::size_t kMostSteps = 500;  // older ones are forgotten

  explicit EditHistory(State first = {}) : steps_{{std::move(first), "", ""}} {}

  const State& Current() const { return steps_[at_].state; }

  // Takes a new state; what had been undone is gone. `what` names the step in menus ("Delete cup 3"). Steps
  // of one `group` that follow one another are one to the user: those of a drag, of a number that is typed. A
  // state equal to the current one is no step.
  void Push(State state, std::string what, std::string group = "") {
    if (state == Current()) {
      return;
    }
    steps_.resize(at_ + 1);
    if (!group.empty() && group == steps_[at_].group && !sealed_) {
      steps_[at_].state = std::move(state);
      return;
    }
    sealed_ = false;
    steps_.push_back({std::move(state), std::move(what), std::move(group)});
    ++at_;
    if (steps_.size() > kMostSteps) {
      steps_.pop_front();
      --at_;
    }
  }

  // The next step is one of its own, whatever its group (the mouse button was released).
  void Seal() { sealed_ = true; }

  bool CanUndo() const { return at_ > 0; }
  bool CanRedo() const { return at_ + 1 < steps_.size(); }
  void Undo() {
    if (CanUndo()) {
      --at_;
      sealed_ = true;
    }
  }
  void Redo() {
    if (CanRedo()) {
      ++at_;
      sealed_ = true;
    }
  }

  // Names of the steps that Undo and Redo would take back or do again; empty where there is nothing.
  std::string UndoName() const { return CanUndo() ? steps_[at_].what : ""; }
  std::string RedoName() const { return CanRedo() ? steps_[at_ + 1].what : ""; }

 private:
  struct Step {
    State state;
    std::string what;
    std::string group;
  };

  std::deque<Step> steps_;  // never empty
  std::size_t at_ = 0;      // of the current state
  bool sealed_ = false;
};

}  // namespace sqslam::viewer
