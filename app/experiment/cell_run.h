#pragma once

#include <string>

#include "app/experiment/runner.h"
#include "app/terminal/terminal.h"

namespace sqslam::app {

// The steps of one cell, shared by local runs and cluster tasks. Results are written under a temporary name
// and then renamed; locks keep programs that share the folder from doing the same work.

// Renders the scene of the cell's sequence unless it is there; waits if another program is rendering it.
// Throws InputError.
void RenderSequence(const ExperimentPlan& plan, const ExperimentCell& cell, const StopRequest& stop,
                    const LinePrinter& print);

// Writes the boxes of a cell with limited max_objects. Throws InputError.
void WriteLimitedBoxes(const ExperimentPlan& plan, const ExperimentCell& cell);

// Runs and scores the cell, and marks it as finished. `program` is ProgramFingerprint(). Throws InputError if
// the folder cannot be written or another program is running the cell.
ChildResult RunCell(const ExperimentPlan& plan, const PlannedCell& planned, const std::string& program,
                    const StopRequest& stop);

// "12 of 13 objects found, their mean IoU 0.712"
std::string Headline(const CellResult& result);

// "[3/8] NAME: WHAT (2.1 s); 9.4 runs/min, 0:32 left", after `elapsed` seconds.
std::string ProgressLine(std::size_t done, std::size_t total, double elapsed, const std::string& name,
                         const std::string& what, double seconds);

}  // namespace sqslam::app
