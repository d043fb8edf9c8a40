// Headers that the commands of the program include beside those.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "precompiled.h"
