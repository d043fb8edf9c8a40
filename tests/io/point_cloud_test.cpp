#include "slam/io/point_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <typename T>
std::string Bytes(T value, bool big_endian = false) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big_endian) {
    std::reverse(bytes.begin(), bytes.end());
  }
  return bytes;
}

class PointCloudFile : public ::testing::Test {
 protected:
  std::vector<Vector3d> Read(const std::string& text) {
    return ReadPointCloud(folder_.Write("cloud.ply", text)).points;
  }
  std::string ErrorOf(const std::string& text) {
    const auto path = folder_.Write("cloud.ply", text);
    return InputErrorOf([&] { ReadPointCloud(path); });
  }
  TemporaryFolder folder_;
};

TEST_F(PointCloudFile, ReadsAsciiPropertiesInAnyOrder) {
  EXPECT_THAT(
      Read("ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement vertex 2\r\nproperty uchar red\r\n"
           "property double z\r\nproperty float x\r\nproperty int y\r\nend_header\r\n"
           "255 3.5 1.25 2\r\n\r\n0 -6e-1 +4 5\r\n"),
      ElementsAre(Vector3d(1.25, 2, 3.5), Vector3d(4, 5, -0.6)));
}

TEST_F(PointCloudFile, ReadsBinaryOfEitherByteOrderAfterLists) {
  for (const bool big : {false, true}) {
    const std::string header = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                               "_endian 1.0\nelement face 2\nproperty list uchar int vertex_indices\n"
                               "element vertex 2\nproperty double x\nproperty short y\nproperty uchar gray\n"
                               "property float z\nend_header\n";
    const std::string faces = Bytes<std::uint8_t>(2) + Bytes(7, big) + Bytes(8, big) + Bytes<std::uint8_t>(0);
    const std::string points = Bytes(0.1, big) + Bytes<std::int16_t>(-300, big) + "g" + Bytes(2.5F, big) +
                               Bytes(1e9, big) + Bytes<std::int16_t>(7, big) + "g" + Bytes(-0.5F, big);
    EXPECT_THAT(Read(header + faces + points), ElementsAre(Vector3d(0.1, -300, 2.5), Vector3d(1e9, 7, -0.5)));
    EXPECT_THAT(ErrorOf((header + faces + points).substr(0, header.size() + faces.size() + 20)),
                AllOf(HasSubstr("cloud.ply: ends at byte"), HasSubstr("vertex 1, expected 2")));
  }
}

TEST_F(PointCloudFile, ReadsColoursOfAnyType) {
  const auto read = [this](const std::string& text) {
    return ReadPointCloud(folder_.Write("cloud.ply", text)).rgb;
  };
  const std::string start =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
  using Rgb = std::array<std::uint8_t, 3>;
  EXPECT_THAT(read(start + "property uchar blue\nproperty uchar green\nproperty uchar red\nend_header\n"
                           "1 2 3 7 8 9\nnan 2 3 1 1 1\n"),
              ElementsAre(Rgb{9, 8, 7}))
      << "a hole has no colour either";
  EXPECT_THAT(read(start + "property float r\nproperty float g\nproperty float b\nend_header\n"
                           "1 2 3 0 1 0.5\n1 2 3 2 -1 nan\n"),
              ElementsAre(Rgb{0, 255, 128}, Rgb{255, 0, 0}));
  EXPECT_THAT(read(start + "property float red\nproperty float green\nproperty float blue\nend_header\n"
                           "1 2 3 0 128 255\n1 2 3 1 0.5 51\n"),
              ElementsAre(Rgb{0, 128, 255}, Rgb{1, 1, 51}))
      << "bytes as real numbers";
  EXPECT_THAT(read(start + "property uchar red\nend_header\n1 2 3 7\n1 2 3 7\n"), ::testing::IsEmpty());
}

TEST_F(PointCloudFile, ReadsNormalsAsUnitVectors) {
  const PointCloud cloud = ReadPointCloud(folder_.Write(
      "cloud.ply",
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float nx\nproperty float x\nproperty float y\n"
      "property float z\nproperty float ny\nproperty float nz\nend_header\n0 1 2 3 0 5\n-1 4 5 6 0 0\n"));
  EXPECT_EQ(cloud.points[1], Vector3d(4.0, 5.0, 6.0));
  ASSERT_EQ(cloud.normals.size(), 2U);
  EXPECT_EQ(cloud.normals[0], Vector3d(0.0, 0.0, 1.0));
  EXPECT_EQ(cloud.normals[1], Vector3d(-1.0, 0.0, 0.0));
}

TEST_F(PointCloudFile, ReadsTextWithCommentsNamesAndCommas) {
  EXPECT_THAT(Read("x,y,z,intensity\n1,2,3,0.5\n# the rest\n 4\t5 6\n7;8;9\n"),
              ElementsAre(Vector3d(1, 2, 3), Vector3d(4, 5, 6), Vector3d(7, 8, 9)));
}

TEST_F(PointCloudFile, SkipsAndCountsHoles) {
  const PointCloud cloud = ReadPointCloud(folder_.Write("a.xyz", "1 2 3\nnan nan nan\n4 inf 6\n7 8 1e300\n"));
  EXPECT_THAT(cloud.points, ElementsAre(Vector3d(1, 2, 3)));
  EXPECT_EQ(cloud.skipped, 3);
}

TEST_F(PointCloudFile, ReportsLineAndExpectation) {
  const std::string vertex = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\n" + vertex), HasSubstr("expected end_header"));
  EXPECT_THAT(ErrorOf("ply\nformat text 1.0\n"), AllOf(HasSubstr(":2: "), HasSubstr("binary_little_endian")));
  EXPECT_THAT(ErrorOf("ply\n" + vertex + "end_header\n"), HasSubstr("format ascii|binary"));
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\nelement vertex many\n"), HasSubstr(":3: "));
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n"),
              AllOf(HasSubstr(":4: "), HasSubstr("TYPE one of char")));
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
              HasSubstr("properties x, y and z"));
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\n" + vertex + "end_header\n1 two 3\n"),
              AllOf(HasSubstr(":8: '1 two 3'"), HasSubstr("a number for each property")));
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\n" + vertex + "end_header\n1 2\n"), HasSubstr(":8: "));
  EXPECT_THAT(ErrorOf("ply\nformat ascii 1.0\n" + vertex + "end_header\n"),
              HasSubstr("ends before vertex 0, expected 1"));
  EXPECT_THAT(ErrorOf("1 2 3\n4 5\n"), AllOf(HasSubstr(":2: '4 5'"), HasSubstr("expected x y z")));
  EXPECT_THAT(InputErrorOf([] { ReadPointCloud("/nonexistent.ply"); }), HasSubstr("/nonexistent.ply"));
}

}  // namespace
}  // namespace sqslam
