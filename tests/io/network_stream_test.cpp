#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "slam/io/live_source.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"
#include "tests/support/film.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kServedFrames = 20;

// Serves a folder on a port of the loopback interface until it goes out of scope; /camera is a live camera
// (Motion JPEG of picture.jpg) that hangs up after five images.
class LoopbackServer {
 public:
  explicit LoopbackServer(const std::filesystem::path& folder) {
    const std::filesystem::path script = folder / "server.py";
    std::ofstream(script) << R"(
import http.server, os, time
class Handler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass
    def do_GET(self):
        if self.path != "/camera":
            return super().do_GET()
        self.server.calls = getattr(self.server, "calls", 0) + 1
        name = "again.jpg" if self.server.calls > 1 and os.path.exists("again.jpg") else "picture.jpg"
        picture = open(name, "rb").read()
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace;boundary=frame")
        self.end_headers()
        for i in range(5):
            self.wfile.write(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(picture))
            self.wfile.write(picture + b"\r\n")
            time.sleep(0.02)
server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
print(os.getpid(), server.server_port, flush=True)
server.serve_forever()
)";
    pipe_ = popen(("cd " + folder.string() + " && exec python3 server.py").c_str(), "r");
    if (pipe_ == nullptr || std::fscanf(pipe_, "%d %d", &process_, &port_) != 2) {
      throw std::runtime_error("the server does not start");
    }
  }
  ~LoopbackServer() {
    kill(process_, SIGTERM);
    pclose(pipe_);
  }
  LoopbackServer(const LoopbackServer&) = delete;
  LoopbackServer& operator=(const LoopbackServer&) = delete;

  std::string Address(const std::string& path) const {
    return "http://127.0.0.1:" + std::to_string(port_) + path;
  }

 private:
  FILE* pipe_ = nullptr;
  int process_ = 0;
  int port_ = 0;
};

TEST(StreamAddress, DiffersFromFileNames) {
  EXPECT_TRUE(IsStreamAddress("rtsp://camera/main"));
  EXPECT_TRUE(IsStreamAddress("https://example.org/film.mp4"));
  EXPECT_FALSE(IsStreamAddress("data/http/film.mp4"));
  EXPECT_FALSE(IsStreamAddress("0"));
}

TEST(StreamAddress, HidesPassword) {
  EXPECT_EQ(PublicAddress("rtsp://me:secret@camera:554/main"), "rtsp://camera:554/main");
  EXPECT_EQ(PublicAddress("rtsp://me:a@b@camera"), "rtsp://camera");
  EXPECT_EQ(PublicAddress("rtsp://me:a/b@camera/main"), "rtsp://camera/main");
  EXPECT_EQ(PublicAddress("http://camera/a@b"), "http://camera/a@b");
  EXPECT_EQ(PublicAddress("http://camera:80/a@b"), "http://camera:80/a@b");
  EXPECT_EQ(PublicAddress("http://camera/film?token=secret@x"), "http://camera/film");
}

class NetworkStreamTest : public ::testing::Test {
 protected:
  NetworkStreamTest() { ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0); }
  TemporaryFolder folder_;
};

TEST_F(NetworkStreamTest, PlaysFilmToItsEnd) {
  std::vector<double> seconds;
  for (int i = 0; i < kServedFrames; ++i) {
    seconds.push_back(i / 50.0);
  }
  sqslam::testing::WriteFilm(
      folder_.Path() / "film.mp4", seconds,
      [](int i) { return cv::Mat(96, 128, CV_8UC3, cv::Scalar::all(10.0 * i + 20.0)); },
      {.index_first = true});
  const LoopbackServer server(folder_.Path());
  NetworkStream stream(server.Address("/film.mp4"));
  EXPECT_EQ(stream.ImageSize(), cv::Size(128, 96));
  EXPECT_NEAR(stream.Fps(), 50.0, 3.0);  // the last picture lasts as long as the file likes
  cv::Mat image;
  for (int i = 0; i < kServedFrames; ++i) {
    ASSERT_TRUE(stream.Read(image)) << i;
    EXPECT_NEAR(cv::mean(image)[1], 10.0 * i + 20.0, 4.0);
  }
  EXPECT_FALSE(stream.Read(image));
}

TEST_F(NetworkStreamTest, ReopensLostConnection) {
  cv::imwrite((folder_.Path() / "picture.jpg").string(), cv::Mat(96, 128, CV_8UC3, cv::Scalar::all(77)));
  const LoopbackServer server(folder_.Path());
  const CapturedLog log;
  StreamOptions options;
  options.retry_interval = 0.05;
  NetworkStream stream(server.Address("/camera"), options);
  cv::Mat image;
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(stream.Read(image)) << i;
    EXPECT_NEAR(cv::mean(image)[1], 77.0, 3.0);
  }
  EXPECT_THAT(log.Text(), AllOf(HasSubstr("the connection is lost"), HasSubstr("connected again")));
}

TEST_F(NetworkStreamTest, GivesUpLostConnectionAfterTimeLimit) {
  cv::imwrite((folder_.Path() / "picture.jpg").string(), cv::Mat(96, 128, CV_8UC3, cv::Scalar::all(77)));
  auto server = std::make_unique<LoopbackServer>(folder_.Path());
  StreamOptions options;
  options.retry_interval = 0.02;
  options.retry_seconds = 0.2;
  NetworkStream stream(server->Address("/camera"), options);
  cv::Mat image;
  ASSERT_TRUE(stream.Read(image));
  server.reset();
  const CapturedLog log;
  while (stream.Read(image)) {  // what had arrived before
  }
  EXPECT_THAT(log.Text(), AllOf(HasSubstr("the connection is lost"), Not(HasSubstr("connected again"))));
  EXPECT_FALSE(stream.Read(image));
}

TEST_F(NetworkStreamTest, ReportsUnansweredAddressWithoutPassword) {
  EXPECT_THAT(InputErrorOf([] { NetworkStream("http://me:secret@127.0.0.1:9/camera"); }),
              AllOf(HasSubstr("http://127.0.0.1:9/camera: cannot be opened"), Not(HasSubstr("secret"))));
}

}  // namespace
}  // namespace sqslam
