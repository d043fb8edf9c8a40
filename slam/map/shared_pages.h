#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace sqslam {

// Values by index. A copy shares the pages that neither side has changed since, so that it costs a pointer a
// page. A page that holds nothing but `fill` takes no memory. Copies may be used on different threads, each
// on one at a time.
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
    return page ? page->values[index % kPage] : fill;
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
      page->values.fill(fill);
    } else if (page->shared.load(std::memory_order_relaxed)) {
      page = std::make_shared<Page>(*page);
    }
    Value& present = page->values[index % kPage];
    page->used += (value == fill ? 0 : 1) - (present == fill ? 0 : 1);
    present = value;
    if (page->used == 0) {
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
  struct Page {
    Page() = default;
    Page(const Page& other) : values(other.values), used(other.used) {}

    std::array<Value, kPage> values;
    int used = 0;                      // values that are not `fill`
    std::atomic<bool> shared = false;  // by another copy, now or earlier: no longer written
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
