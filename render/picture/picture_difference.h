#pragma once

#include <opencv2/core.hpp>

namespace sqslam {

// Returns the difference of two pictures: 1 - SSIM (Wang, Bovik, Sheikh and Simoncelli, "Image quality
// assessment: from error visibility to structural similarity", 2004), averaged over channels and pixels. A
// pixel's weight is the contrast to the background in its SSIM window in either picture: in a plain mean, the
// empty background and the faint grid would outweigh a missing object. The background is the reference's most
// frequent colour. 0 for equal pictures, 1 if size or type differ.
double PictureDifference(const cv::Mat& picture, const cv::Mat& reference);

}  // namespace sqslam
