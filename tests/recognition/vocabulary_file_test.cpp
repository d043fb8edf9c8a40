#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <limits>

#include "slam/recognition/vocabulary.h"
#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"
#include "tests/recognition/random_descriptors.h"

namespace sqslam::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::size_t kHeader = 40;  // bytes before the children of each node

class VocabularyFile : public ::testing::Test {
 protected:
  VocabularyFile() {
    vocabulary_.Save(path_);
    bytes_ = ReadFile(path_, "");
  }

  // The error of Load for the bytes, after their checksum has been put right or not.
  std::string ErrorOf(std::string bytes, bool with_checksum) const {
    if (with_checksum) {
      const auto sum = static_cast<std::uint32_t>(
          ::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size() - 4));
      std::memcpy(bytes.data() + bytes.size() - 4, &sum, 4);
    }
    const auto path = folder_.Write("changed.bin", bytes);
    const std::string message = InputErrorOf([&] { Vocabulary::Load(path); });
    EXPECT_THAT(message, AllOf(HasSubstr("changed.bin: "), HasSubstr("expected ")));
    return message;
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.Path() / "words.bin";
  std::vector<std::vector<Descriptor>> images_ = ClusteredImages(12, 80, 40, 2);
  Vocabulary vocabulary_ = Vocabulary::Train(images_, {.branching = 5, .depth = 3});
  std::string bytes_;
};

TEST_F(VocabularyFile, ReadsBackBitForBit) {
  const Vocabulary loaded = Vocabulary::Load(path_);
  EXPECT_EQ(loaded.Words(), vocabulary_.Words());
  EXPECT_EQ(loaded.Nodes(), vocabulary_.Nodes());
  EXPECT_EQ(loaded.Depth(), 3);
  EXPECT_EQ(loaded.TrainedImages(), 12u);
  EXPECT_EQ(loaded.TrainedDescriptors(), 12u * 80u);
  for (const auto& image : images_) {
    EXPECT_EQ(loaded.Transform(image), vocabulary_.Transform(image));
  }
  loaded.Save(folder_.Path() / "again.bin");
  EXPECT_EQ(ReadFile(folder_.Path() / "again.bin", ""), bytes_);
}

TEST_F(VocabularyFile, RepeatsTrainingForSeed) {
  const auto bytes_for_seed = [&](std::uint64_t seed) {
    Vocabulary::Train(images_, {.branching = 5, .depth = 3, .seed = seed}).Save(folder_.Path() / "other.bin");
    return ReadFile(folder_.Path() / "other.bin", "");
  };
  EXPECT_EQ(bytes_for_seed(1), bytes_);
  EXPECT_NE(bytes_for_seed(2), bytes_);
}

TEST_F(VocabularyFile, RecognisesFilesByFirstBytes) {
  EXPECT_TRUE(Vocabulary::IsVocabularyFile(path_));
  EXPECT_FALSE(Vocabulary::IsVocabularyFile(folder_.Write("short", "SQS")));
  EXPECT_FALSE(Vocabulary::IsVocabularyFile(folder_.Write("other", "SQLite format 3")));
  EXPECT_FALSE(Vocabulary::IsVocabularyFile(folder_.Path() / "nothing"));
}

TEST_F(VocabularyFile, RefusesOtherFiles) {
  EXPECT_THAT(InputErrorOf([&] { Vocabulary::Load(folder_.Path() / "nothing.bin"); }),
              HasSubstr("nothing.bin: cannot be read"));
  EXPECT_THAT(ErrorOf("", false), HasSubstr("is not a vocabulary"));
  std::string other = bytes_;
  other[0] = 'X';
  EXPECT_THAT(ErrorOf(other, false), HasSubstr("is not a vocabulary"));
}

TEST_F(VocabularyFile, RefusesOtherVersion) {
  std::string other = bytes_;
  other[8] = 7;
  EXPECT_THAT(ErrorOf(other, true), AllOf(HasSubstr("version 7"), HasSubstr("expected version 1")));
}

TEST_F(VocabularyFile, RefusesTruncatedFiles) {
  for (std::size_t size = 0; size < bytes_.size(); size += size < 2 * kHeader ? 1 : 997) {
    EXPECT_NE(ErrorOf(bytes_.substr(0, size), false), "(no InputError)") << size;
  }
  EXPECT_THAT(ErrorOf(bytes_ + "x", false), HasSubstr("bytes, but its header says"));
}

TEST_F(VocabularyFile, RefusesFlippedBit) {
  for (std::size_t at = kHeader; at < bytes_.size(); at += 501) {
    std::string other = bytes_;
    other[at] = static_cast<char>(other[at] ^ 4);
    EXPECT_THAT(ErrorOf(other, false), HasSubstr("is damaged")) << at;
  }
}

TEST_F(VocabularyFile, RefusesInvalidTreeWithValidChecksum) {
  std::string beyond = bytes_;
  beyond[kHeader] = static_cast<char>(200);
  EXPECT_THAT(ErrorOf(beyond, true), HasSubstr("children beyond the last node"));
  std::string orphan = bytes_;
  orphan[kHeader] = 0;
  EXPECT_THAT(ErrorOf(orphan, true), HasSubstr("has no parent"));
  std::string fewer_leaves = bytes_;  // as its header has it
  fewer_leaves[16] = static_cast<char>(fewer_leaves[16] - 33);
  fewer_leaves.resize(bytes_.size() - 33 * sizeof(float));
  EXPECT_THAT(ErrorOf(fewer_leaves, true), HasSubstr("leaves for"));
}

TEST_F(VocabularyFile, RefusesNonFiniteWeights) {
  for (const float weight : {-1.0F, std::numeric_limits<float>::quiet_NaN()}) {
    std::string other = bytes_;
    std::memcpy(other.data() + other.size() - 8, &weight, 4);
    EXPECT_THAT(ErrorOf(other, true), HasSubstr("a weight that is negative or not finite"));
  }
}

TEST_F(VocabularyFile, RefusesEmptyTree) {
  std::string empty = bytes_.substr(0, kHeader) + "sum_";
  std::memset(empty.data() + 12, 0, 8);
  EXPECT_THAT(ErrorOf(empty, true), HasSubstr("has no nodes"));
}

}  // namespace
}  // namespace sqslam::testing
