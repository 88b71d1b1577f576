"""A headless Chromium by the WebDriver protocol, in the few words that tests need (https://www.w3.org/TR/webdriver2/)."""

import base64
import contextlib
import io
import json
import re
import shutil
import subprocess
import time
import urllib.request

import numpy as np
from PIL import Image

DRIVERS, BROWSERS = ("chromedriver",), ("chromium", "chromium-browser", "google-chrome", "chrome")
ARGUMENTS = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--hide-scrollbars", "--force-device-scale-factor=1"]
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"         # the protocol's key of a reference
KEYS = {"left": "\ue012", "right": "\ue014", "up": "\ue013", "down": "\ue015", "home": "\ue011", "end": "\ue010"}


def found(names):
    """The first of these programs that is on PATH; None if there is none."""
    return next((path for name in names if (path := shutil.which(name))), None)


class Browser:
    """One window. A context manager: the browser and its driver end with it."""

    def __init__(self):
        self.driver = subprocess.Popen([found(DRIVERS), "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        port = next(match[1] for line in self.driver.stdout if (match := re.search(r"successfully on port (\d+)", line)))
        self.base = f"http://127.0.0.1:{port}/session"
        wanted = {"browserName": "chrome", "goog:chromeOptions": {"binary": found(BROWSERS), "args": ARGUMENTS},
                  "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"}}
        self.base += "/" + self._call("POST", "", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]
        self.resize(640, 360)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with contextlib.suppress(OSError):
            self._call("DELETE", "")
        self.driver.terminate()
        self.driver.wait(30)
        self.driver.stdout.close()

    def _call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.base + path, data, {"Content-Type": "application/json"}, method=method)
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(request, timeout=300) as answer:
            return json.load(answer)["value"]

    def resize(self, width, height, mobile=False):
        """Show so many pixels, of a phone or of a screen."""
        self._call("POST", "/goog/cdp/execute", {"cmd": "Emulation.setDeviceMetricsOverride", "params": {
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile}})

    def open(self, url):
        """Load a page, and wait until it has drawn something or told of trouble."""
        self._call("POST", "/url", {"url": "about:blank"})
        self._call("POST", "/url", {"url": url})
        self.wait(lambda: self.state("frame") is not None or not self.script("return document.getElementById('trouble').hidden"))

    def script(self, text, *arguments):
        return self._call("POST", "/execute/sync", {"script": text, "args": list(arguments)})

    def state(self, name):
        """What the page says of itself: time, frame, playing."""
        return self.script("return document.body.dataset[arguments[0]] ?? null", name)

    def wait(self, condition, seconds=240):
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, "the page did not get there"
            time.sleep(0.05)

    def click(self, selector):
        element = self._call("POST", "/element", {"using": "css selector", "value": selector})[ELEMENT]
        self._call("POST", f"/element/{element}/click", {})

    def keys(self, *names):
        """Press and release keys, by name or as letters."""
        pressed = [KEYS.get(name, name) for name in names]
        self._act({"type": "key", "id": "keyboard", "actions": [
            {"type": kind, "value": key} for key in pressed for kind in ("keyDown", "keyUp")]})

    def drag(self, *paths, kind="mouse", button=0):
        """Move pointers of a kind, all at once, each along its path [(x, y), ...] with a button or finger down."""
        def steps(path):
            moves = [{"type": "pointerMove", "duration": 40 * bool(k), "x": x, "y": y} for k, (x, y) in enumerate(path)]
            return [moves[0], {"type": "pointerDown", "button": button}, *moves[1:], {"type": "pointerUp", "button": button}]

        self._act(*({"type": "pointer", "id": f"{kind} {number}", "parameters": {"pointerType": kind}, "actions": steps(path)}
                    for number, path in enumerate(paths)))

    def scroll(self, x, y, amount):
        self._act({"type": "wheel", "id": "wheel", "actions": [
            {"type": "scroll", "x": x, "y": y, "deltaX": 0, "deltaY": amount, "duration": 0}]})

    def _act(self, *sources):
        self._call("POST", "/actions", {"actions": list(sources)})
        self.script("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def picture(self):
        """(height, width, 3) pixels of the window, after all that was asked for is drawn."""
        self.script("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        with Image.open(io.BytesIO(base64.b64decode(self._call("GET", "/screenshot")))) as image:
            return np.asarray(image.convert("RGB")).astype(float)

    def log(self, kind):
        """Entries since the last call: `browser` (the console) or `performance` (the protocol's events)."""
        return self._call("POST", "/se/log", {"type": kind})

    def requests(self):
        """Addresses asked for since the last call."""
        events = [json.loads(entry["message"])["message"] for entry in self.log("performance")]
        return [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]
