#include "slam/map/shared_pages.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace sqslam {
namespace {

constexpr int kMany = 10000;

using Pages = SharedPages<int, -1>;

Pages Counting() {
  std::vector<int> values(kMany);
  std::iota(values.begin(), values.end(), 0);
  return Pages(values);
}

TEST(SharedPages, HoldsWhatWasSetAndElseTheFill) {
  Pages pages;
  pages.Grow(3);
  pages.Set(1, 7);
  EXPECT_EQ(pages.All(), (std::vector<int>{-1, 7, -1}));
  pages.Grow(2);
  EXPECT_EQ(pages.size(), 3U) << "it never shrinks";
}

TEST(SharedPages, ACopyAndItsOriginalDoNotSeeEachOthersChanges) {
  Pages original = Counting();
  Pages copy = original;
  original.Set(5, 50);
  original.Set(kMany - 1, -1);
  copy.Set(6, 60);
  original.Set(6, 61);
  EXPECT_EQ(copy[5], 5);
  EXPECT_EQ(copy[kMany - 1], kMany - 1);
  EXPECT_EQ(copy[6], 60);
  EXPECT_EQ(original[5], 50);
  EXPECT_EQ(original[6], 61);
  EXPECT_EQ(original[7], 7);
  const Pages moved = std::move(original);
  EXPECT_EQ(moved[5], 50);
  EXPECT_EQ(original.size(), 0U);
}

TEST(SharedPages, AChangeCopiesOnlyTheValuesAroundIt) {
  Pages original = Counting();
  const Pages copy = original;
  original.Set(5, 50);
  EXPECT_EQ(original.NumPagesSharedWith(copy), original.NumPages() - 1);
}

TEST(SharedPages, WhatHoldsNothingTakesNoMemory) {
  Pages pages = Counting();
  for (int i = 0; i < kMany - 1; ++i) {
    pages.Set(static_cast<std::size_t>(i), -1);
  }
  EXPECT_EQ(pages.NumPages(), 1);
  EXPECT_EQ(pages[kMany - 1], kMany - 1);
}

// Compares with a plain vector under changes here and there.
TEST(SharedPages, KeepsEachValueAtItsPlaceHoweverFewThereAre) {
  std::mt19937 random(1);
  Pages pages;
  pages.Grow(kMany);
  std::vector<int> plain(kMany, -1);
  Pages copy;
  for (int step = 0; step < 20000; ++step) {
    const std::size_t at = random() % kMany;
    const int value = random() % 3 == 0 ? -1 : step;
    pages.Set(at, value);
    plain[at] = value;
    if (step % 1000 == 0) {
      copy = pages;
    }
  }
  EXPECT_EQ(pages.All(), plain);
}

}  // namespace
}  // namespace sqslam
