#include "app/viewer/model/viewer_document.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "app/viewer/model/annotation_file.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

// What somebody made and nobody has read is not lost: it lies beside, as FILE.bak.
void KeepUnread(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::exists(file)) {
    std::filesystem::copy_file(file, file.string() + ".bak",
                               std::filesystem::copy_options::overwrite_existing, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be copied to {}.bak ({}), expected a writable folder",
                                   file.string(), file.filename().string(), error.message()));
    }
  }
}

}  // namespace

void ViewerDocument::OpenRecording(const std::filesystem::path& recording) {
  *this = ViewerDocument();
  edits_file_ = EditsFileOf(recording);
  if (std::filesystem::exists(edits_file_)) {
    edits_unread_ = true;
    saved_.edits = ReadObjectEdits(edits_file_);
    edits_unread_ = false;
    history_ = EditHistory<DocumentState>(saved_);
  }
}

void ViewerDocument::OpenAnnotation(const std::filesystem::path& file, const Sim3d& S_file_annotation) {
  Annotation read = ReadAnnotation(file, S_file_annotation);
  annotation_file_ = file;
  saved_.annotation = read;
  Do("Open " + file.filename().string(), [&](DocumentState& state) { state.annotation = std::move(read); });
}

void ViewerDocument::SaveEdits() {
  if (std::exchange(edits_unread_, false)) {
    KeepUnread(edits_file_);
  }
  if (Current().edits.Empty()) {
    std::error_code error;
    std::filesystem::remove(edits_file_, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be removed ({}), expected a writable folder",
                                   edits_file_.string(), error.message()));
    }
  } else {
    WriteObjectEdits(edits_file_, Current().edits);
  }
  saved_.edits = Current().edits;
}

void ViewerDocument::SaveAnnotation(const std::filesystem::path& file, const Sim3d& S_file_annotation) {
  if (file != annotation_file_) {
    KeepUnread(file);
  }
  WriteAnnotation(file, Current().annotation, S_file_annotation);
  annotation_file_ = file;
  saved_.annotation = Current().annotation;
}

}  // namespace sqslam::viewer
