#!/usr/bin/env python3
"""Convert a TensorFlow.js "graph-model" (model.json + weight shards) of a plain
convolutional detector into an ONNX file that OpenCV 4.6 cv::dnn can load.

Python standard library only (no numpy, no onnx, no tensorflow).

  tfjs2onnx.py model.json out.onnx --input NAME --shape 1,3,H,W --output TF=ONNX [...]

Rank-4 activations are kept physically NCHW; a per-tensor tag says whether the TF
graph sees the tensor as NHWC or NCHW, so TF's layout transposes cost nothing.
"""
import argparse, array, base64, fnmatch, json, os, struct, sys


# ------------------------------------------------------------ protobuf writing
def varint(v):
    if v < 0:
        v += 1 << 64
    out = bytearray()
    while True:
        b = v & 0x7F
        v >>= 7
        if v:
            out.append(b | 0x80)
        else:
            out.append(b)
            return bytes(out)


def f_var(n, v):
    return varint(n << 3) + varint(v)


def f_len(n, b):
    if isinstance(b, str):
        b = b.encode()
    return varint(n << 3 | 2) + varint(len(b)) + b


def f_f32(n, v):
    return varint(n << 3 | 5) + struct.pack("<f", v)


F32, I64 = 1, 7


def tensor(name, dims, dtype, raw):
    return b"".join(f_var(1, d) for d in dims) + f_var(2, dtype) + f_len(8, name) + f_len(9, raw)


def attr(name, v):
    h = f_len(1, name)
    if isinstance(v, bool):
        return h + f_var(3, int(v)) + f_var(20, 2)
    if isinstance(v, int):
        return h + f_var(3, v) + f_var(20, 2)
    if isinstance(v, float):
        return h + f_f32(2, v) + f_var(20, 1)
    if isinstance(v, str):
        return h + f_len(4, v) + f_var(20, 3)
    if isinstance(v, (list, tuple)):
        return h + b"".join(f_var(8, x) for x in v) + f_var(20, 7)
    raise TypeError(v)


def vinfo(name, dims):
    shp = b"".join(f_len(1, f_var(1, d)) for d in dims)
    return f_len(1, name) + f_len(2, f_len(1, f_var(1, F32) + f_len(2, shp)))


# ------------------------------------------------------------------- TFJS input
def half(buf):
    n = len(buf) // 2
    return array.array("f", struct.unpack("<%de" % n, buf))


def load(path):
    j = json.load(open(path))
    root = os.path.dirname(os.path.abspath(path))
    W = {}
    for g in j["weightsManifest"]:
        blob = b"".join(open(os.path.join(root, p), "rb").read() for p in g["paths"])
        off = 0
        for w in g["weights"]:
            n = 1
            for d in w["shape"]:
                n *= d
            q = w.get("quantization")
            if q and q["dtype"] == "float16":
                sz = 2 * n
                a = half(blob[off : off + sz])
            elif q:
                sz = n * {"uint8": 1, "uint16": 2}[q["dtype"]]
                r = array.array({"uint8": "B", "uint16": "H"}[q["dtype"]])
                r.frombytes(blob[off : off + sz])
                a = array.array("f", [x * q["scale"] + q["min"] for x in r])
            elif w["dtype"] == "float32":
                sz = 4 * n
                a = array.array("f")
                a.frombytes(blob[off : off + sz])
            elif w["dtype"] == "int32":
                sz = 4 * n
                a = array.array("i")
                a.frombytes(blob[off : off + sz])
            elif w["dtype"] == "bool":
                sz = n
                a = array.array("B")
                a.frombytes(blob[off : off + sz])
            else:
                raise ValueError(w)
            off += sz
            W[w["name"]] = (list(w["shape"]), a)
        assert off == len(blob), (off, len(blob))
    return j["modelTopology"]["node"], W


def A(n, k, d=None):
    v = n.get("attr", {}).get(k)
    if v is None:
        return d
    if "list" in v:
        l = v["list"]
        if l.get("i"):
            return [int(x) for x in l["i"]]
        if l.get("s"):
            return [base64.b64decode(x).decode() for x in l["s"]]
        return []
    if "s" in v:
        s = v["s"]
        return base64.b64decode(s).decode() if isinstance(s, str) else bytes(s).decode()
    if "i" in v:
        return int(v["i"])
    if "f" in v:
        return float(v["f"])
    if "b" in v:
        return bool(v["b"])
    return d


# ---------------------------------------------------------------- the converter
class Conv:
    def __init__(s, nodes, W):
        s.N = {n["name"]: n for n in nodes}
        s.W = W
        s.out, s.init, s.T, s.k = [], [], {}, 0  # T: tf tensor -> (onnx name, NCHW/flat shape, tag)
        s.uses = {}
        for n in nodes:
            for i in n.get("input") or []:
                s.uses.setdefault(s.base(i), []).append(n)
        s.hard_ops()

    def hard_ops(s):
        "relu6(x+3)/6 and x*relu6(x+3)/6 become HardSigmoid: less memory traffic, and no Clip"

        def split(n):  # binary op with one scalar constant
            for k in (0, 1):
                c = s.const(n["input"][k])
                if c and len(c[1]) == 1:
                    return s.base(n["input"][1 - k]), c[1][0]
            return None, 0.0

        for r in [n for n in s.N.values() if n["op"] == "Relu6"]:
            a = s.N.get(s.base(r["input"][0]))
            if not a or a["op"] not in ("Add", "AddV2"):
                continue
            x, three = split(a)
            if x is None or abs(three - 3) > 1e-2:
                continue
            for m in s.uses[r["name"]]:
                if m["op"] != "Mul":
                    continue
                y, k = split(m)
                if y == r["name"] and abs(k - 1 / 6) < 1e-3:
                    m["op"], m["input"] = "_HSigmoid", [x]
                    continue
                o = [s.base(i) for i in m["input"] if s.base(i) != r["name"]]
                if len(o) == 1 and o[0] in s.N and s.N[o[0]]["op"] == "Mul":
                    y, k = split(s.N[o[0]])
                    if y == x and abs(k - 1 / 6) < 1e-3:
                        m["op"], m["input"] = "_HSwish", [x]

    @staticmethod
    def base(i):
        return i[1:] if i.startswith("^") else (i[:-2] if i.endswith(":0") else i)

    def const(s, name):
        b = s.base(name)
        while b not in s.W:
            n = s.N[b]
            if n["op"] == "Identity":
                b = s.base(n["input"][0])
            elif n["op"] == "SparseToDense":  # dead ONNX->TF "-1" fix-ups: default everywhere
                b = s.base(n["input"][3])
            else:
                return None
        return s.W[b]

    def ini(s, dims, data, dtype=F32, hint="c"):
        s.k += 1
        nm = "%s_%d" % (hint, s.k)
        s.init.append(tensor(nm, dims, dtype, data.tobytes()))
        return nm

    def i64(s, v, hint="i"):
        return s.ini([len(v)], array.array("q", v), I64, hint)

    def sc(s, v):
        return s.ini([], array.array("f", [v]), hint="s")

    def relu6(s, x, o):
        # Clip took attributes before opset 11, and OpenCV 4.6 reads only those
        if s.opset > 10:
            s.emit("Clip", [x, s.sc(0.0), s.sc(6.0)], o)
        else:
            s.emit("Clip", [x], o, min=0.0, max=6.0)

    def emit(s, op, ins, name, **at):
        body = b"".join(f_len(1, i) for i in ins)
        outs = [name] if isinstance(name, str) else name
        body += b"".join(f_len(2, o) for o in outs) + f_len(3, outs[0]) + f_len(4, op)
        body += b"".join(f_len(5, attr(k, v)) for k, v in at.items())
        s.out.append(body)

    def get(s, i):
        b = s.base(i)
        if b not in s.T:
            s.visit(b)
        return s.T[b]

    def hw(s, l):  # NHWC attr list -> (H, W)
        return l[1], l[2]

    def target(s, name):
        for pat, t in s.reshape_to:
            if fnmatch.fnmatch(name, pat):
                return list(t)

    def visit(s, name):
        todo = [name]
        while todo:  # iterative post-order
            b = todo[-1]
            root = b.split(":")[0]
            if b in s.T:
                todo.pop()
                continue
            n = s.N[root]
            need = [s.base(i) for i in n.get("input") or [] if not i.startswith("^")]
            if n["op"] == "Reshape" and s.target(root):
                need = need[:1]
            need = [i for i in need if i not in s.T and s.const(i.split(":")[0]) is None]
            if need:
                todo.extend(need)
                continue
            s.op(n)
            todo.pop()

    def pads_of(s, n):
        "TF Pad paddings -> list of [before, after] per axis, in NCHW order"
        p = s.const(n["input"][1])[1]
        x = s.get(n["input"][0])
        q = [[p[2 * i], p[2 * i + 1]] for i in range(4)]
        return q if x[2] == "NCHW" else [q[0], q[3], q[1], q[2]]

    def op(s, n):
        op, nm, I = n["op"], n["name"], n.get("input") or []
        safe = nm.replace("/", "_")
        if op in ("Identity",):
            s.T[nm] = s.get(I[0])
            return
        if op == "Transpose":
            x = s.get(I[0])
            p = list(s.const(I[1])[1])
            if len(p) == 4 and p == [0, 2, 3, 1] and x[2] == "NCHW":
                s.T[nm] = (x[0], x[1], "NHWC", *x[3:])
                return
            if len(p) == 4 and p == [0, 3, 1, 2] and x[2] == "NHWC":
                s.T[nm] = (x[0], x[1], "NCHW", *x[3:])
                return
            assert x[2] == "flat", (nm, p, x)
            s.emit("Transpose", [x[0]], safe, perm=p)
            s.T[nm] = (safe, [x[1][i] for i in p], "flat")
            return
        if op in ("Pad", "PadV2"):
            # remembered, and folded into the convolution or pooling that follows
            x = s.get(I[0])
            s.T[nm] = (x[0], x[1], x[2], s.pads_of(n))
            return
        if op in ("Conv2D", "_FusedConv2D", "DepthwiseConv2dNative", "FusedDepthwiseConv2dNative"):
            x = s.get(I[0])
            assert x[2] == "NHWC", (nm, x)
            ws, w = s.const(I[1])
            kh, kw, ci, co = ws
            dw = "epthwise" in op
            nn = len(w)
            o = array.array("f", bytes(4 * nn))
            if dw:  # HWCM -> (C*M,1,H,W)
                m = co
                oc = ci * m
                dims = [oc, 1, kh, kw]
                t = 0
                for c in range(oc):
                    for y in range(kh):
                        for xx in range(kw):
                            o[t] = w[(y * kw + xx) * oc + c]
                            t += 1
            else:  # HWIO -> OIHW
                oc = co
                dims = [co, ci, kh, kw]
                hw = kh * kw
                for p in range(hw):
                    for c in range(ci):
                        base = (p * ci + c) * co
                        o[c * hw + p :: ci * hw] = w[base : base + co]
            fused = A(n, "fused_ops", []) or []
            bias = s.const(I[2])[1] if "BiasAdd" in fused else None
            st, dl = s.hw(A(n, "strides")), s.hw(A(n, "dilations", [1, 1, 1, 1]))
            # fold "+ const[C]" / "* const[C]" that is this conv's only consumer
            last = nm
            scale = None
            while True:
                u = s.uses.get(last, [])
                if len(u) != 1 or fused[1:]:
                    break
                v = u[0]
                if v["op"] not in ("Add", "AddV2", "BiasAdd", "Mul"):
                    break
                oth = [i for i in v["input"] if s.base(i) != last]
                c = s.const(oth[0]) if oth else None
                if c is None or len(c[1]) not in (oc,):
                    break
                if v["op"] == "Mul":
                    per = nn // oc
                    for q in range(nn):
                        o[q] *= c[1][q // per]
                    if bias is not None:
                        bias = array.array("f", [a * b for a, b in zip(bias, c[1])])
                else:
                    bias = (
                        array.array("f", c[1])
                        if bias is None
                        else array.array("f", [a + b for a, b in zip(bias, c[1])])
                    )
                last = v["name"]
            u = s.uses.get(last, [])
            if len(u) == 1 and u[0]["op"] == "FusedBatchNorm":
                v = u[0]
                g, be, mu, va = [s.const(i)[1] for i in v["input"][1:5]]
                eps = A(v, "epsilon", 1e-3)
                k = [g[c] / (va[c] + eps) ** 0.5 for c in range(oc)]
                per = nn // oc
                for q in range(nn):
                    o[q] *= k[q // per]
                b0 = bias or array.array("f", bytes(4 * oc))
                bias = array.array("f", [(b0[c] - mu[c]) * k[c] + be[c] for c in range(oc)])
                last = v["name"]
            at = dict(kernel_shape=[kh, kw], strides=list(st), dilations=list(dl), group=ci if dw else 1)
            H, Wd = x[1][2], x[1][3]
            ek = [(kh - 1) * dl[0] + 1, (kw - 1) * dl[1] + 1]
            if A(n, "padding") == "SAME":
                OH, OW = -(-H // st[0]), -(-Wd // st[1])
                pt = [max((OH - 1) * st[0] + ek[0] - H, 0), max((OW - 1) * st[1] + ek[1] - Wd, 0)]
                if pt[0] % 2 or pt[1] % 2:
                    at["auto_pad"] = "SAME_UPPER"
                else:
                    at["pads"] = [pt[0] // 2, pt[1] // 2, pt[0] // 2, pt[1] // 2]
            else:
                p = x[3] if len(x) > 3 else [[0, 0]] * 4
                assert p[0] == [0, 0] and p[1] == [0, 0]
                at["pads"] = [p[2][0], p[3][0], p[2][1], p[3][1]]
                OH = (H + sum(p[2]) - ek[0]) // st[0] + 1
                OW = (Wd + sum(p[3]) - ek[1]) // st[1] + 1
            ins = [x[0], s.ini(dims, o, hint="w")]
            if bias is not None:
                ins.append(s.ini([oc], bias, hint="b"))
            s.emit("Conv", ins, safe, **at)
            cur = safe
            for f in fused:
                if f == "BiasAdd":
                    continue
                nx = safe + "_" + f
                if f == "Relu6":
                    s.relu6(cur, nx)
                elif f == "Relu":
                    s.emit("Relu", [cur], nx)
                else:
                    raise ValueError(f)
                cur = nx
            r = (cur, [x[1][0], oc, OH, OW], "NHWC")
            s.T[nm] = r
            s.T[last] = r
            return
        if op in ("Add", "AddV2", "Mul", "Sub", "BiasAdd"):
            a, b = I[0], I[1]
            ca, cb = s.const(a), s.const(b)
            onn = {"AddV2": "Add", "BiasAdd": "Add"}.get(op, op)
            if ca is None and cb is None:
                x, y = s.get(a), s.get(b)
                assert x[2] == y[2], (nm, x, y)
                if x[1][2:] == [1, 1] and y[1][2:] != [1, 1]:
                    x, y = (y, x) if onn != "Sub" else (x, y)
                s.emit(onn, [x[0], y[0]], safe)
                s.T[nm] = (safe, x[1], x[2])
                return
            c = ca if cb is None else cb
            x = s.get(b if cb is None else a)
            n_el = len(c[1])
            assert cb is not None or op != "Sub"
            if n_el == 1:
                dims = [1] * len(x[1])
            else:
                assert n_el == x[1][1] and x[2] == "NHWC", (nm, c[0])
                dims = [1, n_el, 1, 1]
            val = array.array("f", c[1])
            # (x+3) * clip and x*(1/6) as full-size broadcasts are fine for OpenCV
            s.emit(onn, [x[0], s.ini(dims, val)], safe)
            s.T[nm] = (safe, x[1], x[2])
            return
        un = {"Relu": "Relu", "Sigmoid": "Sigmoid", "Exp": "Exp"}
        if op in un:
            x = s.get(I[0])
            s.emit(un[op], [x[0]], safe)
            s.T[nm] = (safe, x[1], x[2])
            return
        if op == "Relu6":
            x = s.get(I[0])
            s.relu6(x[0], safe)
            s.T[nm] = (safe, x[1], x[2])
            return
        if op in ("_HSigmoid", "_HSwish"):
            x = s.get(I[0])
            one = [1] * len(x[1])
            if op == "_HSwish":
                s.emit("HardSigmoid", [x[0]], safe + "_gate", alpha=1 / 6, beta=0.5)
                s.emit("Mul", [x[0], safe + "_gate"], safe)
            else:
                # relu(u)-relu(u-1), u=x/6+.5: OpenCV 4.6 mistakes ANY Mul by a HardSigmoid for
                # a hard swish of the gate itself, which breaks squeeze-and-excite blocks
                f = lambda v: s.ini(one, array.array("f", [v]))
                s.emit("Mul", [x[0], f(1 / 6)], safe + "_u6")
                s.emit("Add", [safe + "_u6", f(0.5)], safe + "_u")
                s.emit("Add", [safe + "_u", f(-1.0)], safe + "_v")
                s.emit("Relu", [safe + "_u"], safe + "_ru")
                s.emit("Relu", [safe + "_v"], safe + "_rv")
                s.emit("Sub", [safe + "_ru", safe + "_rv"], safe)
            s.T[nm] = (safe, x[1], x[2])
            return
        if op == "LeakyRelu":
            x = s.get(I[0])
            s.emit("LeakyRelu", [x[0]], safe, alpha=A(n, "alpha", 0.2))
            s.T[nm] = (safe, x[1], x[2])
            return
        if op == "Mean":
            x = s.get(I[0])
            assert x[2] == "NHWC" and sorted(s.const(I[1])[1]) == [1, 2] and A(n, "keep_dims")
            s.emit("GlobalAveragePool", [x[0]], safe)
            s.T[nm] = (safe, x[1][:2] + [1, 1], x[2])
            return
        if op == "MaxPool":
            x = s.get(I[0])
            k, st = s.hw(A(n, "ksize")), s.hw(A(n, "strides"))
            assert A(n, "padding") == "VALID"
            p = x[3] if len(x) > 3 else [[0, 0]] * 4
            OH = (x[1][2] + sum(p[2]) - k[0]) // st[0] + 1
            OW = (x[1][3] + sum(p[3]) - k[1]) // st[1] + 1
            s.emit(
                "MaxPool",
                [x[0]],
                safe,
                kernel_shape=list(k),
                strides=list(st),
                pads=[p[2][0], p[3][0], p[2][1], p[3][1]],
            )
            s.T[nm] = (safe, x[1][:2] + [OH, OW], x[2])
            return
        if op == "ResizeBilinear":
            x = s.get(I[0])
            assert x[2] == "NHWC"
            h, w = list(s.const(I[1])[1])[:2]
            if s.upsample:
                h, w = x[1][2] * s.upsample, x[1][3] * s.upsample
            mode = (
                "half_pixel"
                if A(n, "half_pixel_centers")
                else ("align_corners" if A(n, "align_corners") else "asymmetric")
            )
            e = s.ini([0], array.array("f"), hint="roi")
            sc = s.ini([4], array.array("f", [1, 1, h / x[1][2], w / x[1][3]]), hint="scales")
            if s.opset > 10:
                s.emit("Resize", [x[0], e, sc], safe, mode="linear", coordinate_transformation_mode=mode)
            else:
                assert mode == "asymmetric"
                s.emit("Resize", [x[0], sc], safe, mode="linear")
            s.T[nm] = (safe, x[1][:2] + [int(h), int(w)], x[2])
            return
        if op == "ConcatV2":
            ax = s.const(I[-1])[1][0]
            xs = [s.get(i) for i in I[:-1]]
            tag = xs[0][2]
            assert all(x[2] == tag for x in xs)
            r = len(xs[0][1])
            ax = ax % r
            if tag == "NHWC":
                ax = [0, 2, 3, 1][ax]
            s.emit("Concat", [x[0] for x in xs], safe, axis=ax)
            d = list(xs[0][1])
            d[ax] = sum(x[1][ax] for x in xs)
            s.T[nm] = (safe, d, tag)
            return
        if op == "AddN":
            x = s.get(I[0])
            cur = x[0]
            for q, i in enumerate(I[1:]):
                o = safe if q == len(I) - 2 else "%s_%d" % (safe, q)
                s.emit("Add", [cur, s.get(i)[0]], o)
                cur = o
            s.T[nm] = (safe, x[1], x[2])
            return
        if op == "SplitV":
            x = s.get(I[0])
            sz = list(s.const(I[1])[1])
            ax = s.const(I[2])[1][0] % 4
            if x[2] == "NHWC":
                ax = [0, 2, 3, 1][ax]
            off = 0
            for q, z in enumerate(sz):
                o = "%s_%d" % (safe, q)
                s.emit("Slice", [x[0], s.i64([off]), s.i64([off + z]), s.i64([ax])], o)
                off += z
                d = list(x[1])
                d[ax] = z
                s.T[nm if q == 0 else "%s:%d" % (nm, q)] = (o, d, x[2])
            return
        if op == "Reshape":
            x = s.get(I[0])
            tgt = s.target(nm)
            if tgt is None:
                tgt = list(s.const(I[1])[1])
            if x[2] == "NHWC" and len(x[1]) == 4:
                s.emit("Transpose", [x[0]], safe + "_nhwc", perm=[0, 2, 3, 1])
                xn = safe + "_nhwc"
            else:
                xn = x[0]
            tot = 1
            for d in x[1]:
                tot *= d
            if -1 in tgt:
                k = 1
                for d in tgt:
                    if d != -1:
                        k *= d
                tgt = [tot // k if d == -1 else d for d in tgt]
            s.emit("Reshape", [xn, s.i64(tgt)], safe)
            s.T[nm] = (safe, tgt, "flat")
            return
        raise NotImplementedError("%s (%s)" % (op, nm))


def main():
    p = argparse.ArgumentParser()
    p.add_argument("model")
    p.add_argument("out")
    p.add_argument("--input", required=True)
    p.add_argument("--shape", required=True)
    p.add_argument("--tag", default="NHWC")
    p.add_argument("--output", action="append", default=[])
    p.add_argument("--reshape", action="append", default=[])
    p.add_argument("--opset", type=int, default=11)
    p.add_argument(
        "--upsample",
        type=int,
        default=0,
        help="every resize is xN: lets --shape differ from the exported size",
    )
    a = p.parse_args()
    nodes, W = load(a.model)
    c = Conv(nodes, W)
    c.opset = a.opset
    c.upsample = a.upsample
    shp = [int(x) for x in a.shape.split(",")]
    c.reshape_to = [(r.split("=")[0], [int(x) for x in r.split("=")[1].split(",")]) for r in a.reshape]
    c.T[a.input] = ("image", shp, a.tag)
    outs = []
    for o in a.output:
        tf, on = o.split("=")
        t = c.get(tf)
        c.emit("Identity", [t[0]], on)
        outs.append((on, t[1]))
        print(on, t[1], t[2])
    g = b"".join(f_len(1, x) for x in c.out) + f_len(2, "g") + b"".join(f_len(5, x) for x in c.init)
    g += f_len(11, vinfo("image", shp)) + b"".join(f_len(12, vinfo(*o)) for o in outs)
    m = f_var(1, 6) + f_len(2, "tfjs2onnx") + f_len(7, g) + f_len(8, f_var(2, a.opset))
    open(a.out, "wb").write(m)
    print(a.out, len(m), "bytes", len(c.out), "nodes")


main()
