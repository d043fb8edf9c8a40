#!/usr/bin/env python3
"""Runs the commands of README.md's code blocks in order, on a short film of the desk.

Scripts are only checked for being there and executable, since they install and build; the viewer is expected to be
still open after a few seconds.

usage: readme_commands.py PROGRAM SOURCES DESK FOLDER
"""
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys


def commands(readme):
    for block in re.findall(r"^```\n(.*?)^```", readme, re.M | re.S):
        for line in block.splitlines():
            words = shlex.split(line, comments=True)
            if words and not line.startswith(("@", " ", "}", "export ")):  # a citation, a variable
                yield words


def main():
    program, sources, desk, folder = map(pathlib.Path, sys.argv[1:])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copytree(desk / "desk/rgb", folder / "film.mp4")  # a folder of images reads like a video
    environment = dict(os.environ, PATH=f"{program.parent}:{os.environ['PATH']}")
    count = 0
    for words in commands((sources / "README.md").read_text()):
        count += 1
        print("+", shlex.join(words), flush=True)
        if words[0].startswith("scripts/"):
            assert os.access(sources / words[0], os.X_OK), f"{words[0]} is missing or not executable"
        elif words[0] == "sqslam-viewer":
            if shutil.which("xvfb-run") and shutil.which("sqslam-viewer", path=environment["PATH"]):
                result = subprocess.run(["timeout", "15", "xvfb-run", "-a", *words], cwd=folder, env=environment)
                assert result.returncode == 124, f"the viewer ended with {result.returncode}"
        else:
            subprocess.run(words, cwd=folder, env=environment, check=True)
    assert count >= 5, f"only {count} commands found"
    for name in ("film.png", "film.html"):
        assert (folder / name).stat().st_size > 10000, f"{name} is not there or empty"


if __name__ == "__main__":
    main()
