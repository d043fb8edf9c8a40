#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <ranges>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"
#include "slam/util/error.h"

// Serialization of state, little-endian. A type lists its members once, for writing and for reading:
//
//   static void VisitState(auto& self, auto&& visit) { visit(self.first, self.second); }
namespace sqslam {

namespace byte_archive {

// Visits the members of a value: by VisitState, or of a pair or a geometric type.
template <typename Self, typename Visit>
void VisitMembers(Self& self, Visit&& visit) {
  using T = std::remove_const_t<Self>;
  if constexpr (requires { T::VisitState(self, visit); }) {
    T::VisitState(self, visit);
  } else if constexpr (requires { self.first, self.second; }) {
    visit(self.first, self.second);
  } else if constexpr (std::is_same_v<T, Eigen::Quaterniond>) {
    visit(self.coeffs());
  } else if constexpr (std::is_same_v<T, Rigid3d>) {
    visit(self.rotation, self.translation);
  } else if constexpr (std::is_same_v<T, Sim3d>) {
    visit(self.scale, self.rotation, self.translation);
  } else if constexpr (std::is_same_v<T, Box2d>) {
    visit(self.x, self.y, self.width, self.height);
  } else if constexpr (std::is_same_v<T, Superquadric>) {
    visit(self.half_size, self.e1, self.e2);
  } else if constexpr (std::is_same_v<T, PosedSuperquadric>) {
    visit(self.shape, self.T_map_object);
  } else if constexpr (std::is_same_v<T, Camera>) {
    visit(self.width, self.height, self.fx, self.fy, self.cx, self.cy, self.distortion, self.fps,
          self.readout_ms, self.lens);
  } else {
    static_assert(sizeof(T) == 0, "a type without VisitState");
  }
}

}  // namespace byte_archive

class ByteWriter {
 public:
  template <typename... Values>
  void operator()(const Values&... values) {
    (Put(values), ...);
  }
  const std::string& Bytes() const { return bytes_; }
  std::string Take() { return std::move(bytes_); }

 private:
  template <typename T>
  requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void Put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  void Put(const std::string& text) {
    PutSize(text.size());
    bytes_ += text;
  }
  template <typename T>
  void Put(const std::optional<T>& value) {
    Put(value.has_value());
    if (value) {
      Put(*value);
    }
  }
  template <typename T>
  void Put(const std::complex<T>& value) {
    (*this)(value.real(), value.imag());
  }
  template <typename T, std::size_t N>
  void Put(const std::array<T, N>& items) {
    for (const T& item : items) {
      Put(item);
    }
  }
  template <std::ranges::range Items>
  void Put(const Items& items) {
    PutSize(items.size());
    for (const auto& item : items) {
      Put(item);
    }
  }
  template <typename T, int R, int C>
  void Put(const Eigen::Matrix<T, R, C>& matrix) {
    bytes_.append(reinterpret_cast<const char*>(matrix.data()), sizeof(T) * R * C);
  }
  template <typename T>
  requires(std::is_class_v<T> && !std::ranges::range<T>) void Put(const T& value) {
    byte_archive::VisitMembers(value, *this);
  }

  void PutSize(std::size_t size) { Put(static_cast<std::uint32_t>(size)); }

  std::string bytes_;
};

// Throws InputError that begins with `what` if the bytes end too early or hold numbers that are not allowed.
class ByteReader {
 public:
  enum class Numbers { kFinite, kAny };

  ByteReader(std::string_view bytes, std::string what, Numbers allowed = Numbers::kFinite)
      : bytes_(bytes), what_(std::move(what)), allowed_(allowed) {}

  template <typename... Values>
  void operator()(Values&... values) {
    (Get(values), ...);
  }
  bool AtEnd() const { return bytes_.empty(); }
  std::size_t BytesLeft() const { return bytes_.size(); }
  [[noreturn]] void Refuse(const std::string& problem) const { throw InputError(what_ + " " + problem); }

 private:
  template <typename T>
  requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void Get(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      Get(byte);
      value = byte != 0;
    } else {
      std::memcpy(&value, TakeBytes(sizeof(value)).data(), sizeof(value));
    }
    if constexpr (std::is_floating_point_v<T>) {
      if (allowed_ == Numbers::kFinite && !std::isfinite(value)) {
        Refuse("holds a number that is not finite");
      }
    }
  }
  void Get(std::string& text) { text = std::string(TakeBytes(GetSize())); }
  template <typename T>
  void Get(std::optional<T>& value) {
    bool present = false;
    Get(present);
    value.reset();
    if (present) {
      Get(value.emplace());
    }
  }
  template <typename T>
  void Get(std::complex<T>& value) {
    T real{}, imaginary{};
    (*this)(real, imaginary);
    value = {real, imaginary};
  }
  template <typename T, std::size_t N>
  void Get(std::array<T, N>& items) {
    for (T& item : items) {
      Get(item);
    }
  }
  template <typename T>
  void Get(std::vector<T>& items) {
    GetItems<T>(items);
  }
  template <typename T>
  void Get(std::set<T>& items) {
    GetItems<T>(items);
  }
  template <typename K, typename V>
  void Get(std::map<K, V>& items) {
    GetItems<std::pair<K, V>>(items);
  }
  template <typename T, int R, int C>
  void Get(Eigen::Matrix<T, R, C>& matrix) {
    for (T* value = matrix.data(); value != matrix.data() + R * C; ++value) {
      Get(*value);
    }
  }
  template <typename T>
  requires std::is_class_v<T>
  void Get(T& value) { byte_archive::VisitMembers(value, *this); }

  template <typename Item>
  void GetItems(auto& items) {
    items.clear();
    for (std::size_t left = GetSize(); left > 0;
         --left) {  // grows with the data: a broken count allocates nothing
      Item item{};
      Get(item);
      items.insert(items.end(), std::move(item));
    }
  }
  std::size_t GetSize() {
    std::uint32_t size = 0;
    Get(size);
    if (size > bytes_.size()) {
      Refuse("is cut off");
    }
    return size;
  }
  std::string_view TakeBytes(std::size_t size) {
    if (size > bytes_.size()) {
      Refuse("is cut off");
    }
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }

  std::string_view bytes_;
  std::string what_;
  Numbers allowed_;
};

// Compresses bytes with zlib. Level 1 is three times as fast as the default for 10 % more bytes (floats
// barely compress).
std::string Deflate(std::string_view raw, int level = 1);

// Throws InputError that begins with `what` if Deflate did not make the bytes from `size` bytes.
std::string Inflate(std::string_view packed, std::size_t size, const std::string& what);

// Compresses bytes with zstd by their differences from similar ones, which may be empty.
std::string PackPatch(std::string_view raw, std::string_view base);

// Throws InputError that begins with `what` if PackPatch did not make the bytes, of at most `max_size`, from
// this base.
std::string UnpackPatch(std::string_view packed, std::string_view base, std::size_t max_size,
                        const std::string& what);

inline bool IsLensModel(LensModel lens) {
  return lens == LensModel::kRadialTangential || lens == LensModel::kFisheye;
}

}  // namespace sqslam
