// Headers that most sources include, compiled once for all of them. A source must not rely on it: it includes
// what it uses.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>
