#pragma once

#include "app/viewer/input/input_events.h"

namespace sqslam::viewer {

// Tells ImGui of the keys by which it works; once for its context.
void SetUpUiKeys();

// Hands an event on to ImGui; what is none of its (drop, close) is passed over.
void ApplyToUi(const InputEvent& event);

}  // namespace sqslam::viewer
