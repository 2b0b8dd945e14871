"""Debian's Chromium, driven over a pipe by the DevTools protocol: no other package is needed."""
import base64
import json
import os
import pathlib
import select
import shutil
import subprocess
import tempfile
import time

PROGRAM = shutil.which("chromium")


class Navigated(AssertionError):
    """The browser left the page while it evaluated an expression there."""


class Chromium:
    """One page of a headless browser."""

    def __init__(self, width=1280, height=900, dark=False, phone=False):
        self.folder = tempfile.TemporaryDirectory(prefix="chromium.")
        to_read, self.to_write = os.pipe()
        self.from_read, from_write = os.pipe()

        def inherit():  # it reads from descriptor 3 and writes to 4; the daemon comes first
            os.nice(10)
            low, high = os.dup(to_read), os.dup(from_write)
            os.dup2(low, 3), os.dup2(high, 4)

        self.process = subprocess.Popen(
            [PROGRAM, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe",
             "--disable-background-networking", "--no-first-run", f"--user-data-dir={self.folder.name}/profile"],
            pass_fds=(3, 4, to_read, from_write), preexec_fn=inherit, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env=dict(os.environ, HOME=self.folder.name))
        os.close(to_read), os.close(from_write)
        self.rest, self.last_id, self.events = b"", 0, []
        self.session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=2 if phone else 1, mobile=phone)
        if dark:
            self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])

    def close(self):
        self.process.kill()
        self.process.wait()
        os.close(self.to_write), os.close(self.from_read)
        time.sleep(0.1)
        shutil.rmtree(self.folder.name, ignore_errors=True)
        self.folder._finalizer.detach()

    def call(self, method, **params):
        self.last_id += 1
        message = {"id": self.last_id, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.to_write, data):]
        end = time.monotonic() + 30
        while time.monotonic() < end:
            for answer in self.receive(0.2):
                if answer.get("id") == message["id"]:
                    if "navigated or closed" in answer.get("error", {}).get("message", ""):
                        raise Navigated(f"{method}: {answer['error']}")
                    if "error" in answer:
                        raise AssertionError(f"{method}: {answer['error']}")
                    return answer["result"]
        raise AssertionError(f"the browser does not answer to {method}")

    def receive(self, timeout):
        if not select.select([self.from_read], [], [], timeout)[0]:
            return []
        data = os.read(self.from_read, 1 << 20)
        if not data:
            raise AssertionError("the browser has ended")
        *whole, self.rest = (self.rest + data).split(b"\0")
        messages = [json.loads(one) for one in whole]
        self.events += [one for one in messages if "method" in one]
        return messages

    def open(self, url):
        self.call("Page.navigate", url=url)
        self.until(f"location.href === {json.dumps(url)} && document.readyState !== 'loading'")

    def value(self, expression):
        """The value of a JavaScript expression in the page."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise AssertionError(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def text(self, selector):
        return self.value(f"document.querySelector({json.dumps(selector)})?.innerText ?? null")

    def until(self, expression, timeout=20):
        """The first true value of the expression, on this page or on the one it leads to."""
        end = time.monotonic() + timeout
        while True:
            try:
                value = self.value(expression)
            except Navigated:
                value = None
            if value:
                return value
            if time.monotonic() > end:
                raise AssertionError(f"never true: {expression}\n{self.value('document.body.innerText')[:3000]}")
            time.sleep(0.05)

    def trouble(self):
        """What the page complained of: exceptions, refused by the policy, failed requests."""
        self.receive(0)
        found = []
        for event in self.events:
            if event["method"] == "Runtime.exceptionThrown":
                found.append(str(event["params"]["exceptionDetails"])[:500])
            if event["method"] == "Log.entryAdded" and event["params"]["entry"]["level"] == "error":
                found.append(event["params"]["entry"]["text"])
        return found

    def requested(self):
        return [event["params"]["request"]["url"] for event in self.events
                if event["method"] == "Network.requestWillBeSent"]

    def picture(self, path, whole=True, kind="png"):
        quality = {} if kind == "png" else {"quality": 80}
        self.call("Emulation.setScrollbarsHidden", hidden=True)
        data = self.call("Page.captureScreenshot", format=kind, captureBeyondViewport=whole, **quality)["data"]
        pathlib.Path(path).write_bytes(base64.b64decode(data))
