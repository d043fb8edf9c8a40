#pragma once

#include <array>
#include <string>
#include <string_view>

namespace sqslam {

// The 80 classes of COCO in the order of detectors' class indices (0-based), with underscores for blanks.
// clang-format off
inline constexpr std::array<std::string_view, 80> kCocoNames = {
    "person", "bicycle", "car", "motorcycle", "airplane", "bus", "train", "truck", "boat", "traffic_light",
    "fire_hydrant", "stop_sign", "parking_meter", "bench", "bird", "cat", "dog", "horse", "sheep", "cow",
    "elephant", "bear", "zebra", "giraffe", "backpack", "umbrella", "handbag", "tie", "suitcase", "frisbee",
    "skis", "snowboard", "sports_ball", "kite", "baseball_bat", "baseball_glove", "skateboard", "surfboard",
    "tennis_racket", "bottle", "wine_glass", "cup", "fork", "knife", "spoon", "bowl", "banana", "apple",
    "sandwich", "orange", "broccoli", "carrot", "hot_dog", "pizza", "donut", "cake", "chair", "couch",
    "potted_plant", "bed", "dining_table", "toilet", "tv", "laptop", "mouse", "remote", "keyboard",
    "cell_phone", "microwave", "oven", "toaster", "sink", "refrigerator", "book", "clock", "vase",
    "scissors", "teddy_bear", "hair_drier", "toothbrush"};
// clang-format on

// Labels of indoor objects in other detectors and in our synthetic scenes.
inline constexpr std::array<std::string_view, 16> kIndoorNames = {
    "ball",    "box", "can",    "cereal_box", "cylinder", "globe", "jar", "lamp",
    "monitor", "mug", "pillow", "plate",      "speaker",  "table", "tin", "toy"};

// Label of boxes whose file does not tell the class, as trackers write -1.
inline constexpr std::string_view kUnknownClass = "unknown";

// Returns true for a label in one of the two lists. Readers accept others with a warning, as they may be
// typos.
bool IsKnownLabel(std::string_view label);

// Replaces blanks by underscores.
std::string NormalizedLabel(std::string_view label);

}  // namespace sqslam
