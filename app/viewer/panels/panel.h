#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// Where a panel stands in the window.
enum class Place {
  kScene,   // the large view; one panel
  kSide,    // a tab of the column on the right
  kTop,     // above the tabs of that column
  kBottom,  // across the window; one panel
  kOver,    // over all: dialogs and messages; draws windows of its own
};

// One part of the window. To add one: a file in panels/, its Make function in panels/panels.h, and a line in
// AllPanels().
class Panel {
 public:
  Panel() = default;
  virtual ~Panel() = default;
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;

  virtual Place Where() const = 0;
  virtual std::string Title() const = 0;  // of its tab
  virtual bool Wanted(const ViewerState&) const { return true; }

  // Called once a frame inside an ImGui window (kOver: outside of any).
  virtual void Draw(ViewerState& state) = 0;

  // Whether what it shows still changes by itself, so that the window must be drawn again soon.
  virtual bool Busy() const { return false; }
};

using PanelPtr = std::unique_ptr<Panel>;
using Panels = std::vector<PanelPtr>;

}  // namespace sqslam::viewer
