# SPDX-License-Identifier: GPL-3.0-or-later
"""A browser driven over the WebDriver protocol (W3C), with Python's standard library alone."""
import base64
import json
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # key of an element reference in the protocol


def missing():
    """Names of the missing programs, or an empty text."""
    return " and ".join(name for name in ("chromium", "chromedriver") if not shutil.which(name))


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class CannotStart(RuntimeError):
    """The browser is installed but cannot run here, for example without shared memory."""


# Without a graphics card four samples per pixel take twice as long as one.
ROUGH = """{const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function(kind, options) {
  return get.call(this, kind, kind.startsWith('webgl') ? {...options, antialias: false} : options); };}"""


class Browser:
    """Headless Chromium with a window of width x height pixels; rough: 3-D pictures without antialiasing."""

    def __init__(self, width, height, rough=False):
        port = free_port()
        self.driver = subprocess.Popen(["chromedriver", f"--port={port}"], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
        self.base = f"http://127.0.0.1:{port}"
        try:
            self._begin(width, height)
            if rough:
                self._order("Page.addScriptToEvaluateOnNewDocument", {"source": ROUGH})
        except RuntimeError as error:
            self.driver.kill()
            self.driver.wait()
            raise CannotStart(str(error).splitlines()[0]) from None

    def _begin(self, width, height):
        self._await_driver()
        options = {"args": ["--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
                            "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--force-device-scale-factor=1"]}
        answer = self._call("POST", "/session", {"capabilities": {"alwaysMatch": {
            "browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}})
        self.session = "/session/" + answer["sessionId"]
        self.resize(width, height)

    def _await_driver(self):
        for _ in range(100):
            try:
                self._call("GET", "/status")
                return
            except OSError:
                time.sleep(0.1)
        raise RuntimeError("chromedriver does not answer")

    def _call(self, method, path, body=None):
        data = json.dumps(body).encode() if method == "POST" else None
        request = urllib.request.Request(self.base + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=120) as reply:
                return json.load(reply)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"]) from None

    def close(self):
        try:
            self._call("DELETE", self.session)
        finally:
            self.driver.terminate()
            self.driver.wait()

    def resize(self, width, height):
        self._order("Emulation.setDeviceMetricsOverride",
                    {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600})

    def darken(self):
        """Switches the page to the dark colour scheme."""
        self._order("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]})

    def _order(self, command, parameters):
        """Sends a command of Chromium that the protocol does not define."""
        self._call("POST", self.session + "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def open(self, url):
        self._call("POST", self.session + "/url", {"url": url})

    def run(self, script, *arguments):
        """Runs JavaScript and gives the value of its `return`; a promise is awaited."""
        return self._call("POST", self.session + "/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, script, *arguments, seconds=60):
        """Waits until the script's value is true, and returns that value."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            value = self.run(script, *arguments)
            if value:
                return value
            time.sleep(0.1)
        raise AssertionError(f"after {seconds} s still not: {script}")

    def pointer(self, *actions):
        """Performs mouse actions in the format of the protocol."""
        self._call("POST", self.session + "/actions", {"actions": [
            {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": list(actions)}]})

    @staticmethod
    def move(x, y, milliseconds=0):
        return {"type": "pointerMove", "duration": milliseconds, "x": round(x), "y": round(y), "origin": "viewport"}

    def click_at(self, x, y):
        """Clicks the left button at a point of the window."""
        self.pointer(self.move(x, y), {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0})

    def press_and_drag(self, start, end, steps=4):
        """Drags with the left button and keeps it pressed."""
        self.pointer(self.move(*start), {"type": "pointerDown", "button": 0},
                     *[self.move(*[p + (q - p) * k / steps for p, q in zip(start, end)], 30) for k in range(1, steps + 1)])

    def release(self):
        self.pointer({"type": "pointerUp", "button": 0})

    def choose_files(self, selector, *paths):
        """Chooses files for a file input."""
        found = self._call("POST", self.session + "/element", {"using": "css selector", "value": selector})
        self._call("POST", f"{self.session}/element/{found[ELEMENT]}/value", {"text": "\n".join(map(str, paths))})

    def settle(self):
        """Waits until the page has drawn."""
        self.run("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")

    def click(self, selector):
        """Scrolls to the element of a CSS selector and clicks on it."""
        box = self.run("const e = document.querySelector(arguments[0]); if (!e) { return null; }"
                       "e.scrollIntoView({block: 'center'}); const b = e.getBoundingClientRect();"
                       "return [b.left + b.width / 2, b.top + b.height / 2];", selector)
        assert box, f"there is no {selector}"
        self.click_at(*box)

    def press(self, *keys):
        """Presses keys one after the other; the keys of a tuple are pressed together."""
        steps = []
        for key in keys:
            together = key if isinstance(key, tuple) else (key,)
            steps += [{"type": "keyDown", "value": k} for k in together]
            steps += [{"type": "keyUp", "value": k} for k in reversed(together)]
        self._call("POST", self.session + "/actions", {"actions": [{"type": "key", "id": "keys", "actions": steps}]})

    def picture(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self._call("GET", self.session + "/screenshot")))

    def complaints(self):
        """The errors in the browser's console."""
        entries = self._call("POST", self.session + "/se/log", {"type": "browser"})
        return [entry["message"] for entry in entries if entry["level"] in ("SEVERE", "ERROR")]
