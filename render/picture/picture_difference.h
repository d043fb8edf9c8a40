#pragma once

#include <opencv2/core.hpp>

namespace sqslam {

// Difference of two pictures where something is drawn: 1 - SSIM (Wang, Bovik, Sheikh and Simoncelli, "Image
// quality assessment: from error visibility to structural similarity", 2004), averaged over the channels and
// over the pixels, each with the contrast to the background that its SSIM window shows in either picture. The
// background is the reference's most frequent colour. A plain mean would hide a missing object behind the
// empty paper and the faint grid around it. 0 for the same picture, 1 where size or type differ.
double PictureDifference(const cv::Mat& picture, const cv::Mat& reference);

}  // namespace sqslam
