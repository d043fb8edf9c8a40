#!/usr/bin/env python3
"""Opens a page from the disk in headless Chromium with software OpenGL, does what it is told, and prints what
it saw as JSON: {"console": [messages], "requests": [addresses loaded from elsewhere], "results": [of eval]}.

Usage: browser.py PAGE.html WIDTH,HEIGHT STEPS, with STEPS a JSON list of
  {"wait": JS, "seconds": N}   until the expression is true
  {"eval": JS}                 its value (awaited) goes into results
  {"click": [X, Y] or JS}      a real press and release of the mouse
  {"key": CODE, "seconds": N}  held so long
  {"drag": [X, Y, X2, Y2], "seconds": N}
  {"run": FILE.js}             a script from the disk
  {"media": {NAME: VALUE}}     a feature, such as prefers-reduced-motion
  {"touch": true}, {"size": [W, H]}, {"shot": FILE.png}
"""
import base64
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time


class Browser:
    """Chromium at the other end of two pipes (Chrome DevTools Protocol)."""

    def __init__(self, size, profile):
        to_chromium, self.output = os.pipe()
        self.input, from_chromium = os.pipe()

        def give_pipes():  # Chromium reads from 3 and writes to 4
            a, b = os.dup(to_chromium), os.dup(from_chromium)
            os.dup2(a, 3)
            os.dup2(b, 4)

        self.process = subprocess.Popen(
            ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--hide-scrollbars", "--disable-dev-shm-usage", "--no-first-run",
             "--force-device-scale-factor=1", "--remote-debugging-pipe", f"--user-data-dir={profile}",
             f"--window-size={size[0]},{size[1]}", "about:blank"],
            preexec_fn=give_pipes, close_fds=False, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        os.close(to_chromium)
        os.close(from_chromium)
        self.number, self.buffer, self.session = 0, b"", None
        self.console, self.requests, self.results = [], [], []

    def read(self):
        while b"\0" not in self.buffer:
            more = os.read(self.input, 1 << 20)
            if not more:
                raise RuntimeError("Chromium has ended")
            self.buffer += more
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.output, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.read()
            self.note(answer)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def note(self, message):
        parameters = message.get("params", {})
        text = parameters.get("entry", {}).get("text", "")
        if "GPU stall due to ReadPixels" in text:  # of the screenshots
            return
        if message.get("method") == "Runtime.consoleAPICalled":
            self.console.append(" ".join(str(a.get("value", a.get("description"))) for a in parameters["args"]))
        elif message.get("method") == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.console.append(details.get("exception", {}).get("description", details["text"]))
        elif message.get("method") == "Log.entryAdded":
            self.console.append(text)
        elif message.get("method") == "Network.requestWillBeSent":
            url = parameters["request"]["url"]
            if not url.startswith(("data:", "blob:")):
                self.requests.append(url)

    def evaluate(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return answer["result"].get("value")

    def open(self, page, size):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Page", "Network"):
            self.call(domain + ".enable")
        self.resize(size)
        self.call("Page.navigate", url=pathlib.Path(page).resolve().as_uri())

    def resize(self, size, mobile=False):
        self.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1,
                  mobile=mobile)

    def mouse(self, kind, x, y, held=True):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1,
                  buttons=1 if held else 0)

    def do(self, step):
        if "wait" in step:
            end = time.time() + step.get("seconds", 60)
            while not self.evaluate(step["wait"]):
                if time.time() > end:
                    raise RuntimeError("not so in time: " + step["wait"] + "; console: " + repr(self.console))
                time.sleep(0.05)
        elif "eval" in step:
            self.results.append(self.evaluate(step["eval"]))
        elif "run" in step:
            self.evaluate(pathlib.Path(step["run"]).read_text(encoding="utf-8") + "; 0")
        elif "media" in step:
            self.call("Emulation.setEmulatedMedia",
                      features=[{"name": name, "value": value} for name, value in step["media"].items()])
        elif "click" in step:
            place = self.evaluate(step["click"]) if isinstance(step["click"], str) else step["click"]
            self.mouse("mouseMoved", *place, held=False)
            self.mouse("mousePressed", *place)
            self.mouse("mouseReleased", *place, held=False)
        elif "drag" in step:
            x, y, x2, y2 = step["drag"]
            begin, seconds = time.time(), step.get("seconds", 1)
            self.mouse("mousePressed", x, y)
            while (share := (time.time() - begin) / seconds) < 1:
                self.mouse("mouseMoved", x + share * (x2 - x), y + share * (y2 - y))
                time.sleep(0.01)
            self.mouse("mouseReleased", x2, y2, held=False)
        elif "key" in step:
            self.call("Input.dispatchKeyEvent", type="keyDown", code=step["key"], key=step["key"])
            time.sleep(step.get("seconds", 0))
            self.call("Input.dispatchKeyEvent", type="keyUp", code=step["key"], key=step["key"])
        elif "size" in step:
            self.resize(step["size"], step.get("mobile", False))
            time.sleep(0.5)
        elif "shot" in step:
            whole = step.get("whole", False)
            shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
            pathlib.Path(step["shot"]).write_bytes(base64.b64decode(shot["data"]))

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def main():
    page, size, steps = sys.argv[1], [int(n) for n in sys.argv[2].split(",")], json.loads(sys.argv[3])
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(size, profile)
        try:
            browser.open(page, size)
            for step in steps:
                browser.do(step)
        finally:
            browser.close()
    print(json.dumps({"console": browser.console, "requests": browser.requests, "results": browser.results}))


if __name__ == "__main__":
    main()
