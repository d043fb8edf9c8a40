#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "app/export/map_view.h"
#include "slam/snapshot/byte_archive.h"
#include "slam/util/data_path.h"
#include "slam/util/markup.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace {

namespace fs = std::filesystem;

// Files of three.js, in order of dependency.
constexpr std::array kLibraries = {"three.min.js", "examples/js/controls/OrbitControls.js",
                                   "examples/js/loaders/GLTFLoader.js"};

constexpr std::array kScripts = {"data.js",    "materials.js", "lines.js",   "scene.js", "outlines.js",
                                 "cameras.js", "motion.js",    "labels.js",  "photo.js", "timeline.js",
                                 "ask.js",     "panel.js",     "measure.js", "share.js", "main.js"};

constexpr const char* kLicence =
    "three.js, https://threejs.org, copyright 2010-2019 three.js authors, MIT licence: Permission is hereby "
    "granted, free of charge, to any person obtaining a copy of this software and associated documentation "
    "files (the \"Software\"), to deal in the Software without restriction, including without limitation the "
    "rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the "
    "Software, and to permit persons to whom the Software is furnished to do so, subject to the following "
    "conditions: The above copyright notice and this permission notice shall be included in all copies or "
    "substantial portions of the Software. THE SOFTWARE IS PROVIDED \"AS IS\", WITHOUT WARRANTY OF ANY KIND, "
    "EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A "
    "PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE "
    "FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING "
    "FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.";

// Compresses for the browser's DecompressionStream("deflate").
std::string Packed(const std::string& bytes) { return Base64(Deflate(bytes, 9)); }

std::string DataElement(const char* id, const std::string& text) {
  return fmt::format("<script type=\"text/plain\" id=\"{}\">{}</script>\n", id, text);
}

std::string ViewFile(const char* name) {
  return ReadFile(DataPath(fs::path("assets/view") / name), "a part of the view");
}

std::string Library() {
  const fs::path folder = SQSLAM_THREE_FOLDER;
  std::string text = fmt::format("<script>\n/* {} */\n", kLicence);
  for (const char* file : kLibraries) {
    ThrowIf<InputError>(
        !fs::exists(folder / file),
        "{}: does not exist, expected three.js for the 3D view (Debian's package libjs-three)",
        (folder / file).string());
    text += ReadFile(folder / file, "three.js");
    text += "\n;\n";
  }
  text += "</script>\n";
  return text;
}

}  // namespace

std::string MapViewElements(const MapView& view) {
  std::string images;
  for (const std::string& image : view.images) {
    images += Base64(image);
    images += '\n';
  }
  std::string page =
      fmt::format("<style>\n{}</style>\n{}{}{}{}{}<script>\n\"use strict\";\nconst sq = {{}};\n",
                  ViewFile("view.css"), ViewFile("view.html"), DataElement("sq-scene", Packed(view.scene)),
                  DataElement("sq-glb", Packed(view.glb)), DataElement("sq-images", images), Library());
  for (const char* script : kScripts) {
    page += ViewFile(script);
  }
  page += "</script>\n";
  return page;
}

std::string HtmlPage(const std::string& title, const std::string& body, const std::string& style,
                     const std::string& classes) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"{}>\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>\n{}{}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
      classes.empty() ? "" : fmt::format(" class=\"{}\"", classes), EscapeMarkup(title),
      ReadFile(DataPath("assets/theme.css"), "a style sheet"), style, body);
}

std::string MapViewPage(const RecordingReader& reader, const fs::path& recording,
                        const MapViewExtras& extras) {
  const fs::path sequence = reader.Info().sequence_path;
  const std::string title =
      AbsolutePath(sequence.empty() ? recording.parent_path() : sequence).filename().string();
  MapViewExtras titled = extras;
  titled.title = title;
  const MapView view = ReadMapView(reader, ReadHistory(reader), recording, titled);
  return HtmlPage(title,
                  fmt::format("<main>\n<h1 class=\"sq-unseen\">Object map of {}</h1>\n{}</main>\n",
                              EscapeMarkup(title), MapViewElements(view)),
                  "", "sq-alone");
}

}  // namespace sqslam::app
