#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace sqslam {

// Values by index, most of them equal to `fill`, which takes next to no memory. A copy shares the pages that
// neither side has changed since, so that it costs a pointer a page. Copies may be used on different threads,
// each on one at a time.
template <typename Value, Value fill>
class SharedPages {
 public:
  SharedPages() = default;
  SharedPages(const SharedPages& other) : size_(other.size_), pages_(other.pages_) { MarkShared(); }
  SharedPages& operator=(const SharedPages& other) {
    size_ = other.size_;
    pages_ = other.pages_;
    MarkShared();
    return *this;
  }
  SharedPages(SharedPages&& other) noexcept { *this = std::move(other); }
  SharedPages& operator=(SharedPages&& other) noexcept {
    size_ = std::exchange(other.size_, 0);
    pages_ = std::exchange(other.pages_, {});
    return *this;
  }
  ~SharedPages() = default;
  explicit SharedPages(const std::vector<Value>& values) {
    Grow(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      Set(i, values[i]);
    }
  }

  std::size_t size() const { return size_; }
  Value operator[](std::size_t index) const {
    const std::shared_ptr<Page>& page = pages_[index / kPage];
    return page ? page->Get(index % kPage) : fill;
  }

  // Adds values equal to `fill` up to this size.
  void Grow(std::size_t size) {
    size_ = size > size_ ? size : size_;
    pages_.resize((size_ + kPage - 1) / kPage);
  }

  void Set(std::size_t index, Value value) {
    if (value == (*this)[index]) {
      return;
    }
    std::shared_ptr<Page>& page = pages_[index / kPage];
    if (!page) {
      page = std::make_shared<Page>();
    } else if (page->shared.load(std::memory_order_relaxed)) {
      page = std::make_shared<Page>(*page);
    }
    page->Set(index % kPage, value);
    if (page->values.empty()) {
      page.reset();
    }
  }

  std::vector<Value> All() const {
    std::vector<Value> all(size_, fill);
    for (std::size_t i = 0; i < size_; ++i) {
      all[i] = (*this)[i];
    }
    return all;
  }

  // Returns the number of pages in memory, shared or not.
  int NumPages() const { return NumPagesSharedWith(*this); }
  int NumPagesSharedWith(const SharedPages& other) const {
    int pages = 0;
    for (std::size_t i = 0; i < pages_.size() && i < other.pages_.size(); ++i) {
      pages += pages_[i] && pages_[i] == other.pages_[i] ? 1 : 0;
    }
    return pages;
  }

 private:
  static constexpr std::size_t kPage = 512;
  static constexpr std::size_t kWord = 64;
  struct Page {
    Page() = default;
    Page(const Page& other) : used(other.used), before(other.before), values(other.values) {}

    bool Has(std::size_t at) const { return (used[at / kWord] >> (at % kWord) & 1U) != 0; }
    std::size_t Place(std::size_t at) const {  // in `values`
      const std::uint64_t below = used[at / kWord] & ((std::uint64_t{1} << (at % kWord)) - 1);
      return before[at / kWord] + static_cast<std::size_t>(std::popcount(below));
    }
    Value Get(std::size_t at) const { return Has(at) ? values[Place(at)] : fill; }
    void Set(std::size_t at, Value value) {
      const auto place = values.begin() + static_cast<std::ptrdiff_t>(Place(at));
      const bool had = Has(at);
      if (had && value != fill) {
        *place = value;
        return;
      }
      if (had) {
        values.erase(place);
      } else {
        values.insert(place, value);
      }
      used[at / kWord] ^= std::uint64_t{1} << (at % kWord);
      for (std::size_t word = at / kWord + 1; word < before.size(); ++word) {
        before[word] = static_cast<std::uint16_t>(had ? before[word] - 1 : before[word] + 1);
      }
    }

    std::array<std::uint64_t, kPage / kWord> used{};    // a bit for each value that is not `fill`
    std::array<std::uint16_t, kPage / kWord> before{};  // number of such values before each word
    std::vector<Value> values;                          // those, in order
    std::atomic<bool> shared = false;                   // by another copy, now or earlier: no longer written
  };

  // Copying does not change the other side's values: it only keeps both from writing.
  void MarkShared() {
    for (const std::shared_ptr<Page>& page : pages_) {
      if (page) {
        page->shared.store(true, std::memory_order_relaxed);
      }
    }
  }

  std::size_t size_ = 0;
  std::vector<std::shared_ptr<Page>> pages_;
};

}  // namespace sqslam
