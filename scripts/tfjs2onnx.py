#!/usr/bin/env python3
"""Converts CenterNet-MobileNetV3, a TensorFlow.js graph model of the package @vladmandic/human, to ONNX as OpenCV 4.6
reads it. Needs nothing but Python.

TensorFlow orders the values of a tensor by batch, height, width and channel, ONNX by batch, channel, height and width:
all shapes here are those of ONNX.

usage: scripts/tfjs2onnx.py MODEL.json NETWORK.onnx
"""
import array
import base64
import json
import math
import pathlib
import struct
import sys

INPUT = "tower_0/images"
OUTPUTS = {"tower_0/keypoints": "heatmap", "tower_0/wh": "ltrb"}  # TensorFlow's name: ONNX's
IMAGE = [1, 3, 480, 640]
ENLARGED = 2  # factor of every resize; the model holds the sizes for the image that it was made for

FLOAT, INT, STRING, INTS = 1, 2, 3, 7  # types of attributes
FLOAT32 = 1                            # type of a tensor
OPSET = 11


# ---- Protocol buffers: fields of a message by number

def varint(value):
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def number(field, value):
    return varint(field << 3) + varint(value)


def real(field, value):
    return varint(field << 3 | 5) + struct.pack("<f", value)


def block(field, content):
    content = content.encode() if isinstance(content, str) else content
    return varint(field << 3 | 2) + varint(len(content)) + content


def blocks(field, contents):
    return b"".join(block(field, content) for content in contents)


# ---- Messages of ONNX

def tensor_message(name, shape, values):
    dims = b"".join(number(1, side) for side in shape)
    return dims + number(2, FLOAT32) + block(8, name) + block(9, values.tobytes())


def attribute_message(name, value):
    head = block(1, name)
    if isinstance(value, int):
        return head + number(3, value) + number(20, INT)
    if isinstance(value, float):
        return head + real(2, value) + number(20, FLOAT)
    if isinstance(value, str):
        return head + block(4, value) + number(20, STRING)
    return head + b"".join(number(8, v) for v in value) + number(20, INTS)


def value_message(name, shape):
    dims = blocks(1, (number(1, side) for side in shape))
    return block(1, name) + block(2, block(1, number(1, FLOAT32) + block(2, dims)))


# ---- The model of TensorFlow.js

def read_weights(model, folder):
    """Returns shape and values of each constant by name."""
    weights = {}
    for group in model["weightsManifest"]:
        data = b"".join((folder / path).read_bytes() for path in group["paths"])
        for entry in group["weights"]:
            count = math.prod(entry["shape"])
            width, code, kind = (2, "e", "f") if "quantization" in entry else (4, "i", "i")
            values = array.array(kind, struct.unpack(f"<{count}{code}", data[:width * count]))
            weights[entry["name"]] = (entry["shape"], values)
            data = data[width * count:]
        assert not data
    return weights


def attribute(node, key):
    """Returns a list of numbers or of words, or a word."""
    value = node.get("attr", {}).get(key, {"list": {}})
    if "list" not in value:
        return base64.b64decode(value["s"]).decode()
    return [int(v) for v in value["list"].get("i", [])] or \
        [base64.b64decode(v).decode() for v in value["list"].get("s", [])]


def inputs(node):
    return [name.removeprefix("^").removesuffix(":0") for name in node.get("input") or []]


class Converter:
    def __init__(self, model, folder):
        self.nodes = {node["name"]: node for node in model["modelTopology"]["node"]}
        self.weights = read_weights(model, folder)
        self.made = {INPUT: ("image", IMAGE)}  # name and shape in ONNX
        self.out = []
        self.constants = []
        self.find_hard_gates()

    def find_hard_gates(self):
        """relu6(x + 3) / 6 and x relu6(x + 3) / 6 become operators of their own, which are faster."""
        def split(node, constant):
            """Returns the other operand if one is about this constant."""
            for name, other in (inputs(node), inputs(node)[::-1]):
                values = self.weights.get(name, (0, ()))[1]
                if len(values) == 1 and abs(values[0] - constant) < 1e-2 * constant:
                    return other
            return None

        for relu in [node for node in self.nodes.values() if node["op"] == "Relu6"]:
            x = split(self.nodes[inputs(relu)[0]], 3.0)
            for product in [node for node in self.nodes.values() if relu["name"] in inputs(node)]:
                others = [name for name in inputs(product) if name != relu["name"]]
                if split(product, 1 / 6) == relu["name"]:
                    product["op"] = "HardSigmoid"
                else:
                    assert split(self.nodes[others[0]], 1 / 6) == x
                    product["op"] = "HardSwish"
                product["input"] = [x]

    def constant(self, shape, values, kind="c"):
        name = f"{kind}_{len(self.constants) + 1}"
        self.constants.append(tensor_message(name, shape, array.array("f", values)))
        return name

    def emit(self, op, names, result, **attributes):
        self.out.append(blocks(1, names) + block(2, result) + block(3, result) + block(4, op) +
                        blocks(5, (attribute_message(*item) for item in attributes.items())))

    def get(self, name):
        """Returns name and shape in ONNX, after converting the node and all that it needs."""
        if name not in self.made:
            node = self.nodes[name]
            for needed in reversed(inputs(node)):
                if needed not in self.weights:
                    self.get(needed)
            convert = {"Conv2D": self.convolution, "_FusedConv2D": self.convolution,
                       "DepthwiseConv2dNative": self.convolution, "FusedDepthwiseConv2dNative": self.convolution,
                       "Add": self.binary, "Mul": self.binary, "Relu": self.unary, "Sigmoid": self.unary,
                       "HardSigmoid": self.hard_sigmoid, "HardSwish": self.hard_swish, "Mean": self.mean,
                       "ResizeBilinear": self.resize, "ConcatV2": self.concat,
                       "Identity": lambda node, name: self.get(inputs(node)[0])}[node["op"]]
            self.made[name] = convert(node, name.replace("/", "_"))
        return self.made[name]

    def convolution(self, node, name):
        names = inputs(node)
        x, (batch, _, *sides) = self.get(names[0])
        (height, width, deep, wide), values = self.weights[names[1]]
        each = "epthwise" in node["op"]  # every channel on its own
        channels = deep * wide if each else wide
        step = channels if each else deep * wide
        kernel = [v for channel in range(channels) for first in range(1 if each else deep)
                  for v in values[first * wide + channel::step]]
        strides, dilations = attribute(node, "strides")[1:3], attribute(node, "dilations")[1:3]
        result = [-(-side // stride) for side, stride in zip(sides, strides)]
        assert attribute(node, "padding") == "SAME" or [height, width] == [1, 1]
        excess = [max((r - 1) * stride + (size - 1) * dilation + 1 - side, 0) for r, stride, size, dilation, side
                  in zip(result, strides, (height, width), dilations, sides)]
        padding = {"auto_pad": "SAME_UPPER"} if any(e % 2 for e in excess) else {"pads": [e // 2 for e in excess] * 2}
        fused = attribute(node, "fused_ops")
        terms = [x, self.constant([channels, 1 if each else deep, height, width], kernel, "w")]
        if "BiasAdd" in fused:
            terms.append(self.constant([channels], self.weights[names[2]][1], "b"))
        self.emit("Conv", terms, name, kernel_shape=[height, width], strides=strides, dilations=dilations,
                  group=deep if each else 1, **padding)
        if "Relu" in fused:
            self.emit("Relu", [name], name + "_Relu")
            name += "_Relu"
        return name, [batch, channels, *result]

    def binary(self, node, name):
        names = inputs(node)
        scalars = [n for n in names if n in self.weights]
        x, *others = [self.get(n) for n in names if n not in self.weights]
        if scalars:
            other = self.constant([1] * 4, self.weights[scalars[0]][1])
        else:
            if x[1][2:] == [1, 1]:  # what is repeated for all pixels comes second
                x, others = others[0], [x]
            other = others[0][0]
        self.emit(node["op"], [x[0], other], name)
        return name, x[1]

    def unary(self, node, name):
        x, shape = self.get(inputs(node)[0])
        self.emit(node["op"], [x], name)
        return name, shape

    def hard_swish(self, node, name):
        x, shape = self.get(inputs(node)[0])
        self.emit("HardSigmoid", [x], name + "_gate", alpha=1 / 6, beta=0.5)
        self.emit("Mul", [x, name + "_gate"], name)
        return name, shape

    def hard_sigmoid(self, node, name):
        """Makes relu(u) - relu(u - 1) with u = x / 6 + 0.5: OpenCV 4.6 takes any product with a HardSigmoid for a hard
        swish of the gate itself."""
        x, shape = self.get(inputs(node)[0])
        self.emit("Mul", [x, self.constant([1] * 4, [1 / 6])], name + "_u6")
        self.emit("Add", [name + "_u6", self.constant([1] * 4, [0.5])], name + "_u")
        self.emit("Add", [name + "_u", self.constant([1] * 4, [-1.0])], name + "_v")
        self.emit("Relu", [name + "_u"], name + "_ru")
        self.emit("Relu", [name + "_v"], name + "_rv")
        self.emit("Sub", [name + "_ru", name + "_rv"], name)
        return name, shape

    def mean(self, node, name):
        x, shape = self.get(inputs(node)[0])
        self.emit("GlobalAveragePool", [x], name)
        return name, shape[:2] + [1, 1]

    def resize(self, node, name):
        x, shape = self.get(inputs(node)[0])
        region = self.constant([0], [], "roi")  # empty: all
        factors = self.constant([4], [1, 1, ENLARGED, ENLARGED], "scales")
        self.emit("Resize", [x, region, factors], name, mode="linear", coordinate_transformation_mode="asymmetric")
        return name, shape[:2] + [ENLARGED * side for side in shape[2:]]

    def concat(self, node, name):
        parts = [self.get(n) for n in inputs(node)[:-1]]
        self.emit("Concat", [part for part, _ in parts], name, axis=1)
        _, (batch, _, *sides) = parts[0]
        return name, [batch, sum(shape[1] for _, shape in parts), *sides]

    def network(self):
        outputs = []
        for name, shown in OUTPUTS.items():
            result, shape = self.get(name)
            self.emit("Identity", [result], shown)
            outputs.append(value_message(shown, shape))
        graph = blocks(1, self.out) + block(2, "g") + blocks(5, self.constants)
        graph += block(11, value_message("image", IMAGE)) + blocks(12, outputs)
        return number(1, 6) + block(2, "tfjs2onnx") + block(7, graph) + block(8, number(2, OPSET))


path = pathlib.Path(sys.argv[1])
pathlib.Path(sys.argv[2]).write_bytes(Converter(json.loads(path.read_text()), path.parent).network())
