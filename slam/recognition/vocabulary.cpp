#include "slam/recognition/vocabulary.h"

#include <fmt/format.h>
#include <zlib.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "slam/util/atomic_file.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

static_assert(std::endian::native == std::endian::little, "written in the machine's byte order");

constexpr std::string_view kMagic = "SQSLAMVW";
constexpr std::uint32_t kVersion = 1;
constexpr const char* kExpected = "a vocabulary as written by 'sqslam vocabulary'";

struct Header {
  char magic[8] = {};
  std::uint32_t version = kVersion;
  std::uint32_t nodes = 0;
  std::uint32_t words = 0;
  std::uint32_t reserved = 0;
  std::uint64_t images = 0;
  std::uint64_t descriptors = 0;
};
static_assert(sizeof(Header) == 40);

std::uint32_t Checksum(std::string_view bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void Append(std::string& bytes, const auto* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(*values));
}

std::string Contents(const WordTree& tree, const std::vector<float>& idf) {
  std::string bytes;
  Append(bytes, tree.ChildCounts().data(), tree.Nodes());
  Append(bytes, tree.Centers().data() + 1, tree.Nodes() - 1);
  Append(bytes, idf.data(), idf.size());
  return bytes;
}

void Take(std::string_view& bytes, auto* values, std::size_t count) {
  std::memcpy(values, bytes.data(), count * sizeof(*values));
  bytes.remove_prefix(count * sizeof(*values));
}

[[noreturn]] void Refuse(const std::filesystem::path& path, const std::string& problem) {
  throw InputError("{}: {}, expected {}", path.string(), problem, kExpected);
}

// Checks magic, version, size and checksum of a file before its contents are parsed.
Header CheckedHeader(const std::filesystem::path& path, std::string_view bytes) {
  Header header;
  if (bytes.size() < sizeof(header) || !bytes.starts_with(kMagic)) {
    Refuse(path, "is not a vocabulary");
  }
  std::memcpy(&header, bytes.data(), sizeof(header));
  ThrowIf<InputError>(header.version != kVersion, "{}: a vocabulary of version {}, expected version {}",
                      path.string(), header.version, kVersion);
  const std::uint64_t size = sizeof(header) + std::uint64_t{header.nodes} * (1 + sizeof(DescriptorBits)) -
                             (header.nodes > 0 ? sizeof(DescriptorBits) : 0) +
                             std::uint64_t{header.words} * sizeof(float) + sizeof(std::uint32_t);
  if (bytes.size() != size) {
    Refuse(path, fmt::format("has {} bytes, but its header says {}", bytes.size(), size));
  }
  std::uint32_t checksum = 0;
  std::memcpy(&checksum, bytes.data() + bytes.size() - sizeof(checksum), sizeof(checksum));
  if (checksum != Checksum(bytes.substr(0, bytes.size() - sizeof(checksum)))) {
    Refuse(path, "is damaged (its checksum is wrong)");
  }
  return header;
}

// Returns the word of each descriptor, ascending.
std::vector<WordId> WordsOf(const WordTree& tree, const std::vector<Descriptor>& descriptors) {
  std::vector<WordId> words =
      ToVector(descriptors, [&](const Descriptor& descriptor) { return tree.WordOf(ToBits(descriptor)); });
  std::ranges::sort(words);
  return words;
}

}  // namespace

Vocabulary Vocabulary::Train(const std::vector<std::vector<Descriptor>>& images,
                             const VocabularyOptions& options, const TrainingProgress& progress) {
  std::vector<DescriptorBits> all;
  for (const std::vector<Descriptor>& image : images) {
    std::ranges::transform(image, std::back_inserter(all), ToBits);
  }
  ThrowIf<InputError>(all.empty(), "no features to learn words from, expected images with texture");
  Vocabulary vocabulary;
  vocabulary.trained_images_ = images.size();
  vocabulary.trained_descriptors_ = all.size();
  vocabulary.tree_ = WordTree::Train(std::move(all), options, progress);

  std::vector<std::uint32_t> images_with(vocabulary.Words(), 0);
  for (const std::vector<Descriptor>& image : images) {
    const std::vector<WordId> words = WordsOf(vocabulary.tree_, image);
    for (std::size_t i = 0; i < words.size(); ++i) {
      images_with[words[i]] += i == 0 || words[i] != words[i - 1] ? 1 : 0;
    }
  }
  for (const std::uint32_t count : images_with) {
    // A word that no training image reaches (its cluster's borders moved last) counts as seen once.
    const double seen = std::max(1.0, static_cast<double>(count));
    vocabulary.idf_.push_back(static_cast<float>(std::log(static_cast<double>(images.size()) / seen)));
  }
  return vocabulary;
}

BagOfWords Vocabulary::Transform(const std::vector<Descriptor>& descriptors) const {
  const std::vector<WordId> words = WordsOf(tree_, descriptors);
  BagOfWords bag;
  double total = 0.0;
  for (auto word = words.begin(); word != words.end();) {
    const auto next = std::upper_bound(word, words.end(), *word);
    const float weight = static_cast<float>(next - word) * idf_[*word];
    if (weight > 0.0F) {  // a word in every training image carries no information
      bag.words.push_back({*word, weight});
      total += static_cast<double>(weight);
    }
    word = next;
  }
  for (WordWeight& entry : bag.words) {
    entry.weight = static_cast<float>(static_cast<double>(entry.weight) / total);
  }
  return bag;
}

std::string Vocabulary::Fingerprint() const { return fmt::format("{:08x}", Checksum(Contents(tree_, idf_))); }

bool Vocabulary::IsVocabularyFile(const std::filesystem::path& path) {
  std::string start(kMagic.size(), '\0');
  std::ifstream file(path, std::ios::binary);
  return file.read(start.data(), static_cast<std::streamsize>(start.size())) && start == kMagic;
}

void Vocabulary::Save(const std::filesystem::path& path) const {
  Header header;
  std::memcpy(header.magic, kMagic.data(), kMagic.size());
  header.nodes = static_cast<std::uint32_t>(Nodes());
  header.words = static_cast<std::uint32_t>(Words());
  header.images = trained_images_;
  header.descriptors = trained_descriptors_;
  std::string bytes;
  Append(bytes, &header, 1);
  bytes += Contents(tree_, idf_);
  const std::uint32_t checksum = Checksum(bytes);
  Append(bytes, &checksum, 1);
  WriteFileAtomically(path, bytes);
}

Vocabulary Vocabulary::Load(const std::filesystem::path& path) {
  const std::string file = ReadFile(path, kExpected);
  const Header header = CheckedHeader(path, file);
  if (header.nodes == 0) {
    Refuse(path, "has no nodes");
  }
  std::string_view bytes = std::string_view(file).substr(sizeof(Header));
  std::vector<std::uint8_t> child_counts(header.nodes);
  std::vector<DescriptorBits> centers(header.nodes);
  Take(bytes, child_counts.data(), child_counts.size());
  Take(bytes, centers.data() + 1, centers.size() - 1);
  Vocabulary vocabulary;
  try {
    vocabulary.tree_ = WordTree(std::move(child_counts), std::move(centers));
  } catch (const std::invalid_argument& e) {
    Refuse(path, fmt::format("is damaged ({})", e.what()));
  }
  if (vocabulary.Words() != header.words) {
    Refuse(path, fmt::format("is damaged ({} leaves for {} words)", vocabulary.Words(), header.words));
  }
  vocabulary.idf_.resize(header.words);
  Take(bytes, vocabulary.idf_.data(), vocabulary.idf_.size());
  for (const float weight : vocabulary.idf_) {
    if (!std::isfinite(weight) || weight < 0.0F) {
      Refuse(path, "is damaged (a weight that is negative or not finite)");
    }
  }
  vocabulary.trained_images_ = header.images;
  vocabulary.trained_descriptors_ = header.descriptors;
  return vocabulary;
}

}  // namespace sqslam
