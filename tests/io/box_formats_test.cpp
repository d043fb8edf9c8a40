#include "slam/io/box_formats.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <iterator>

#include "slam/io/detections.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::SizeIs;

const cv::Size kImage(200, 100);

class BoxFormats : public ::testing::Test {
 protected:
  std::vector<std::vector<Detection>> Read(const fs::path& path,
                                           const std::vector<std::string>& images = {}) const {
    return ReadDetections(path, {kImage}, {0.0, 0.1, 0.2}, images);
  }
  std::string ErrorOf(const fs::path& path, const std::vector<std::string>& images = {}) const {
    return InputErrorOf([&] { Read(path, images); });
  }
  static void ExpectBox(const std::vector<Detection>& frame, const std::string& label, double score,
                        const Box2d& box) {
    ASSERT_THAT(frame, SizeIs(1));
    EXPECT_EQ(frame[0].label, label);
    EXPECT_NEAR(frame[0].score, score, 1e-9);
    EXPECT_NEAR(frame[0].box.x, box.x, 1e-3);
    EXPECT_NEAR(frame[0].box.y, box.y, 1e-3);
    EXPECT_NEAR(frame[0].box.width, box.width, 1e-3);
    EXPECT_NEAR(frame[0].box.height, box.height, 1e-3);
  }

  TemporaryFolder folder_;
  const std::vector<std::string> images_{"000.png", "001.png", "002.png"};
};

TEST_F(BoxFormats, ReadsUltralyticsFolderOfVideo) {
  folder_.Write("labels/film_1.txt", "41 0.5 0.5 0.1 0.2 0.75\n");
  folder_.Write("labels/film_3.txt", "0 0.25 0.5 0.5 1.0 0.5\n");
  const auto frames = Read(folder_.Path() / "labels");
  ExpectBox(frames[0], "cup", 0.75, {90, 40, 20, 20});
  EXPECT_TRUE(frames[1].empty());
  ExpectBox(frames[2], "person", 0.5, {0, 0, 100, 100});
}

TEST_F(BoxFormats, ReadsLabellingToolsFolderOfImages) {
  folder_.Write("labels/classes.txt", "tea pot\nspoon\n");
  folder_.Write("labels/001.txt", "0 0.5 0.5 0.1 0.2\n");  // without a score
  ExpectBox(Read(folder_.Path() / "labels", images_)[1], "tea_pot", 1.0, {90, 40, 20, 20});
}

TEST_F(BoxFormats, ReadsPixelsByTime) {
  folder_.Write("boxes/0.1.txt", "41 10 20 30 40 0.5\n");
  ExpectBox(Read(folder_.Path() / "boxes")[1], "cup", 0.5, {10, 20, 30, 40});
}

// As Ultralytics writes tracks, and masks with save_txt.
TEST_F(BoxFormats, ReadsTrackIdsAndPolygonsOfUltralytics) {
  const auto read = [&](const std::string& line) {
    fs::remove_all(folder_.Path() / "labels");
    folder_.Write("labels/001.txt", line);
    return Read(folder_.Path() / "labels", images_)[1];
  };
  const Box2d box{90, 40, 20, 20};
  ExpectBox(read("41 0.5 0.5 0.1 0.2 7\n"), "cup", 1.0, box);
  ExpectBox(read("41 0.5 0.5 0.1 0.2 1\n"), "cup", 1.0, box);
  ExpectBox(read("41 0.5 0.5 0.1 0.2 0.75 7\n"), "cup", 0.75, box);
  ExpectBox(read("41 0.45 0.4 0.55 0.5 0.5 0.6\n"), "cup", 1.0, box);
  ExpectBox(read("41 0.45 0.4 0.55 0.5 0.5 0.6 0.75\n"), "cup", 0.75, box);
  ExpectBox(read("41 0.45 0.4 0.55 0.5 0.5 0.6 7\n"), "cup", 1.0, box);
  ExpectBox(read("41 0.45 0.4 0.55 0.4 0.55 0.6 0.45 0.6 0.75 7\n"), "cup", 0.75, box);
  ExpectBox(read("-1 0.5 0.5 0.1 0.2 0.75\n"), "unknown", 0.75, box);
  EXPECT_THAT(ErrorOf(folder_.Write("pixels/001.txt", "41 10 20 30 20 30 40\n").parent_path(), images_),
              HasSubstr("001.txt:1: "));
}

// Labels mark keypoints by 0, 1 and 2, results by a probability. The keypoints here span less than the box.
TEST_F(BoxFormats, ReadsBoxesOfPoses) {
  const auto read = [&](const std::string& end, const std::string& mark) {
    fs::remove_all(folder_.Path() / "labels");
    const std::string line =
        "0 0.5 0.5 0.1 0.2 0.47 0.45 " + mark + " 0.53 0.45 " + mark + " 0.5 0.55 " + mark;
    folder_.Write("labels/000.txt", line + " 0 0 0" + end + "\n");
    folder_.Write("labels/001.txt",
                  line + " 0.5 0.5 " + mark + end + "\n" + line + " 0.5 0.5 0" + end + "\n");
    const auto frames = Read(folder_.Path() / "labels", images_);
    EXPECT_EQ(frames[1].size(), 2U);
    return std::vector(frames[1].begin(), frames[1].begin() + 1);
  };
  const Box2d box{90, 40, 20, 20};
  for (const char* mark : {"2", "1", "0.93"}) {
    SCOPED_TRACE(mark);
    ExpectBox(read("", mark), "person", 1.0, box);
    ExpectBox(read(" 0.75", mark), "person", 0.75, box);
    ExpectBox(read(" 7", mark), "person", 1.0, box);
    ExpectBox(read(" 0.75 7", mark), "person", 0.75, box);
  }
  // Polygons of one length stay polygons, also those on the diagonal of the image.
  fs::remove_all(folder_.Path() / "labels");
  const std::string octagon = "0 0.48 0.4 0.52 0.4 0.55 0.45 0.55 0.55 0.52 0.6 0.48 0.6 0.45 0.55 0.45 0.45";
  for (const char* name : {"labels/000.txt", "labels/001.txt"}) {
    folder_.Write(name, octagon + "\n" + octagon + "\n");
  }
  const auto frames = Read(folder_.Path() / "labels", images_);
  ExpectBox(std::vector(frames[1].begin(), frames[1].begin() + 1), "person", 1.0, box);
}

TEST_F(BoxFormats, IgnoresHiddenFiles) {
  folder_.Write("labels/._001.txt", std::string("\0\5\26\7\0\2\0\0Mac OS X", 16));
  folder_.Write("labels/001.txt", "41 0.5 0.5 0.1 0.2 0.75\n");
  ExpectBox(Read(folder_.Path() / "labels", images_)[1], "cup", 0.75, {90, 40, 20, 20});
}

TEST_F(BoxFormats, RefusesPixelsWithoutScore) {
  folder_.Write("boxes/0.1.txt", "41 10 20 30 40\n");
  EXPECT_THAT(ErrorOf(folder_.Path() / "boxes"), HasSubstr("0.1.txt:1: a box without a score"));
}

TEST_F(BoxFormats, RefusesFilesWithoutFrameNumber) {
  folder_.Write("labels/film.txt", "41 0.5 0.5 0.1 0.2 0.75\n");
  EXPECT_THAT(ErrorOf(folder_.Path() / "labels"), HasSubstr("'film' names no frame, expected NAME_NUMBER"));
}

TEST_F(BoxFormats, RefusesBoxesTxtInPartsOfImage) {
  EXPECT_THAT(ErrorOf(folder_.Write("boxes.txt", "0.0 cup 0.5 0.4 0.4 0.1 0.2\n")),
              HasSubstr("boxes.txt: all boxes are smaller than a pixel"));
}

TEST_F(BoxFormats, ReadsCocoDataSets) {
  const auto file = folder_.Write(
      "boxes.json",
      R"({"images": [{"id": 7, "file_name": "rgb/002.png"}], "categories": [{"id": 3, "name": "tea pot"}],
          "annotations": [{"id": 1, "image_id": 7, "category_id": 3, "bbox": [10, 20, 30, 40]}]})");
  ExpectBox(Read(file, images_)[2], "tea_pot", 1.0, {10, 20, 30, 40});
}

// COCO's own category numbers leave gaps: 90 is the last of 80.
TEST_F(BoxFormats, ReadsCocoResults) {
  const auto file =
      folder_.Write("boxes.json",
                    R"([{"image_id": 1, "category_id": 90, "bbox": [10, 20, 30, 40], "score": 0.5},
          {"image_id": "000", "category_id": 47, "bbox": [10, 20, 30, 40], "score": 0.5}])");
  const auto frames = Read(file, images_);
  ExpectBox(frames[1], "toothbrush", 0.5, {10, 20, 30, 40});
  ExpectBox(frames[0], "cup", 0.5, {10, 20, 30, 40});
  EXPECT_THAT(ErrorOf(file), HasSubstr("boxes.json: box 0: image_id 1 matches no image name"));  // a video
}

// The same three columns as a list, as pycocotools writes them, and as a polygon.
TEST_F(BoxFormats, ReadsMasksWhenBoxesAreMissing) {
  const auto box_of = [&](const std::string& segmentation) {
    const auto file = folder_.Write("masks.json", R"([{"image_id": 1, "category_id": 47, "score": 0.5, )" +
                                                      (R"("segmentation": )" + segmentation) + "}]");
    return Read(file, images_)[1];
  };
  ExpectBox(box_of(R"({"size": [100, 200], "counts": [10050, 40, 50, 44, 76, 10, 9730]})"), "cup", 0.5,
            {100, 40, 3, 50});
  ExpectBox(box_of(R"({"size": [100, 200], "counts": "Rj9X1b14j0nNf]9"})"), "cup", 0.5, {100, 40, 3, 50});
  ExpectBox(box_of("[[100, 40, 103, 40, 103, 60], [101, 60, 102, 90, 101, 90]]"), "cup", 0.5,
            {100, 40, 3, 50});
  const auto error_of = [&](const std::string& segmentation) {
    return ErrorOf(folder_.Write("bad.json", R"([{"image_id": 1, "category_id": 47, "segmentation": )" +
                                                 segmentation + "}]"),
                   images_);
  };
  EXPECT_THAT(error_of(R"({"size": [100, 200], "counts": [20000]})"), HasSubstr("a mask that is not empty"));
  EXPECT_THAT(error_of(R"({"size": [4, 6], "counts": [5, 20]})"),
              HasSubstr("bad.json: box 0: the runs of its mask do not fit"));
  EXPECT_THAT(error_of(R"({"size": [4, 6], "counts": "oooooooooooooo"})"),
              HasSubstr("as pycocotools writes them"));
  EXPECT_THAT(error_of(R"({"size": [0, 6], "counts": []})"), HasSubstr("expected sides of 1 to 16384"));
  EXPECT_THAT(error_of("[[1, 2, 3]]"), HasSubstr("expected polygons"));
}

TEST_F(BoxFormats, NamesBrokenAnnotation) {
  EXPECT_THAT(ErrorOf(folder_.Write("a.json", R"([{"image_id": 1, "category_id": 1}])"), images_),
              HasSubstr("a.json: box 0: expected COCO's annotations"));
  EXPECT_THAT(ErrorOf(folder_.Write("b.json", R"([{"image_id": 1, "category_id": 1, "bbox": [1, 2, 0, 4]}])"),
                      images_),
              HasSubstr("b.json: box 0: expected a bbox"));
  EXPECT_THAT(ErrorOf(folder_.Write("c.json", R"({"images": []})")),
              HasSubstr("c.json: box 0: expected COCO's"));
}

TEST_F(BoxFormats, ReadsMotChallengeTracks) {
  const auto file = folder_.Write("det.txt", "2,-1,11,21,30,40,0.5,-1,-1,-1\n3,5,1,1,200,100,1,3,1\n");
  const auto frames = Read(file);
  ExpectBox(frames[1], "unknown", 0.5, {10, 20, 30, 40});
  ExpectBox(frames[2], "car", 1.0, {0, 0, 200, 100});
  EXPECT_THAT(ErrorOf(folder_.Write("bad.txt", "0,-1,11,21,30,40,0.5\n")), HasSubstr("bad.txt:1: "));
}

TEST_F(BoxFormats, ReadsTablesByColumnNames) {
  ExpectBox(Read(folder_.Write("a.csv", "frame,class,conf,xmin,ymin,xmax,ymax\n1,cup,0.5,10,20,40,60\n"))[1],
            "cup", 0.5, {10, 20, 30, 40});
  ExpectBox(Read(folder_.Write("b.csv",
                               "image; label; cx; cy; w; h\n\"002.png\"; \"tea pot\"; 0.5; 0.5; 0.1; 0.2\n"),
                 images_)[2],
            "tea_pot", 1.0, {90, 40, 20, 20});
  EXPECT_THAT(ErrorOf(folder_.Write("c.csv", "frame,label,x,y\n1,cup,1,2\n")),
              HasSubstr("c.csv: its first line names"));
  EXPECT_THAT(ErrorOf(folder_.Write("d.csv", "frame,label,x,y,w,h\n1,cup,1,2,3\n")), HasSubstr("d.csv:2: "));
  ExpectBox(Read(folder_.Write("b.csv", "frame,class,x,cx,cy,w,h\n1,cup,7,25,40,30,40\n"))[1], "cup", 1.0,
            {10, 20, 30, 40});
}

TEST_F(BoxFormats, ReadsTracksWithoutClassOrScore) {
  ExpectBox(Read(folder_.Write("a.txt", "2,41,11,21,30,40,-1,-1,-1,-1\n"))[1], "unknown", 1.0,
            {10, 20, 30, 40});
  ExpectBox(Read(folder_.Write("b.txt", "2 41 11 21 30 40 0.5 3 -1 -1\n"))[1], "car", 0.5, {10, 20, 30, 40});
}

TEST_F(BoxFormats, ReadsTablesOfPandasAndSpreadsheets) {
  ExpectBox(Read(folder_.Write("a.csv",
                               ",xmin,ymin,xmax,ymax,confidence,class,name,frame\n"
                               "0,10,20,40,60,0.5,41,tea pot,1\n1,,,,,,,,2\n"))[1],
            "tea_pot", 0.5, {10, 20, 30, 40});
  ExpectBox(Read(folder_.Write("b.csv",
                               "\xEF\xBB\xBF"
                               "frame,label,score,x,y,w,h\r\n1,\"cup, small\",,10,20,30,40\r\n"))[1],
            "cup,_small", 1.0, {10, 20, 30, 40});
  ExpectBox(Read(folder_.Write("c.csv", "frame,class,conf,x,y,w,h\n1,41,-1,10,20,30,40\n"))[1], "cup", 1.0,
            {10, 20, 30, 40});
  ExpectBox(Read(folder_.Write("c.csv", "frame,class,conf,x,y,w,h\n1,41.0,0.5,10,20,30,40\n"))[1], "cup", 0.5,
            {10, 20, 30, 40});
  ExpectBox(Read(folder_.Write("c.csv", "frame,label,conf,x,y,w,h\n1,,0.5,10,20,30,40\n"))[1], "unknown", 0.5,
            {10, 20, 30, 40});
  ExpectBox(Read(folder_.Write("d.csv", "frame;class_id;conf;x;y;w;h\n1;41;0,5;10,0;20;30;40\n"))[1], "cup",
            0.5, {10, 20, 30, 40});
  ExpectBox(Read(folder_.Write("e.csv", "0.1,cup,0.5,10,20,30,40\n"))[1], "cup", 0.5, {10, 20, 30, 40});
}

TEST_F(BoxFormats, RecognisesUnitOfTimes) {
  for (const char* zeros : {"", "000", "000000", "000000000"}) {
    const bool seconds = zeros[0] == '\0';
    const auto at = [&](const char* tenths) {
      return seconds ? fmt::format("0.{} cup 0.5 10 20 30 40\n", tenths)
                     : fmt::format("{}{} cup 0.5 10 20 30 40\n", tenths, zeros + 1);
    };
    const auto frames = Read(folder_.Write("boxes.txt", at("1") + at("2")));
    EXPECT_TRUE(frames[0].empty());
    ExpectBox(frames[1], "cup", 0.5, {10, 20, 30, 40});
    ExpectBox(frames[2], "cup", 0.5, {10, 20, 30, 40});
  }
  const auto frames = Read(folder_.Write("boxes.txt", "1 cup 0.5 10 20 30 40\n2 cup 0.5 10 20 30 40\n"));
  ExpectBox(frames[1], "cup", 0.5, {10, 20, 30, 40});
  ExpectBox(frames[2], "cup", 0.5, {10, 20, 30, 40});
}

TEST_F(BoxFormats, MatchesImagesByPathBeforeName) {
  const std::vector<std::string> images = {"left/000.png", "right/000.png", "right/001.png"};
  folder_.Write("labels/right/000.txt", "41 0.5 0.5 0.1 0.2 0.75\n");
  ExpectBox(Read(folder_.Path() / "labels", images)[1], "cup", 0.75, {90, 40, 20, 20});
  const auto table = [&](const std::string& image) {
    return folder_.Write("a.csv", "image,label,x,y,w,h\n" + image + ",cup,10,20,30,40\n");
  };
  ExpectBox(Read(table("right/000.png"), images)[1], "cup", 1.0, {10, 20, 30, 40});
  ExpectBox(Read(table("/data/seq/right/000.png"), images)[1], "cup", 1.0, {10, 20, 30, 40});
  ExpectBox(Read(table("elsewhere/001.jpg"), images)[2], "cup", 1.0, {10, 20, 30, 40});
  EXPECT_THAT(ErrorOf(table("000.png"), images),
              HasSubstr("'000.png' may be left/000.png or right/000.png, expected the path"));
}

TEST_F(BoxFormats, AcceptsCommaInLabel) {
  ExpectBox(Read(folder_.Write("boxes.txt", "0.1 cup,red 0.5 10 20 30 40\n"))[1], "cup,red", 0.5,
            {10, 20, 30, 40});
}

TEST_F(BoxFormats, RefusesInvalidScores) {
  EXPECT_THAT(ErrorOf(folder_.Write("boxes.txt", "0.0 cup 50 10 20 30 40\n")),
              HasSubstr("boxes.txt:1: score 50"));
}

// As the shell's <(...) gives it.
TEST_F(BoxFormats, ReadsPipes) {
  for (const std::string text :
       {R"([{"image_id": 1, "category_id": 1, "bbox": [10, 20, 30, 40], "score": 0.5}])",
        "0.1 person 0.5 10 20 30 40\n", "2,-1,11,21,30,40,0.5,1\n",
        "frame,class,conf,xmin,ymin,xmax,ymax\n1,person,0.5,10,20,40,60\n"}) {
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    ASSERT_EQ(::write(ends[1], text.data(), text.size()), std::ssize(text));
    ::close(ends[1]);
    ExpectBox(Read("/dev/fd/" + std::to_string(ends[0]), images_)[1], "person", 0.5, {10, 20, 30, 40});
    ::close(ends[0]);
  }
}

class WrittenBoxes : public BoxFormats, public ::testing::WithParamInterface<std::tuple<BoxFormat, bool>> {};

TEST_P(WrittenBoxes, ReadBackUnchanged) {
  const auto [format, video] = GetParam();
  std::vector<ImageBoxes> frames{{0.0, 0, "", kImage, {{"cup", 0.5, {10, 20, 30, 40}}}},
                                 {0.1, 1, "", kImage, {}},
                                 {0.2, 2, "", kImage, {{"tea_pot", 0.25, {0, 0, 200, 100}}}}};
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].name = video ? "film.mp4" : images_[i];
  }
  const fs::path path = folder_.Path() / "written";
  WriteBoxFile(path, format, video, frames);
  const auto read = Read(path, video ? std::vector<std::string>() : images_);
  ExpectBox(read[0], "cup", 0.5, {10, 20, 30, 40});
  EXPECT_TRUE(read[1].empty());
  ExpectBox(read[2], "tea_pot", 0.25, {0, 0, 200, 100});
}

TEST_F(BoxFormats, RefusesToWriteTwoImagesToOneFile) {
  const std::vector<ImageBoxes> frames{{0.0, 0, "a/0.png", kImage, {}}, {0.1, 1, "a/0.jpg", kImage, {}}};
  EXPECT_THAT(InputErrorOf([&] { WriteBoxFile(folder_.Path() / "w", BoxFormat::kFolder, false, frames); }),
              HasSubstr("a/0.png and a/0.jpg would share a/0.txt"));
}

INSTANTIATE_TEST_SUITE_P(Formats, WrittenBoxes,
                         ::testing::Combine(::testing::Values(BoxFormat::kFolder, BoxFormat::kCoco,
                                                              BoxFormat::kMot),
                                            ::testing::Bool()));

}  // namespace
}  // namespace sqslam
