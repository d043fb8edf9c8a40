#!/usr/bin/env python3
"""Checks the dependencies between the modules of slam/, render/ and app/. A module is a folder of sources.

Fails, with one line per finding, if
  * modules include each other in a cycle,
  * a file violates the layers: slam/ must not include render/ or app/, render/ must not include app/,
  * a file includes a header of a target that its own target does not link, directly or through public
    dependencies,
  * a file includes a header of another project whose library its target does not name,
  * a library names a library of this project that none of its files includes,
  * a source belongs to no target, or a target names a source that does not exist,
  * two files of one target define the same name in an anonymous namespace, or an alias with two meanings,
    since sources are compiled in groups.

usage: scripts/check-modules.py [--only PREFIX] [--graph]
"""
import argparse
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LAYERS = ("slam", "render", "app")  # each may include those before it

# Headers of other projects (the first matching pattern counts), and the libraries that provide them.
FOREIGN = [
    (r"(unsupported/)?Eigen/", ["Eigen3::Eigen"]),
    (r"opencv2/aruco", ["opencv_aruco"]),
    (r"opencv2/(\w+)", ["opencv_{}"]),
    (r"fmt/", ["fmt::fmt"]),
    (r"spdlog/", ["spdlog::spdlog"]),
    (r"yaml-cpp/", ["yaml-cpp"]),
    (r"nlohmann/", ["nlohmann_json::nlohmann_json"]),
    (r"ceres/", ["Ceres::ceres"]),
    (r"(vtk\w*\.h|vtk_glew)", ["${VTK_LIBRARIES}"]),
    (r"sqlite3\.h", ["SQLite::SQLite3"]),
    (r"zlib\.h", ["ZLIB::ZLIB"]),
    (r"CLI/", ["CLI11::CLI11"]),
    (r"boost/", ["Boost::headers", "Boost::boost"]),
    (r"nanoflann", ["nanoflann::nanoflann"]),
    (r"libexif/", ["PkgConfig::EXIF"]),
    (r"lib(av\w+|swscale)/", ["PkgConfig::FFMPEG", "PkgConfig::VIDEO_CONTAINERS"]),
    (r"cairo", ["${CAIRO_LIBRARY}"]),
    (r"onnxruntime", ["${ONNXRUNTIME_LIBRARY}"]),
]
# Their types stand in public headers: the public dependencies of what a target links count as well.
EVERYWHERE = {"Eigen3::Eigen", "opencv_core"}


class Target:
    def __init__(self, name):
        self.name = name
        self.sources = set()
        self.links = {}  # library: whether whoever links this target gets it too
        self.is_library = False


def cmake_calls(path):
    text = re.sub(r"#[^\n]*", "", path.read_text())
    for match in re.finditer(r"(\w+)\s*\(([^()]*)\)", text):
        yield match.group(1), match.group(2).split()


def sections(words, keys):
    """Splits words at the keys: those before the first under None."""
    parts = collections.defaultdict(list)
    key = None
    for word in words:
        if word in keys:
            key = word
        else:
            parts[key].append(word)
    return parts


def read_targets():
    targets = {}
    for path in sorted(ROOT.glob("slam/**/CMakeLists.txt")) + sorted(ROOT.glob("render/**/CMakeLists.txt")) + \
            sorted(ROOT.glob("app/**/CMakeLists.txt")):
        folder = path.parent
        for call, words in cmake_calls(path):
            if call == "sqslam_library":
                parts = sections(words[1:], {"SOURCES", "DEPENDS"})
                target = targets.setdefault("sqslam_" + words[0], Target("sqslam_" + words[0]))
                target.is_library = True
                target.sources |= {str((folder / s).relative_to(ROOT)) for s in parts["SOURCES"]}
                target.links.update({library: True for library in parts["DEPENDS"]})
            elif call in ("add_executable", "add_library", "pybind11_add_module", "target_sources"):
                target = targets.setdefault(words[0], Target(words[0]))
                target.sources |= {str((folder / s).relative_to(ROOT)) for s in words[1:] if s.endswith(".cpp")}
            elif call == "target_link_libraries":
                target = targets.setdefault(words[0], Target(words[0]))
                for key, libraries in sections(words[1:], {"PUBLIC", "PRIVATE", "INTERFACE"}).items():
                    target.links.update({library: key != "PRIVATE" for library in libraries})
    return targets


def closure(target, targets):
    """All that the target's files may include: what it links, and what these pass on."""
    reached = set()
    waiting = [target.name] + list(target.links)
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            if name in targets:
                waiting += [library for library, public in targets[name].links.items() if public]
    return reached


class Files:
    """Sources, what they include, and the targets that they belong to."""

    def __init__(self, targets):
        self.targets = targets
        self.text = {}
        for layer in LAYERS:
            for path in sorted((ROOT / layer).rglob("*")):
                if path.suffix in (".h", ".cpp"):
                    self.text[str(path.relative_to(ROOT))] = path.read_text()
        self.of_source = collections.defaultdict(set)
        of_folder = collections.defaultdict(set)
        for target in targets.values():
            for source in target.sources:
                self.of_source[source].add(target.name)
                of_folder[module(source)].add(target.name)
        self.owners = {}
        for file in self.text:
            same_stem = self.of_source.get(file) or self.of_source.get(re.sub(r"\.h$", ".cpp", file))
            self.owners[file] = same_stem or of_folder[module(file)]

    def includes(self, file):
        for number, line in enumerate(self.text[file].splitlines(), 1):
            match = re.match(r'\s*#include\s+(?:"([^"]+)"|<([^>]+)>)', line)
            if match:
                yield number, match.group(1), match.group(2)


def module(file):
    return str(pathlib.PurePosixPath(file).parent)


def find_cycles(edges):
    """Strongly connected groups of more than one module (Tarjan)."""
    index, low, stack, on_stack, groups = {}, {}, [], set(), []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        on_stack.add(node)
        for other in sorted(edges.get(node, ())):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in on_stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            group = []
            while not group or group[-1] != node:
                group.append(stack.pop())
                on_stack.discard(group[-1])
            if len(group) > 1:
                groups.append(sorted(group))

    for node in sorted(edges):
        if node not in index:
            visit(node)
    return groups


def shortened(places):
    return "; ".join(places[:4]) + (f"; and {len(places) - 4} more" if len(places) > 4 else "")


def check_cycles(files):
    edges = collections.defaultdict(lambda: collections.defaultdict(list))
    for file in files.text:
        for number, own, _ in files.includes(file):
            if own in files.text and module(own) != module(file):
                edges[module(file)][module(own)].append(f"{file}:{number} includes {own}")
    findings = []
    for group in find_cycles(edges):
        lines = [f"cycle of modules: {' <-> '.join(group)}"]
        for a in group:
            for b in group:
                reasons = edges[a].get(b, [])
                if reasons:
                    lines.append(f"    {a} -> {b} ({len(reasons)}): " + shortened(reasons))
        findings.append("\n".join(lines))
    return findings, edges


def check_layers(files):
    findings = []
    for file in files.text:
        allowed = LAYERS[:LAYERS.index(file.split("/")[0]) + 1]
        for number, own, _ in files.includes(file):
            layer = own.split("/")[0] if own else None
            if layer in LAYERS and layer not in allowed:
                findings.append(f"{file}:{number}: {file.split('/')[0]}/ includes {own}")
            elif layer in LAYERS and own not in files.text:
                findings.append(f"{file}:{number}: {own} does not exist")
    return findings


def foreign_libraries(header):
    for pattern, libraries in FOREIGN:
        match = re.match(pattern, header)
        if match:
            word = match.group(1) if match.groups() else ""
            return [library.format(word) if "{}" in library else library for library in libraries]
    return []


def check_links(files, targets):
    missing = collections.defaultdict(list)  # (target, text): places
    used = collections.defaultdict(set)
    reach = {name: closure(target, targets) for name, target in targets.items()}
    for file in files.text:
        for owner in sorted(files.owners[file]):
            for number, own, foreign in files.includes(file):
                if own in files.text:
                    providers = files.owners[own]
                    used[owner] |= providers
                    if providers and not providers & reach[owner] and module(own) != module(file):
                        missing[owner, f"does not link {' or '.join(sorted(providers))}"].append(
                            f"{file}:{number} includes {own}")
                elif foreign or own:
                    libraries = foreign_libraries(foreign or own)
                    named = targets[owner].links
                    if libraries and not any(library in named or library in EVERYWHERE and library in reach[owner]
                                             for library in libraries):
                        missing[owner, f"does not name {libraries[0]}"].append(
                            f"{file}:{number} includes <{foreign or own}>")
    findings = [f"{owner} {text}: " + shortened(places) for (owner, text), places in sorted(missing.items())]
    for name, target in sorted(targets.items()):
        for library in target.links if target.is_library else ():
            if library in targets and targets[library].is_library and library not in used[name]:
                findings.append(f"{name} names {library}, but none of its files includes a header of it")
    return findings


def check_sources(files, targets):
    named = set().union(*(target.sources for target in targets.values()))
    sources = {file for file in files.text if file.endswith(".cpp")}
    return [f"{file}: belongs to no target" for file in sorted(sources - named)] + \
        [f"{file}: is named by a target, but does not exist" for file in sorted(named - sources)]


def strip_comments(text):
    """The text with comments, strings and characters blanked; lines stay where they are."""
    pattern = r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\''
    return re.sub(pattern, lambda m: "\n" * m.group(0).count("\n") or " ", text, flags=re.DOTALL)


def anonymous_blocks(text):
    for match in re.finditer(r"\bnamespace\s*\{", text):
        depth, end = 1, match.end()
        while depth > 0 and end < len(text):
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        yield text[match.end():end - 1]


def without_bodies(text):
    """Declarations at the outermost level: what stands between braces is left out."""
    kept, depth = [], 0
    for character in text:
        depth -= character == "}"
        if depth == 0:
            kept.append(";" if character == "}" else character)
        depth += character == "{"
    return "".join(kept)


def defined_names(text):
    """Names that anonymous namespaces define, each with the kinds of its parameters (functions only)."""
    for block in anonymous_blocks(text):
        block = re.sub(r"^\s*#[^\n]*", "", block, flags=re.MULTILINE)
        for statement in without_bodies(block).split(";"):
            statement = " ".join(statement.replace("{", " ").split())
            statement = re.sub(r"^template ?<.*?> (?=\w|\[)", "", statement)
            statement = re.sub(r"^requires .*?\) ", "", statement)
            statement = re.sub(r"\[\[\w+\]\] ?", "", statement)
            match = re.match(r"(?:struct|class|union|enum(?: class| struct)?) (\w+)", statement)
            if match and "(" not in statement:
                yield match.group(1), None
                continue
            match = re.match(r"using (\w+) =", statement)
            if match:
                yield match.group(1), None
                continue
            match = re.match(r"using ([\w:]+)::(\w+)$", statement)
            if match:  # the same in several files is one meaning
                yield match.group(2), "using " + match.group(1)
                continue
            match = re.match(r"(?:[\w:<>,&*\[\] ]+?[ &*>])([A-Za-z_]\w*) ?\((.*)\)", statement)
            if match and not re.match(r"(?:inline |static )?constexpr\b.*=", statement.split("(")[0]):
                yield match.group(1), re.sub(r"\s*\b\w+( = [^,]*)?(?=,|$)", "", match.group(2))
                continue
            match = re.match(r"(?:[\w:<>,&*() ]+[ &*>])(\w+)(?:\[\w*\])? ?(?:=.*)?$", statement.split(" = ")[0])
            if match and match.group(1) not in ("const", "noexcept"):
                yield match.group(1), None


def check_groups(files, targets):
    findings = []
    for name, target in sorted(targets.items()):
        places = collections.defaultdict(list)
        aliases = collections.defaultdict(dict)
        for source in sorted(target.sources & set(files.text)):
            text = strip_comments(files.text[source])
            for defined in set(defined_names(text)):
                places[defined[0]].append((source, defined[1]))
            for match in re.finditer(r"^(?:using|namespace) (\w+) = ([^;{]+);", text, flags=re.MULTILINE):
                aliases[match.group(1)].setdefault(" ".join(match.group(2).split()), source)
        for word, found in sorted(places.items()):
            kinds = collections.defaultdict(set)
            for source, kind in found:
                kinds[kind].add(source)
            borrowed = {kind for kind in kinds if kind and kind.startswith("using ")}
            if None in kinds or borrowed and len(kinds) > 1:
                clash = set().union(*kinds.values())
            elif borrowed:
                clash = set()
            else:
                clash = set().union(*(sources for sources in kinds.values() if len(sources) > 1), set())
            if len(clash) > 1:
                findings.append(f"{name}: '{word}' is defined by {', '.join(sorted(clash))}")
        for word, meanings in sorted(aliases.items()):
            if len(meanings) > 1:
                findings.append(f"{name}: the alias '{word}' has several meanings: " +
                                "; ".join(f"{meaning} in {source}" for meaning, source in meanings.items()))
    return findings


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="findings in which this text stands, such as slam/")
    parser.add_argument("--graph", action="store_true", help="print what each module includes")
    arguments = parser.parse_args()

    targets = read_targets()
    files = Files(targets)
    cycles, edges = check_cycles(files)
    if arguments.graph:
        for name in sorted(edges):
            print(f"{name}: {' '.join(sorted(edges[name]))}")
    findings = cycles + check_layers(files) + check_links(files, targets) + \
        check_sources(files, targets) + check_groups(files, targets)
    findings = [finding for finding in findings if arguments.only in finding]
    print("\n".join(findings + [f"{len(findings)} findings in {len(files.text)} files"]))
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
