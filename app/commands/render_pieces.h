#pragma once

#include <functional>

#include "app/commands/render_arguments.h"

namespace sqslam::app {

// Draws a video in pieces on a Slurm cluster, one task each, and joins them; as a task (--task) draws only
// its piece. Incomplete pieces are drawn again. `render` draws on this computer. Returns the exit code.
int RenderOnSlurm(const RenderArguments& arguments, const std::function<int(const RenderArguments&)>& render);

}  // namespace sqslam::app
