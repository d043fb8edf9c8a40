#include "app/viewer/model/edited_document.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "app/viewer/model/annotation_file.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// Copies a file that somebody made and nobody has read to FILE.bak.
void KeepUnread(const fs::path& file) {
  std::error_code error;
  if (fs::exists(file)) {
    fs::copy_file(file, file.string() + ".bak", fs::copy_options::overwrite_existing, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be copied to {}.bak ({}), expected a writable folder",
                                   file.string(), file.filename().string(), error.message()));
    }
  }
}

}  // namespace

void EditedDocument::OpenRecording(const fs::path& recording) {
  *this = EditedDocument();
  edits_file_ = EditsFileOf(recording);
  if (fs::exists(edits_file_)) {
    edits_unread_ = true;
    saved_.edits = ReadObjectEdits(edits_file_);
    edits_unread_ = false;
    history_ = EditHistory<EditedState>(saved_);
  }
}

void EditedDocument::OpenAnnotation(const fs::path& file, const Sim3d& S_file_annotation) {
  Annotation read = ReadAnnotation(file, S_file_annotation);
  annotation_file_ = file;
  saved_.annotation = read;
  Do("Open " + file.filename().string(), [&](EditedState& state) { state.annotation = std::move(read); });
}

void EditedDocument::SaveEdits() {
  if (std::exchange(edits_unread_, false)) {
    KeepUnread(edits_file_);
  }
  if (Current().edits.Empty()) {
    std::error_code error;
    fs::remove(edits_file_, error);
    if (error) {
      throw InputError(fmt::format("{}: cannot be removed ({}), expected a writable folder",
                                   edits_file_.string(), error.message()));
    }
  } else {
    WriteObjectEdits(edits_file_, Current().edits);
  }
  saved_.edits = Current().edits;
}

void EditedDocument::SaveAnnotation(const fs::path& file, const Sim3d& S_file_annotation) {
  if (file != annotation_file_) {
    KeepUnread(file);
  }
  WriteAnnotation(file, Current().annotation, S_file_annotation);
  annotation_file_ = file;
  saved_.annotation = Current().annotation;
}

}  // namespace sqslam::viewer
