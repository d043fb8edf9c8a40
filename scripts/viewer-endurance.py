#!/usr/bin/python3
"""Runs the viewer for an hour under Xvfb and watches its memory and its messages.

Every round of the script plays, scrubs, opens every panel, picks, undoes, turns, zooms, cuts, resizes, minimises,
switches looks, takes a picture and reopens the recording. Prints memory over time and the messages of the program,
OpenGL (Mesa) and VTK on stderr. Exits with 1 if there was a message, the program failed or its memory kept growing
(not checked under AddressSanitizer, which keeps freed memory).

    scripts/viewer-endurance.py out/desk --minutes 60
    scripts/viewer-endurance.py out/desk --minutes 60 --viewer build/asan/bin/sqslam-viewer
"""
import argparse
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WIDTH, HEIGHT = 1280, 720
SAMPLE_INTERVAL = 10.0  # s
TABLE_ROWS = 20
MAX_GROWTH = 0.1  # of the memory, from the second quarter of the time to the last
DRIVER = Path("/usr/lib/x86_64-linux-gnu/dri/swrast_dri.so")
LEAKS = ROOT / "scripts/leak-sanitizer-viewer.supp"


def click(x, y):
    return [f"move {x} {y}", "press left", "release left"]


def on_timeline(x):
    """Moves the mouse to a place of the timeline: beside the name of its first curve, in pixels."""
    return f"point {x} 0 tracked points"


def drag(button, x, y, dx, dy, steps=6):
    lines = [f"move {x} {y}", f"press {button}"]
    lines += [f"move {x + dx * i // steps} {y + dy * i // steps}" for i in range(1, steps + 1)]
    return lines + [f"release {button}"]


def one_round(recording, seed):
    chance = random.Random(seed)
    scene = lambda: (chance.randrange(150, 650), chance.randrange(120, 420))
    timeline = lambda: on_timeline(chance.randrange(120, 1130))
    lines = ["wait idle", "key Home", "wait idle", "key Space", "frames 90", "key Space", "wait idle"]
    for _ in range(20):
        lines += [timeline(), "press left", "release left", "wait idle"]
    lines += [on_timeline(120), "press left"] + [on_timeline(x) for x in range(150, 1021, 30)]
    lines += ["release left", "wait idle"]
    for text in ("Inspector", "View", "Picture", "Objects", "Boxes", "Outlines"):
        lines += [f"click {text}", "wait idle"]
    for _ in range(8):
        lines += click(*scene()) + ["frames 3"]
    lines += ["key Delete", "frames 2", "keydown Control", "key Z", "key Y", "key Z", "keyup Control"]
    for button in ("left", "middle", "right"):
        lines += drag(button, *scene(), chance.randrange(-80, 80), chance.randrange(-60, 60)) + ["wait idle"]
    for notch in (1, 1, -1, -1):
        lines += ["move {} {}".format(*scene()), f"wheel 0 {notch}", "wait idle"]
    for key in "1379FCXGP0XGPTIHHIT":
        lines += [f"key {key}", "frames 3"]
    lines += ["key Escape", "key Escape", "key 0", "wait idle"]
    lines += ["resize 900 560", "wait idle", "resize 0 0", "frames 20", f"resize {WIDTH} {HEIGHT}", "wait idle"]
    lines += ["picture window.png", "key F12", "wait idle"]
    return lines + [f"drop {recording}", "frames 10", "wait idle"]


def memory_mib(pid):
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    raise ProcessLookupError(pid)


def child_named(parent, name):
    """Id of a process below `parent` whose program has that name, or None."""
    found = subprocess.run(["ps", "-e", "-o", "pid=,ppid=,comm="], capture_output=True, text=True, check=True)
    rows = [line.split(None, 2) for line in found.stdout.splitlines()]
    below = {str(parent)}
    for _ in range(4):
        below |= {pid for pid, ppid, _ in rows if ppid in below}
    return next((int(pid) for pid, _, comm in rows if pid in below and name.startswith(comm)), None)


def sanitizers_of(viewer):
    linked = subprocess.run(["ldd", str(viewer)], capture_output=True, text=True, check=True).stdout
    return [line.split()[2] for line in linked.splitlines() if "libasan" in line]


def kept_driver(viewer):
    """Keeps the OpenGL driver loaded until the leak check, which cannot name functions of an unloaded driver."""
    sanitizers = sanitizers_of(viewer)
    return ["env", f"LD_PRELOAD={sanitizers[0]}:{DRIVER}"] if sanitizers and DRIVER.exists() else []


def play(viewer, recording, minutes, work):
    """Samples (seconds, MiB), exit code and what was written to stderr."""
    lines = [line for seed in range(3) for line in one_round(recording, seed)]
    (work / "script.txt").write_text("\n".join(lines + [f"repeat {int(minutes * 60)}", "close"]) + "\n")
    environment = dict(os.environ, MESA_DEBUG="1", XDG_CONFIG_HOME=str(work), XDG_CACHE_HOME=str(work),
                       XDG_STATE_HOME=str(work), XDG_DATA_HOME=str(work),
                       LSAN_OPTIONS=f"suppressions={LEAKS}:print_suppressions=0")
    inner = kept_driver(viewer) + [str(viewer), str(recording), "--resolution", f"{WIDTH},{HEIGHT}", "--play-events", "script.txt"]
    samples = []
    with open(work / "stderr.txt", "w", encoding="utf-8") as errors:
        process = subprocess.Popen(["xvfb-run", "-a", "-e", "xvfb.txt", "-s", f"-screen 0 {WIDTH}x{HEIGHT}x24"] + inner,
                                   cwd=work, env=environment, stderr=errors, start_new_session=True)
        start = time.monotonic()
        try:
            while process.poll() is None:
                time.sleep(SAMPLE_INTERVAL)
                pid = child_named(process.pid, viewer.name)
                if pid is not None:
                    samples.append((time.monotonic() - start, memory_mib(pid)))
                    print(f"\r{samples[-1][0] / 60:.1f} of {minutes} min, {samples[-1][1]:.0f} MiB ", end="",
                          file=sys.stderr, flush=True)
        except (ProcessLookupError, FileNotFoundError):
            process.wait()
        except KeyboardInterrupt:
            os.killpg(process.pid, signal.SIGTERM)
            process.wait()
    print(file=sys.stderr)
    return samples, process.returncode, (work / "stderr.txt").read_text(encoding="utf-8")


def growth(samples):
    """Growth of the median memory from the second quarter of the samples to the last; 0 with too few to tell.

    Memory grows in the first round, of about a minute, which shows every panel and picture once.
    """
    quarter = len(samples) // 4
    if quarter * SAMPLE_INTERVAL < 90.0:
        return 0.0
    memory = [mib for _, mib in samples]
    return statistics.median(memory[-quarter:]) / statistics.median(memory[quarter:2 * quarter]) - 1.0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("result", type=Path, help="result folder with a map.sqmap")
    parser.add_argument("--minutes", type=float, default=60.0, help="default: %(default)s")
    parser.add_argument("--viewer", type=Path, default=ROOT / "build/release/bin/sqslam-viewer", help="the program")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        samples, code, errors = play(arguments.viewer.resolve(), arguments.result.resolve(), arguments.minutes,
                                     Path(work))
    print("| minutes | MiB |\n| --- | --- |")
    for seconds, mib in samples[:: max(1, len(samples) // TABLE_ROWS)]:
        print(f"| {seconds / 60:.1f} | {mib:.0f} |")
    half = [mib for _, mib in samples[len(samples) // 2:]]
    grown = growth(samples)
    if half:
        print(f"\nsecond half: {min(half):.0f} to {max(half):.0f} MiB; {100 * grown:+.1f} % from the second quarter "
              f"to the last, at most {100 * MAX_GROWTH:.0f} expected")
    print(f"exit code {code}; {len(errors.splitlines())} lines on stderr")
    print(errors[:20000], end="")
    grows = grown > MAX_GROWTH and not sanitizers_of(arguments.viewer.resolve())
    sys.exit(1 if code != 0 or errors or grows else 0)


if __name__ == "__main__":
    main()
