"""A headless Chromium, for tests of pages; and their scripts alone, in Node where it is installed."""

import base64
import html
import json
import shutil
import subprocess
import time
import urllib.request

import numpy as np

NODE = shutil.which("node")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
_FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-port=0",
)  # fmt: skip


def evaluated(scripts, expression, folder):
    """Return the value of an expression that these scripts can compute without a page."""
    program = "\n".join((*scripts, f"const evaluated = JSON.stringify({expression});"))
    if NODE:
        command, program = [NODE, "-"], f"{program}\nconsole.log(evaluated);"
    else:
        page = folder / "page.html"
        shown = "document.querySelector('pre').textContent = evaluated;"
        page.write_text(f"<pre></pre><script>{program}\n{shown}</script>", encoding="utf-8")
        command = [CHROMIUM, *_FLAGS[:-1], f"--user-data-dir={folder / 'profile'}", "--dump-dom", page.as_uri()]
    done = subprocess.run(command, input=program, capture_output=True, encoding="utf-8", timeout=60, check=True).stdout
    return json.loads(done if NODE else html.unescape(done.partition("<pre>")[2].partition("</pre>")[0]))


class Browser:
    """A headless Chromium with one tab, driven through the DevTools protocol."""

    def __init__(self, folder):
        from websocket import create_connection

        self.downloads, profile = folder / "downloads", folder / "profile"
        command = [CHROMIUM, *_FLAGS, f"--user-data-dir={profile}", "about:blank"]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port = self._wait(lambda: (profile / "DevToolsActivePort").read_text().split()[0], (OSError, IndexError))
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
            tab = next(tab for tab in json.load(answer) if tab["type"] == "page")
        self._socket = create_connection(tab["webSocketDebuggerUrl"], timeout=60, suppress_origin=True)
        self._number, self.errors = 0, []
        self.requests = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(self.downloads))

    @staticmethod
    def _wait(ready, errors=()):
        for _ in range(600):
            try:
                if found := ready():
                    return found
            except errors:
                pass
            time.sleep(0.05)
        raise TimeoutError("Chromium did not do it within 30 s")

    def call(self, method, **parameters):
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv())
            if message.get("id") == self._number:
                assert "error" not in message, message["error"]
                return message["result"]
            self._note(message)

    def _note(self, message):
        values = message["params"]
        if message["method"] == "Network.requestWillBeSent":
            self.requests.append(values["request"]["url"])
        elif message["method"] == "Runtime.exceptionThrown":
            self.errors.append(values["exceptionDetails"])
        elif message["method"] == "Runtime.consoleAPICalled" and values["type"] in ("error", "assert"):
            self.errors.append(values["args"])
        elif message["method"] == "Log.entryAdded" and values["entry"]["level"] == "error":
            self.errors.append(values["entry"])

    def js(self, expression):
        """The value of an expression, or of the promise that it is."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def open(self, path, width=1300, height=900, address=""):
        self.errors.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=path.as_uri() + address)
        self._wait(lambda: self.js("Boolean(window.explore)"))
        self.js("explore.ready")

    def until(self, expression):
        self._wait(lambda: self.js(expression))

    def click(self, x, y):
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            time.sleep(0.15)  # hover first, as a hand does: plotly finds what is under the pointer then
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def key(self, name):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=name, code=name)

    def colours(self, selector):
        """Return the number of different colours in a part of the page."""
        from io import BytesIO

        from matplotlib.image import imread

        place = self.js(f"(() => {{ const r = document.querySelector({selector!r}).getBoundingClientRect();"
                        "return {x: r.x, y: r.y, width: r.width, height: r.height, scale: 1}; })()")  # fmt: skip
        picture = self.call("Page.captureScreenshot", format="png", clip=place)["data"]
        pixels = (imread(BytesIO(base64.b64decode(picture)))[..., :3] * 255).round().astype(int)
        return len(np.unique(pixels @ [1, 256, 65536]))

    def downloaded(self, name):
        """Return what the page gave to be saved, and remove the file, so that another of its name can come."""
        path = self.downloads / name
        self._wait(lambda: path.exists() and path.stat().st_size)
        content = path.read_bytes()
        path.unlink()
        return content

    def close(self):
        self._socket.close()
        self._process.terminate()
        self._process.wait(20)
