#!/usr/bin/python3
"""Writes docs/options.md: key, default, range and meaning of every pipeline option, from the option structs.

    scripts/list-options.py            # writes it
    scripts/list-options.py --check    # exits with 1 if it is out of date
"""
import argparse
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/options.md"
INTRO = """# Pipeline options

```
sqslam run data/desk --set objects.method=paper --set tracking.features.num_features=1500
sqslam run data/desk --config mine.yaml      # any of these keys, nested as in configs/default.yaml
sqslam run data/desk --dump-config           # the values in effect
```

`scripts/list-options.py` makes this page from the option structs. Lengths are in map units unless a unit is given; px
are pixels of the image as mapped. A key that does not exist is an error that names the nearest one.
"""


def sources():
    return {path: path.read_text() for path in sorted((ROOT / "slam").rglob("*.h"))}


def read_structs(texts):
    """By name: the comment above, the fields {name: (type, comment)}, the visited {key: (field, arguments)}."""
    structs = {}
    for text in texts:
        for match in re.finditer(r"((?:^//[^\n]*\n)*)^struct (\w+)(?: : (\w+))? \{\n(.*?)^\};", text, re.M | re.S):
            about, name, base, body = match.groups()
            members, _, visits = body.partition("void VisitFields")
            inherited = structs[base][1] if base in structs else {}
            structs[name] = (sentence(about), {**inherited, **read_fields(members)}, read_visits(visits))
    return structs


def sentence(comment):
    return re.sub(r"\s+", " ", re.sub(r"^\s*//", "", comment, flags=re.M)).strip()


def read_fields(members):
    fields, above, statement, beside, last = {}, [], "", "", ""
    for line in members.splitlines():
        code, _, comment = line.partition("//")
        code, comment = code.strip(), comment.strip()
        if not code and line.startswith("   ") and last:  # goes on beside the field above
            fields[last] = (fields[last][0], f"{fields[last][1]} {comment}")
            continue
        if not code and not statement:
            above = [*above, comment] if comment else []
            last = ""
            continue
        statement += " " + code
        beside += " " + comment
        if not statement.endswith((";", "}")):
            continue
        found = re.match(r" ([\w:<>, ]+?) (\w+)( = .*|\{.*)?;$", statement)
        last = found[2] if found else ""
        if found:
            fields[last] = (found[1], joined(above, beside.strip()))
        above, statement, beside = [], "", ""
    return fields


def joined(above, beside):
    """A comment above a field, and what is added beside it."""
    above = " ".join(above)
    return f"{above.rstrip('.:')}; {beside}" if above and beside else above or beside


def read_visits(text):
    return {m[1]: (m[2], m[3] or "") for m in re.finditer(r'visit\("(\w+)",\s*(\w+)(?:,\s*([^;]*?))?\);', text, re.S)}


def read_enums(texts):
    """By name: the comment above, and the words."""
    enums = {}
    for text in texts:
        abouts = {m[2]: sentence(m[1]) for m in re.finditer(r"((?:^//[^\n]*\n)*)^enum class (\w+)", text, re.M)}
        for match in re.finditer(r"^constexpr auto EnumNames\((\w+)\) (\{.*?\}\n)(?![ }])", text, re.M | re.S):
            listed = re.findall(r'"([^"]+)"', match[2]) or re.findall(r'^    \{"([^"]+)",', text, re.M)
            enums[match[1]] = (abouts.get(match[1], ""), listed)
    return enums


def allowed(kind, arguments, enums):
    if kind in enums:
        return ", ".join(enums[kind][1])
    if kind == "bool":
        return "true, false"
    numbers = re.sub(r"std::\w+\{(\d+)\}", r"\1", arguments).replace("1 << 62", "2^62")
    parts = [p.strip() for p in numbers.split(",")]
    words = re.findall(r'"([^"]+)"', arguments)
    if words:
        return ", ".join(words)
    return f"{shown(parts[0])} to {shown(parts[1])}" if len(parts) == 2 else ""


def shown(number):
    return re.sub(r"\.0$", "", number)


def read_defaults(text):
    """By dotted key, as written in configs/default.yaml."""
    defaults, groups = {}, []
    for line in text.splitlines():
        key, _, value = line.strip().partition(":")
        groups = groups[: (len(line) - len(line.lstrip())) // 2] + [key]
        defaults[".".join(groups)] = value.strip().strip("[]") or "none"
    return defaults


def rows(struct, defaults, prefix, known, enums, missing):
    """Of a struct's own values, then a section for each group below it."""
    about, fields, visits = known[struct]
    table, groups = [], []
    for key, (field, arguments) in visits.items():
        kind, comment = fields[field]
        if kind in known:
            groups += rows(kind, defaults, f"{prefix}{key}.", known, enums, missing)
            continue
        comment = joined([enums[kind][0]], comment) if kind in enums else comment
        if not comment:
            missing.append(prefix + key)
        cells = [f"`{key}`", defaults[prefix + key], allowed(kind, arguments, enums), comment]
        table.append("| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |")
    title = f"## `{prefix[:-1]}`" if prefix else "## The run"
    head = [title] + ([about] if about and prefix else [])
    if not table:
        return ["\n".join(head)] + groups if about and prefix else groups
    return ["\n".join([*head, "", "| key | default | values | meaning |", "| --- | --- | --- | --- |", *table])] + groups


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    texts = sources().values()
    defaults = read_defaults((ROOT / "configs/default.yaml").read_text())
    missing = []
    page = INTRO + "\n" + "\n\n".join(
        rows("SystemOptions", defaults, "", read_structs(texts), read_enums(texts), missing)) + "\n"
    for key in missing:
        print(f"{key}: its field has no comment")
    if not arguments.check:
        PAGE.write_text(page)
    elif not PAGE.exists() or PAGE.read_text() != page:
        print(f"{PAGE}: out of date, run scripts/list-options.py")
        return 1
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
