"""A headless Chromium, driven through chromedriver by the WebDriver protocol (W3C)."""

import base64
import json
import os
import re
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from contextlib import suppress
from pathlib import Path

from conftest import PATIENCE

DRIVER = shutil.which("chromedriver")


def _browser():
    """Return the browser with the version of chromedriver: a machine may have several browsers."""
    if DRIVER is None:
        return None
    found = [path for name in ("chromium", "google-chrome", "chromium-browser")
             if (path := shutil.which(name))]
    if len(found) < 2:
        return found[0] if found else None
    versions = [re.search(r" (\d+)\.", subprocess.run([path, "--version"], capture_output=True,
                                                      text=True).stdout)
                for path in (DRIVER, *found)]
    return next((path for path, version in zip(found, versions[1:], strict=True)
                 if version and versions[0] and version[1] == versions[0][1]), None)


BROWSER = _browser()


# Clicks on all buttons that save, and returns the files that they offer.
SAVED = """
const done = arguments[0];
window.saved = [];
URL.createObjectURL = (blob) => { saved.push(blob); return "#main"; };
const buttons = [...document.querySelectorAll("button.save")];
for (const button of buttons) button.click();
const read = (blob) => new Promise((kept) => {
  const reader = new FileReader();
  reader.onload = () => kept([blob.type, reader.result.split(",")[1]]);
  reader.readAsDataURL(blob);
});
const wait = () => saved.length < buttons.length ? setTimeout(wait, 50)
  : Promise.all(saved.map(read)).then(done);
wait();"""


class Browser:
    """A browser with one window, for use in a `with` statement."""

    def __init__(self, folder):
        self.log = Path(folder, "driver.log")
        with self.log.open("w") as log:
            self.driver = subprocess.Popen(
                [DRIVER, "--port=0"], stdout=log, stderr=subprocess.DEVNULL,
                env={**os.environ, "HOME": str(folder)})
        try:
            self._wait()
            options = {"binary": BROWSER, "args": [
                "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                "--hide-scrollbars", "--no-first-run", "--disable-extensions",
                "--disable-background-networking", f"--user-data-dir={folder}/profile"]}
            answer = self._send("POST", "/session", {"capabilities": {"alwaysMatch": {
                "browserName": "chrome", "goog:chromeOptions": options,
                "goog:loggingPrefs": {"browser": "ALL"}}}})
            self.session = f"/session/{answer['sessionId']}"
        except BaseException:
            self.driver.kill()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with suppress(OSError):
            self._send("DELETE", self.session)
        self.driver.terminate()
        self.driver.wait(PATIENCE)

    def _wait(self):
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            if port := re.search(r"successfully on port (\d+)", self.log.read_text()):
                self.root = f"http://127.0.0.1:{port[1]}"
                with suppress(OSError):
                    if self._send("GET", "/status")["ready"]:
                        return
            time.sleep(0.05)
        raise TimeoutError("chromedriver does not answer")

    def _send(self, method, path, body=None):
        request = urllib.request.Request(
            self.root + path, method=method,
            data=None if body is None else json.dumps(body).encode(),
            headers={"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(error.read().decode()) from None

    def call(self, method, path, body=None):
        """Send a command of the session."""
        return self._send(method, self.session + path, body)

    def chrome(self, command, **parameters):
        """Send a command of the Chrome DevTools protocol."""
        return self.call("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def window(self, width, height, dark=False, touch=False):
        """Set the size of the window and the theme of the system."""
        self.chrome("Emulation.setDeviceMetricsOverride", width=width, height=height,
                    deviceScaleFactor=1, mobile=touch)
        self.chrome("Emulation.setTouchEmulationEnabled", enabled=touch)
        self.chrome("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def open(self, path):
        """Open a file."""
        self.call("POST", "/url", {"url": path.resolve().as_uri()})

    def run(self, script, *arguments):
        """Run a script and return its result."""
        return self.call("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def actions(self, *sources):
        """Perform pointer or key actions."""
        self.call("POST", "/actions", {"actions": list(sources)})
        self.call("DELETE", "/actions")

    def press(self, *keys):
        """Press keys one after the other in the element that has the focus."""
        self.actions({"type": "key", "id": "keys", "actions": [
            {"type": kind, "value": key} for key in keys for kind in ("keyDown", "keyUp")]})

    def drag(self, start, end, kind="mouse"):
        """Press a pointer at a point of the window, move it and release it."""
        self.actions({"type": "pointer", "id": "pointer", "parameters": {"pointerType": kind},
                      "actions": [
            {"type": "pointerMove", "duration": 0, "x": round(start[0]), "y": round(start[1])},
            {"type": "pointerDown", "button": 0},
            {"type": "pointerMove", "duration": 60, "x": round(end[0]), "y": round(end[1])},
            {"type": "pointerUp", "button": 0}]})

    def saved(self):
        """Click on all buttons that save; return the texts and the pictures."""
        self.call("POST", "/timeouts", {"script": 1000 * PATIENCE})
        found = self.call("POST", "/execute/async", {"script": SAVED, "args": []})
        files = {kind: [base64.b64decode(data) for each, data in found if each == kind]
                 for kind in ("text/csv", "image/png")}
        return [text.decode() for text in files["text/csv"]], files["image/png"]

    def console(self):
        """Return the messages of the console since the last call."""
        return [entry["message"] for entry in
                self.call("POST", "/se/log", {"type": "browser"})
                if entry["level"] in ("WARNING", "SEVERE")]

    def picture(self, path):
        """Write a picture of the whole page."""
        size = self.chrome("Page.getLayoutMetrics")["cssContentSize"]
        data = self.chrome("Page.captureScreenshot", captureBeyondViewport=True, clip={
            "x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1})
        path.write_bytes(base64.b64decode(data["data"]))
