#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sqslam {

// ONNX files byte by byte, so that tests need neither a network nor a library that writes one. A field is its
// number and wire type, then a number or a length with bytes.
class HandMadeNetwork {
 public:
  // The output `output` is the input of 1x3x32x64: no decoder takes that shape.
  static std::string PassThrough() {
    const std::string relu = Node("Relu", "images", "output", "");
    return Model(Bytes(1, relu) + Bytes(11, ValueInfo("images", {1, 3, 32, 64})) +
                 Bytes(12, ValueInfo("output", {1, 3, 32, 64})));
  }

  // A CenterNet for inputs of 32x64 whose three classes are the three channels of the image: `heatmap` is the
  // mean of each 4x4 cell, `ltrb` is 8 everywhere.
  static std::string ChannelsAsClasses() { return CenterNet("AveragePool"); }

  // The same by an operator that OpenCV does not know: `heatmap` is the root of the sum of squares of each
  // cell, 4 times the mean in cells of one colour.
  static std::string UnknownToOpenCv() { return CenterNet("LpPool"); }

 private:
  static std::string CenterNet(const std::string& pooling) {
    const std::string pool =
        Node(pooling, "images", "heatmap", Ints("kernel_shape", {4, 4}) + Ints("strides", {4, 4}));
    std::string convolution = Bytes(1, "images") + Bytes(1, "weights") + Bytes(1, "bias") + Bytes(2, "ltrb") +
                              Bytes(3, "sides") + Bytes(4, "Conv") + Ints("kernel_shape", {4, 4}) +
                              Ints("strides", {4, 4});
    return Model(
        Bytes(1, pool) + Bytes(1, convolution) +
        Tensor("weights", {4, 3, 4, 4}, std::vector<float>(192, 0.0F)) +
        Tensor("bias", {4}, {8.0F, 8.0F, 8.0F, 8.0F}) + Bytes(11, ValueInfo("images", {1, 3, 32, 64})) +
        Bytes(12, ValueInfo("heatmap", {1, 3, 8, 16})) + Bytes(12, ValueInfo("ltrb", {1, 4, 8, 16})));
  }
  static std::string Varint(std::uint64_t value) {
    std::string bytes;
    for (; value > 127; value >>= 7) {
      bytes += static_cast<char>((value & 127) | 128);
    }
    return bytes + static_cast<char>(value);
  }
  static std::string Number(std::uint64_t field, std::uint64_t value) {
    return Varint(field << 3) + Varint(value);
  }
  static std::string Bytes(std::uint64_t field, const std::string& bytes) {
    return Varint(field << 3 | 2) + Varint(bytes.size()) + bytes;
  }
  static std::string ValueInfo(const std::string& name, const std::vector<std::uint64_t>& sizes) {
    std::string shape;
    for (const std::uint64_t size : sizes) {
      shape += Bytes(1, Number(1, size));
    }
    return Bytes(1, name) + Bytes(2, Bytes(1, Number(1, 1) + Bytes(2, shape)));
  }
  static std::string Ints(const std::string& name, const std::vector<std::uint64_t>& values) {
    std::string attribute = Bytes(1, name);
    for (const std::uint64_t value : values) {
      attribute += Number(8, value);
    }
    return Bytes(5, attribute + Number(20, 7));
  }
  static std::string Node(const std::string& type, const std::string& input, const std::string& output,
                          const std::string& attributes) {
    return Bytes(1, input) + Bytes(2, output) + Bytes(3, output + "-node") + Bytes(4, type) + attributes;
  }
  static std::string Tensor(const std::string& name, const std::vector<std::uint64_t>& sizes,
                            const std::vector<float>& values) {
    std::string tensor;
    for (const std::uint64_t size : sizes) {
      tensor += Number(1, size);
    }
    const std::string raw(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
    return Bytes(5, tensor + Number(2, 1) + Bytes(8, name) + Bytes(9, raw));
  }
  static std::string Model(const std::string& graph) {
    return Number(1, 6) + Bytes(7, graph + Bytes(2, "graph")) + Bytes(8, Bytes(1, "") + Number(2, 11));
  }
};

}  // namespace sqslam
