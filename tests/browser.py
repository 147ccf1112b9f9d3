"""A headless Chromium that a test drives over the DevTools protocol: mouse, keys, JavaScript, screenshots."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
from contextlib import contextmanager

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium (Debian's package chromium)")
HANG_S = 180.0
"""What takes longer hangs. Nothing is measured by it."""
_MODIFIERS = {"Alt": 1, "Control": 2, "Shift": 8}
_CODES = {
    **{"Enter": 13, "Escape": 27, "Backspace": 8, "Delete": 46, " ": 32, "Tab": 9},
    **{"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40},
}


class Tab:
    """A page of the browser. Anything that the page's scripts throw fails the next call."""

    def __init__(self, socket):
        self._socket = socket
        self._number = 0
        self._faults = []
        for domain in ("Page", "Runtime", "Log"):
            self.send(f"{domain}.enable")

    def send(self, method, **parameters):
        """The result of a DevTools command."""
        number = self._post(method, parameters)
        while True:
            message = json.loads(self._socket.recv())
            if message.get("method") == "Runtime.exceptionThrown":
                self._faults.append(message["params"]["exceptionDetails"]["exception"].get("description", message))
            if message.get("method") == "Page.javascriptDialogOpening":
                self._post("Page.handleJavaScriptDialog", {"accept": True})
            if message.get("id") == number and "method" not in message:
                assert "error" not in message, message
                assert not self._faults, self._faults
                return message["result"]

    def _post(self, method, parameters):
        """Send a command; its number."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        return self._number

    def open(self, url):
        """Go to an address, and wait until it is loaded."""
        self.send("Page.navigate", url=url)
        self.until("document.readyState === 'complete'")

    def size(self, width, height, dark=False):
        """Size of the window, and colours."""
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.send("Emulation.setEmulatedMedia", features=[scheme])

    def js(self, code):
        """The value of a JavaScript expression; a promise is waited for."""
        result = self.send("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def until(self, condition):
        """Wait until a JavaScript expression is true; its value."""
        end = time.monotonic() + HANG_S
        while not (value := self.js(condition)):
            assert time.monotonic() < end, f"waited in vain for {condition}"
            time.sleep(0.02)
        return value

    def press(self, key, *modifiers):
        """Press a key."""
        flags = sum(_MODIFIERS[name] for name in modifiers)
        text = {"Enter": "\r"}.get(key, key if len(key) == 1 and not flags & 3 else "")
        code = _CODES.get(key, ord(key.upper()) if len(key) == 1 else 0)
        event = {"key": key, "windowsVirtualKeyCode": code, "modifiers": flags}
        self.send("Input.dispatchKeyEvent", type="keyDown", text=text, **event)
        self.send("Input.dispatchKeyEvent", type="keyUp", **event)

    def type(self, text):
        """Type into what has the focus."""
        self.send("Input.insertText", text=text)

    def mouse(self, kind, x, y, modifiers=(), **more):
        """A mouse event: Moved, Pressed, Released or Wheel."""
        flags = sum(_MODIFIERS[name] for name in modifiers)
        self.send("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, modifiers=flags, **more)

    def click(self, x, y, *modifiers, count=1):
        """Click at a place of the window."""
        self.mouse("Moved", x, y, modifiers)
        for kind in ("Pressed", "Released"):
            self.mouse(kind, x, y, modifiers, button="left", clickCount=count)

    def drag(self, *places, modifiers=()):
        """Press at the first place, move over the others, release at the last one."""
        self.mouse("Moved", *places[0], modifiers)
        self.mouse("Pressed", *places[0], modifiers, button="left", buttons=1, clickCount=1)
        for place in places[1:]:
            self.mouse("Moved", *place, modifiers, button="left", buttons=1)
        self.mouse("Released", *places[-1], modifiers, button="left", clickCount=1)

    def click_on(self, selector):
        """Click on the middle of an element."""
        x, y = self.js(
            "(one => { one.scrollIntoView({block: 'nearest'});"
            " const {x, y, width, height} = one.getBoundingClientRect();"
            f" return [x + width / 2, y + height / 2]; }})(document.querySelector({json.dumps(selector)}))"
        )
        self.click(x, y)

    def screenshot(self, path):
        """Write a PNG of the window."""
        path.write_bytes(base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"]))


@contextmanager
def browser(folder, width=1440, height=900):
    """A tab of a new browser, whose profile is in `folder`."""
    from websocket import create_connection

    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--disable-dev-shm-usage"]
    place = ["--remote-debugging-port=0", f"--user-data-dir={folder / 'profile'}", "about:blank"]
    process = subprocess.Popen([CHROMIUM, *options, *place], stderr=subprocess.PIPE, text=True)
    try:
        line = next(line for line in process.stderr if "DevTools listening on " in line)
        whole = line.rpartition(" ")[2].strip()
        root = create_connection(whole, timeout=HANG_S, suppress_origin=True)
        root.send(json.dumps({"id": 1, "method": "Target.getTargets"}))
        targets = json.loads(root.recv())["result"]["targetInfos"]
        page = next(target["targetId"] for target in targets if target["type"] == "page")
        address = whole.partition("/devtools/")[0] + f"/devtools/page/{page}"
        tab = Tab(create_connection(address, timeout=HANG_S, suppress_origin=True))
        tab.size(width, height)
        yield tab
        root.send(json.dumps({"id": 2, "method": "Browser.close"}))
        process.wait(HANG_S)
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
