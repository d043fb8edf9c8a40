// The same for the program, whose commands all read a command line.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "precompiled.h"
