#include "app/viewer/model/folder_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/io/temporary_folder.h"

namespace sqslam::viewer {
namespace {

using ::testing::ElementsAre;

TEST(FolderList, ListsResultsThenFoldersThenFiles) {
  const TemporaryFolder folder;
  for (const char* file : {"b/map.sqmap", "a/notes.txt", "z/map.sqmap", "room.ply", "old.sqmap", "film.mp4",
                           ".hidden/map.sqmap"}) {
    folder.Write(file, "x");
  }
  std::vector<std::string> names;
  std::vector<FolderEntry::Kind> kinds;
  for (const FolderEntry& entry : ListFolder(folder.Path())) {
    names.push_back(entry.name);
    kinds.push_back(entry.kind);
  }
  using enum FolderEntry::Kind;
  EXPECT_THAT(names, ElementsAre("b", "z", "a", "old.sqmap", "room.ply"));
  EXPECT_THAT(kinds, ElementsAre(kResult, kResult, kFolder, kFile, kFile));
  EXPECT_TRUE(ListFolder(folder.Path() / "missing").empty());
}

}  // namespace
}  // namespace sqslam::viewer
