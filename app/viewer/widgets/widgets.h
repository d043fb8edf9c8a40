#pragma once

#include <imgui.h>

#include <Eigen/Core>
#include <string>

#include "app/viewer/widgets/theme.h"

// Small things that panels are made of.
namespace sqslam::viewer {

enum class Icon { kPlay, kPause, kBackward, kStepBack, kStepForward, kFirst, kLast, kStop };

// A square button with a drawn sign; `tip` is shown under the mouse. True when pressed.
bool IconButton(const char* id, Icon icon, const char* tip, bool on = false);

// A heading over a group of fields, and its letters alone.
void Heading(const char* text);
void Bold(const char* text);

// A section that can be folded, in the colour of fields: the accent is for what is selected. True while open.
bool Section(const char* name);

// "name  value" in two columns of a panel.
void Row(const char* name, const std::string& value);

// A square of a class's colour, on the line of the text that follows; hollow for what is not shown.
void Swatch(const Eigen::Vector3d& color, bool hollow = false);
ImU32 Packed(const Eigen::Vector3d& color, float alpha = 1.0F);

// Text under the mouse, wrapped; after the item that it explains.
void Tip(const char* text);

// A button that stays pressed while `*on`; true when it was clicked.
bool Toggle(const char* label, bool* on, const char* tip);

}  // namespace sqslam::viewer
