#include <fmt/format.h>

#include "app/report/report_parts.h"
#include "slam/util/markup.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace {

constexpr std::string_view kStyle = R"css(
:root { --ink: #1d2229; --soft: #66707c; --faint: #9aa3ad; --line: #dfe3e8; --paper: #ffffff; --wash: #f5f6f8;
        --accent: #1f6f8b; --good: #2c7a4b; --bad: #b3442e;
        --text: Charter, "Bitstream Charter", "Source Serif 4", Georgia, "DejaVu Serif", serif;
        --plain: "Inter", "Helvetica Neue", "Segoe UI", Arial, "DejaVu Sans", sans-serif; }
* { box-sizing: border-box; }
html { background: var(--paper); color: var(--ink); font: 16px/1.55 var(--text); -webkit-print-color-adjust: exact;
       print-color-adjust: exact; }
body { max-width: 1060px; margin: 0 auto; padding: 56px 32px 64px; }
header { border-bottom: 2px solid var(--ink); padding-bottom: 18px; margin-bottom: 28px; }
h1 { font-size: 38px; line-height: 1.15; font-weight: 600; letter-spacing: -0.01em; margin: 0 0 6px; }
h2 { font-size: 22px; font-weight: 600; margin: 52px 0 14px; }
p { margin: 0 0 12px; max-width: 68ch; }
.sub, figcaption, .note { color: var(--soft); font: 13.5px/1.5 var(--plain); }
.note { max-width: none; margin-bottom: 6px; }
.eyebrow { color: var(--accent); font: 600 12px/1 var(--plain); letter-spacing: 0.09em; text-transform: uppercase;
           margin-bottom: 12px; }
dl.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(205px, 1fr)); gap: 22px 30px; margin: 0 0 30px; }
dl.figures div { border-top: 1px solid var(--line); padding-top: 10px; }
dl.figures dt { color: var(--soft); font: 12.5px/1.3 var(--plain); }
dl.figures dd { margin: 3px 0 0; font-size: 27px; line-height: 1.2; font-variant-numeric: lining-nums tabular-nums; }
dl.figures dd small { font: 13px var(--plain); color: var(--soft); margin-left: 3px; }
dl.figures dd span { display: block; font: 12.5px/1.4 var(--plain); color: var(--soft); }
figure { margin: 0 0 26px; }
figure img, figure video { display: block; width: 100%; height: auto; border: 1px solid var(--line); border-radius: 3px; }
figcaption { margin-top: 8px; }
figure svg { display: block; width: 100%; height: auto; border: 1px solid var(--line); border-radius: 3px; }
.gallery { display: grid; grid-template-columns: repeat(auto-fit, minmax(290px, 1fr)); gap: 20px; }
.scroll { overflow-x: auto; }
table { width: 100%; border-collapse: collapse; font: 13.5px/1.35 var(--plain); font-variant-numeric: lining-nums tabular-nums; }
th { text-align: right; font-weight: 600; color: var(--soft); font-size: 12px; padding: 0 10px 8px;
     border-bottom: 1.5px solid var(--ink); vertical-align: bottom; white-space: nowrap; }
td { text-align: right; padding: 7px 10px; border-bottom: 1px solid var(--line); white-space: nowrap; }
th.l, td.l { text-align: left; }
th:first-child, td:first-child { padding-left: 0; }
th:last-child, td:last-child { padding-right: 0; }
td.bars { width: 110px; text-align: left; padding-left: 22px; }
tr.missed td { color: var(--faint); }
.after { margin-top: 16px; }
tr.stage1 td { font-weight: 600; }
td.stage { text-align: left; }
tr.sub td.stage { padding-left: 20px; color: var(--soft); }
.dot { display: inline-block; width: 10px; height: 10px; border-radius: 50%; margin-right: 9px; vertical-align: -0.5px; }
.bar { display: inline-block; width: 90px; height: 7px; background: var(--wash); border-radius: 4px; vertical-align: 1px; overflow: hidden; text-align: left; }
.bar i { display: block; height: 100%; background: var(--accent); border-radius: 4px; }
.muted { color: var(--faint); }
td svg { vertical-align: middle; }
footer { margin-top: 60px; padding-top: 14px; border-top: 1px solid var(--line); color: var(--soft); font: 12.5px/1.5 var(--plain); }
@media (max-width: 640px) { body { padding: 32px 18px; } h1 { font-size: 30px; } }
@media print {
  @page { margin: 16mm; }
  html { font-size: 13px; }
  body { padding: 0; max-width: none; }
  h2 { break-after: avoid; margin-top: 30px; }
  figure, tr, dl.figures div { break-inside: avoid; }
  .gallery { grid-template-columns: 1fr 1fr; }
  .scroll { overflow: visible; }
  table { font-size: 10.5px; }
  td, th { padding-left: 5px; padding-right: 5px; }
  video { display: none !important; }
}
)css";

}  // namespace

std::string DataUri(const std::filesystem::path& file, std::string_view mime_type) {
  return fmt::format("data:{};base64,{}", mime_type, Base64(ReadFile(file, "a picture or a video")));
}

std::string HtmlPage(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
      EscapeMarkup(title), kStyle, body);
}

}  // namespace sqslam::app
