#!/usr/bin/env python3
"""Checks names and commit subjects for words that a reader has to decode.

Fails, with one line per finding, if
  * a test case begins with Of, That, What, Is, Are, A, An or The instead of a verb (DoesXWhenY),
  * a constant is named by an adverb or a bare quantity (kHardly, kMostRounds, kFew) instead of what it bounds,
  * the subject of a commit is not `module: imperative` in 72 characters. Older commits are not checked.

slam/objects keeps its constants until it is rewritten.
"""
import re
import subprocess
import sys

SUBJECTS_SINCE = "395cebe6288f"  # the last commit in the former style
CASE = re.compile(r"^\s*TEST(?:_F|_P)?\((\w+),\s*((?:Of|That|What|Is|Are|A|An|The)(?=[A-Z0-9])\w*)\)", re.M)
ADVERBS = "Hardly|Barely|Rarely|Nearly|Almost|Mostly|Usually|Roughly|Enough|About|Most|Fewest|Few|Many|Some|Much"
CONSTANT = re.compile(rf"^.*\bconst(?:expr)? [^=(;]*?\b(k(?:(?:{ADVERBS})(?:[A-Z0-9]\w*)?|Least|None|Far|Near|Usual))"
                      r"\s*(?:=|\{|\[)", re.M)
SUBJECT = re.compile(r"[A-Za-z0-9_./-]+(?:, ?[A-Za-z0-9_./-]+)*: [A-Za-z]")


def git(*arguments):
    return subprocess.run(["git", *arguments], capture_output=True, text=True, check=False)


def find_names(pattern, group, advice, paths):
    for path in git("ls-files", *paths).stdout.split():
        text = open(path, encoding="utf-8").read()
        for match in pattern.finditer(text):
            line = text.count("\n", 0, match.start(group)) + 1
            yield f"{path}:{line}: {match.group(group)}: {advice}"


def find_subjects():
    log = git("log", "--no-merges", "--format=%h %s", f"{SUBJECTS_SINCE}..HEAD")
    if log.returncode != 0:
        print("check-words.py: commit subjects not checked: the history is incomplete", file=sys.stderr)
    for row in log.stdout.splitlines():
        commit, subject = row.split(" ", 1)
        if len(subject) > 72 or not SUBJECT.match(subject):
            yield f"commit {commit}: '{subject}': write 'module: imperative', at most 72 characters"


def main():
    findings = [
        *find_names(CASE, 2, "begin with a verb: DoesXWhenY", ["tests/*.cpp"]),
        *find_names(CONSTANT, 1, "name what it bounds", ["slam/*.h", "slam/*.cpp", "render/*.h", "render/*.cpp",
                                                         "app/*.h", "app/*.cpp", ":!slam/objects"]),
        *find_subjects(),
    ]
    print("\n".join([*findings, f"{len(findings)} findings"]))
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
