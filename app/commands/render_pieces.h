#pragma once

#include <functional>

#include "app/commands/render_arguments.h"

namespace sqslam::app {

// Draws a video in pieces on a Slurm cluster, each piece a task, and joins them; with --task only the piece
// that it names, as a task does. Pieces that were not written whole are drawn again. `render` draws on this
// computer. Returns the exit code.
int RenderOnSlurm(const RenderArguments& arguments, const std::function<int(const RenderArguments&)>& render);

}  // namespace sqslam::app
