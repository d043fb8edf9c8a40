#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "slam/util/error.h"

namespace sqslam {

// Mark a database as a recording that this program reads, in its table `meta`.
inline constexpr const char* kRecordingFormat = "sqslam-map";
inline constexpr int kRecordingVersion = 11;

namespace sqlite {

struct CloseDatabase {
  void operator()(sqlite3* db) const { sqlite3_close_v2(db); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;

struct Blob {
  std::string_view bytes;
};

// A prepared statement. Failures throw InputError that names the file.
class Statement {
 public:
  // Binds the values in order. Texts and bytes must outlive the stepping of the statement.
  template <typename... Values>
  Statement(sqlite3* db, const std::filesystem::path& path, const char* sql, const Values&... values)
      : db_(db), path_(path) {
    Check(sqlite3_prepare_v2(db, sql, -1, &statement_, nullptr), SQLITE_OK);
    int index = 0;
    (Bind(++index, values), ...);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void Run() { Check(sqlite3_step(statement_), SQLITE_DONE); }
  bool Next() {
    const int code = sqlite3_step(statement_);
    if (code != SQLITE_ROW) {
      Check(code, SQLITE_DONE);
    }
    return code == SQLITE_ROW;
  }
  bool IsNull(int column) { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }
  std::int64_t Int(int column) { return sqlite3_column_int64(statement_, column); }
  double Real(int column) { return sqlite3_column_double(statement_, column); }
  std::string Bytes(int column) {
    const void* data = sqlite3_column_blob(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    return data == nullptr ? std::string()
                           : std::string(static_cast<const char*>(data), static_cast<std::size_t>(size));
  }

 private:
  void Bind(int index, std::int64_t value) { Check(sqlite3_bind_int64(statement_, index, value), SQLITE_OK); }
  void Bind(int index, const std::optional<std::int64_t>& value) {
    Check(value ? sqlite3_bind_int64(statement_, index, *value) : sqlite3_bind_null(statement_, index),
          SQLITE_OK);
  }
  void Bind(int index, double value) { Check(sqlite3_bind_double(statement_, index, value), SQLITE_OK); }
  void Bind(int index, std::string_view text) {
    Check(sqlite3_bind_text64(statement_, index, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8),
          SQLITE_OK);
  }
  void Bind(int index, const Blob& blob) {
    Check(sqlite3_bind_blob64(statement_, index, blob.bytes.data(), blob.bytes.size(), SQLITE_STATIC),
          SQLITE_OK);
  }
  void Check(int code, int expected) const {
    if (code != expected) {
      throw InputError("{}: {}", path_.string(), sqlite3_errmsg(db_));
    }
  }

  sqlite3* db_;  // not owned
  std::filesystem::path path_;
  sqlite3_stmt* statement_ = nullptr;
};

inline Database Open(const std::filesystem::path& path, int flags) {
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &raw, flags, nullptr);
  Database db(raw);
  if (code != SQLITE_OK) {
    throw InputError("{}: cannot be opened ({})", path.string(), sqlite3_errstr(code));
  }
  sqlite3_busy_timeout(db.get(), 5000);
  return db;
}

inline void Execute(sqlite3* db, const std::filesystem::path& path, const char* sql) {
  if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK) {
    throw InputError("{}: {}", path.string(), sqlite3_errmsg(db));
  }
}

// Throws InputError unless the database is a recording of the current version.
inline void CheckRecordingVersion(sqlite3* db, const std::filesystem::path& path) {
  std::string version;
  try {
    Statement select(db, path,
                     "SELECT v.value FROM meta AS v, meta AS f WHERE v.key = 'version' AND f.key = 'format' "
                     "AND f.value = ?",
                     kRecordingFormat);
    version = select.Next() ? select.Bytes(0) : "";
  } catch (const InputError&) {
    // No table `meta`: not a recording.
  }
  if (version.empty()) {
    throw InputError("{}: is not a recording of a map, expected a map.sqmap", path.string());
  }
  if (version != std::to_string(kRecordingVersion)) {
    throw InputError(
        "{}: has version {} of the recording format, but this program reads version {}: map the sequence "
        "again",
        path.string(), version, kRecordingVersion);
  }
}

// Opens an existing recording. A file from elsewhere must hold plain tables only: throws InputError for
// views, triggers, virtual tables and generated columns, whose queries might never end.
inline Database OpenRecording(const std::filesystem::path& path, int access) {
  if (!std::filesystem::is_regular_file(path)) {
    throw InputError("{}: does not exist or is not a file, expected a map.sqmap", path.string());
  }
  Database db = Open(path, access | SQLITE_OPEN_FULLMUTEX);
  sqlite3_db_config(db.get(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(db.get(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  bool computes = false;
  try {
    computes = Statement(db.get(), path,
                         "SELECT 1 FROM sqlite_master WHERE type IN ('view', 'trigger') OR sql LIKE "
                         "'%VIRTUAL%' OR sql LIKE '%GENERATED%' OR sql LIKE '% AS %'")
                   .Next();
  } catch (const InputError&) {
    if (sqlite3_extended_errcode(db.get()) == SQLITE_READONLY_ROLLBACK) {
      throw InputError(
          "{0}: a program was killed while it changed this file, and its folder is not writable to undo the "
          "change; copy it and {0}-journal to a writable folder",
          path.string());
    }
    if (sqlite3_errcode(db.get()) != SQLITE_NOTADB) {
      throw;
    }
  }
  if (computes) {
    throw InputError("{}: holds a view, a trigger or a computed column, expected a recording's tables",
                     path.string());
  }
  CheckRecordingVersion(db.get(), path);
  return db;
}

// Merges the write-ahead log beside a recording into it, so that it is one plain file that read-only media
// can hold. Does nothing while another connection is open, such as that of a program that draws the
// recording: the log then stays, and the next reader that finds it alone merges it.
inline void AbsorbLog(sqlite3* db, const std::filesystem::path& path) {
  const int code = sqlite3_exec(db, "PRAGMA journal_mode=DELETE", nullptr, nullptr, nullptr);
  if (code != SQLITE_OK && code != SQLITE_BUSY) {
    throw InputError("{}: {}", path.string(), sqlite3_errmsg(db));
  }
}

}  // namespace sqlite
}  // namespace sqslam
