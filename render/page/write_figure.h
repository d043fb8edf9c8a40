#pragma once

#include <filesystem>
#include <string>

#include "render/page/page.h"

namespace sqslam {

// Throws UsageError unless the name ends in .png, .svg or .pdf: to be asked before any work is done.
void CheckFigurePath(const std::filesystem::path& path);

// The page in the format of the extension: a PNG that carries its density (dots per inch), or SVG and PDF
// with lines and texts as such. The same page gives the same bytes. Throws UsageError for another extension
// and sizes without sense, InputError where the file cannot be written.
std::string EncodeFigure(const FigurePage& page, const std::filesystem::path& path);
void WriteFigure(const FigurePage& page, const std::filesystem::path& path);

}  // namespace sqslam
