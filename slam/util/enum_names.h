#pragma once

#include <concepts>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace sqslam {

// An enum whose values 0, 1, 2, ... have names, written once in a function beside it:
//
//   enum class Representation { kSuperquadric, kEllipsoid };
//   constexpr auto EnumNames(Representation) { return std::array{"superquadric", "ellipsoid"}; }
//
// Options bind to it (options.h); command lines, error messages and tables take the names from it.
template <typename Enum>
concept NamedEnum = std::is_enum_v<Enum> && requires(Enum value) {
  { EnumNames(value).size() } -> std::convertible_to<std::size_t>;
};

template <NamedEnum Enum>
constexpr const char* NameOf(Enum value) {
  return EnumNames(value)[static_cast<std::size_t>(value)];
}

template <NamedEnum Enum>
std::vector<std::string> AllNames() {
  constexpr auto kNames = EnumNames(Enum());
  return {kNames.begin(), kNames.end()};
}

// Returns the value with this name, or nothing if the name is unknown.
template <NamedEnum Enum>
constexpr std::optional<Enum> FromName(std::string_view name) {
  constexpr auto kNames = EnumNames(Enum());
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (name == kNames[i]) {
      return static_cast<Enum>(i);
    }
  }
  return std::nullopt;
}

}  // namespace sqslam
