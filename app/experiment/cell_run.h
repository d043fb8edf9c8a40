#pragma once

#include <string>

#include "app/experiment/runner.h"
#include "app/terminal/terminal.h"

namespace sqslam::app {

// The steps of one cell, the same at home and in a task of a cluster. Each result is made under a temporary
// name and renamed; locks keep programs that share the folder from doing the same work.

// Renders the scene of the cell's sequence unless that is done; waits while another program is at it. Throws
// InputError.
void RenderSequence(const ExperimentPlan& plan, const ExperimentCell& cell, const StopRequest& stop,
                    const LinePrinter& print);

// Writes the boxes of a cell that is limited to some objects. Throws InputError.
void WriteLimitedBoxes(const ExperimentPlan& plan, const ExperimentCell& cell);

// Runs and scores the cell, and marks it as finished. `program` is ProgramFingerprint(). Throws InputError
// where the folder cannot be written or another program makes the same cell.
ChildResult RunCell(const ExperimentPlan& plan, const PlannedCell& planned, const std::string& program,
                    const StopRequest& stop);

// "12 of 13 objects found, their mean IoU 0.712"
std::string Headline(const CellResult& result);

// "[3/8] NAME: WHAT (2.1 s); 9.4 runs/min, 0:32 left", after `elapsed` seconds.
std::string ProgressLine(std::size_t done, std::size_t total, double elapsed, const std::string& name,
                         const std::string& what, double seconds);

}  // namespace sqslam::app
