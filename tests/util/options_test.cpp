#include "slam/util/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>

#include "slam/util/error.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

struct InnerOptions {
  int features = 1000;
  double ratio = 0.75;
  bool enabled = true;
  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("features", features, 1, 20000);
    visit("ratio", ratio, 0.0, 1.0);
    visit("enabled", enabled);
  }
};

enum class Kind { kFull, kIou };
constexpr auto EnumNames(Kind) { return std::array{"full", "iou"}; }

struct OuterOptions {
  std::uint64_t seed = 7;
  std::string gravity = "auto";
  Kind kind = Kind::kFull;
  std::vector<std::string> ignored = {"dining table"};
  std::array<double, 3> up = {0.0, 0.0, 1.0};
  InnerOptions tracking;
  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("seed", seed);
    visit("gravity", gravity);
    visit("kind", kind);
    visit("ignored", ignored);
    visit("up", up, -1.0, 1.0);
    visit("tracking", tracking);
  }
};

std::string MessageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const UsageError& e) {
    return e.what();
  }
  return "(no UsageError)";
}

TEST(Options, YamlKeepsUnnamedOptions) {
  OuterOptions options;
  ParseOptions("# comment\ntracking:\n  features: 500\nkind: iou\n", "a.yaml", options);
  EXPECT_EQ(options.tracking.features, 500);
  EXPECT_EQ(options.kind, Kind::kIou);
  EXPECT_EQ(options.tracking.ratio, 0.75);
  EXPECT_EQ(options.seed, 7u);
}

TEST(Options, ReportsUnknownKeyWithLineAndNearestName) {
  OuterOptions options;
  EXPECT_EQ(MessageOf([&] { ParseOptions("seed: 1\ntracking:\n  faetures: 3\n", "a.yaml", options); }),
            "a.yaml:3: unknown option 'tracking.faetures'; did you mean 'tracking.features'?");
}

TEST(Options, CompletesNameWithoutGroup) {
  OuterOptions options;
  EXPECT_THAT(MessageOf([&] { SetOption("features=3", options); }),
              HasSubstr("did you mean 'tracking.features'?"));
}

TEST(Options, ReportsValueOutOfRange) {
  OuterOptions options;
  EXPECT_EQ(MessageOf([&] { ParseOptions("\ntracking: {ratio: 1.5}\n", "a.yaml", options); }),
            "a.yaml:2: tracking.ratio is '1.5', expected a number from 0 to 1");
}

TEST(Options, RefusesValuesOfWrongKind) {
  OuterOptions options;
  EXPECT_THAT(MessageOf([&] { SetOption("tracking.features=12.5", options); }), HasSubstr("a whole number"));
  EXPECT_THAT(MessageOf([&] { SetOption("tracking.ratio=.nan", options); }),
              HasSubstr("a number from 0 to 1"));
  EXPECT_THAT(MessageOf([&] { SetOption("tracking.ratio=nan", options); }),
              HasSubstr("a number from 0 to 1"));
  EXPECT_THAT(MessageOf([&] { SetOption("tracking.enabled=maybe", options); }), HasSubstr("true or false"));
  EXPECT_THAT(MessageOf([&] { SetOption("kind=iuo", options); }),
              HasSubstr("one of full, iou; did you mean 'iou'?"));
  EXPECT_THAT(MessageOf([&] { SetOption("up=[0, 1]", options); }), HasSubstr("3 values"));
  EXPECT_THAT(MessageOf([&] { SetOption("seed=-1", options); }), HasSubstr("without sign"));
  EXPECT_THAT(MessageOf([&] { SetOption("tracking=3", options); }), HasSubstr("group"));
  EXPECT_THAT(MessageOf([&] { SetOption("tracking.features", options); }), HasSubstr("key=value"));
  EXPECT_THAT(MessageOf([&] { ParseOptions("tracking: 3", "a.yaml", options); }), HasSubstr("group"));
}

TEST(Options, ReportsLineOfBrokenYaml) {
  OuterOptions options;
  EXPECT_THAT(MessageOf([&] { ParseOptions("seed: 1\nkind: [full\n", "a.yaml", options); }),
              HasSubstr("a.yaml:"));
  EXPECT_THAT(MessageOf([&] { ParseOptions("just words", "a.yaml", options); }), HasSubstr("name: value"));
}

TEST(Options, ReportsMissingFile) {
  OuterOptions options;
  EXPECT_THAT(MessageOf([&] { LoadOptions("/nonexistent/a.yaml", options); }),
              HasSubstr("/nonexistent/a.yaml"));
}

TEST(Options, KeepsListAsTextForStringOption) {
  OuterOptions options;
  ParseOptions("gravity: [0, 0.1, 1]", "a.yaml", options);
  EXPECT_EQ(options.gravity, "[0, 0.1, 1]");
}

TEST(Options, DumpReadsBackToTheSameValues) {
  OuterOptions options;
  options.tracking.ratio = 0.1 + 0.2;
  options.tracking.enabled = false;
  options.gravity = "[0, 0.1, 1]";
  options.ignored = {"dining table", "a: b"};
  options.up = {0.5, -0.25, 1.0 / 3.0};
  options.seed = 18446744073709551615u;
  OuterOptions read;
  ParseOptions(DumpOptions(options), "dump", read);
  EXPECT_EQ(read.tracking.ratio, options.tracking.ratio);
  EXPECT_EQ(read.tracking.enabled, options.tracking.enabled);
  EXPECT_EQ(read.gravity, options.gravity);
  EXPECT_EQ(read.ignored, options.ignored);
  EXPECT_EQ(read.up, options.up);
  EXPECT_EQ(read.seed, options.seed);
  EXPECT_EQ(DumpOptions(read), DumpOptions(options));
}

TEST(Options, DumpWritesEachGroupOnce) {
  EXPECT_EQ(DumpOptions(OuterOptions{}),
            "seed: 7\ngravity: auto\nkind: full\nignored: [dining table]\nup: [0, 0, 1]\n"
            "tracking:\n  features: 1000\n  ratio: 0.75\n  enabled: true\n");
}

TEST(Options, CheckRefusesValuesSetInCode) {
  OuterOptions options;
  EXPECT_NO_THROW(CheckOptions(options));
  options.tracking.ratio = std::nan("");
  EXPECT_THROW(CheckOptions(options), UsageError);
  options.tracking.ratio = std::numeric_limits<double>::infinity();
  EXPECT_THROW(CheckOptions(options), UsageError);
  options = {};
  options.kind = static_cast<Kind>(7);
  EXPECT_THROW(CheckOptions(options), UsageError);
}

TEST(EnumNames, ConvertsBothWays) {
  EXPECT_STREQ(NameOf(Kind::kIou), "iou");
  EXPECT_EQ(FromName<Kind>("iou"), Kind::kIou);
  EXPECT_EQ(FromName<Kind>("none"), std::nullopt);
  EXPECT_EQ(AllNames<Kind>(), (std::vector<std::string>{"full", "iou"}));
}

TEST(DidYouMean, SuggestsOnlyNearWords) {
  EXPECT_EQ(DidYouMean("kichen", {"kitchen", "desk"}), "; did you mean 'kitchen'?");
  EXPECT_EQ(DidYouMean("zzzzzz", {"kitchen", "desk"}), "");
}

TEST(DidYouMean, PrefersNamesThatContainTheWord) {
  EXPECT_EQ(DidYouMean("--size", {"--side", "--window-size"}), "; did you mean '--window-size'?");
  EXPECT_EQ(DidYouMean("zoom", {"--room", "--zoom-factor", "--camera-zoom"}),
            "; did you mean '--camera-zoom'?");
}

}  // namespace
}  // namespace sqslam
