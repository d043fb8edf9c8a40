#include <filesystem>
#include <memory>
#include <string>

#include "app/commands/commands.h"
#include "app/report/report.h"
#include "app/result/map_input.h"

namespace sqslam::app {
namespace {

constexpr const char* kReportNotes = R"(
Writes the page of a finished run again, with edited objects or a choice of them. The pictures, figures and the video
of the run show all of its objects and are left out of a page with edits or a choice; the interactive map shows those
on the page.

Examples:
  sqslam report out/kitchen --edits auto                names and labels as edited in the viewer
  sqslam report out/kitchen --reliable-only -o certain.html
  sqslam report out/kitchen --objects cup,chair -o seats.html
)";

struct ReportArguments {
  std::string result;
  ObjectArguments objects;
  std::string output;
  bool quiet = false;
};

void Report(const ReportArguments& a) {
  ReportInputs inputs{.result = a.result, .output = a.output};
  if (a.objects.Changes()) {
    inputs.changed = std::make_shared<const RecordingReader>(
        OpenMap(MapFile(inputs.result), a.objects, HiddenObjects::kLeaveOut));
    inputs.render_options = OptionsOf(MapFile(inputs.result), a.objects);
  }
  PrintSummary(a.quiet, "written: {}\n", WriteReport(inputs).string());
}

}  // namespace

void AddReportCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("report", "Write the page of a finished run again", kReportNotes, Report);
  command.Group("Input");
  command.Positional("RESULT", a.result, "Result folder of sqslam run").Required();
  AddObjectOptions(command, a.objects);
  command.Group("Output");
  command.Option("--output,-o FILE", a.output, "Page to write; default: report.html in the result folder");
  command.QuietFlag(a.quiet, "Print nothing");
}

}  // namespace sqslam::app
