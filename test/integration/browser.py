#!/usr/bin/env python3
"""Opens a page in Chromium without a screen, in several tabs at once if asked, waits until UNTIL is true in
each (or two minutes have passed), and prints one JSON object: {"tabs": [value of EXPRESSION in every tab]}. Talks
to the browser over a pair of pipes. A browser that goes away or does not answer is no word on the page: it is
started anew, three times at most, and each such end is told on standard error.

usage: browser.py URL [--width N] [--height N] [--tabs N] [--dark] [--until JS] [--expression JS]
                  [--screenshot FILE.png]    (of the whole page, in the first tab)
"""
import argparse
import base64
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time

PAGE_S = 120  # for the page to come to UNTIL
ANSWER_S = 60  # for the browser to answer one question
STARTS = 3


class BrowserGone(Exception):
    pass


class Browser:
    def __init__(self, profile):
        self.words = open(os.path.join(profile, "stderr.txt"), "w+b")
        name = next(n for n in ("chromium", "chromium-browser", "google-chrome") if shutil.which(n))
        to_browser, self.out = os.pipe()
        self.input, from_browser = os.pipe()

        def place_pipes():  # Chromium reads descriptor 3 and writes descriptor 4
            os.dup2(to_browser, 10), os.dup2(from_browser, 11)
            os.dup2(10, 3), os.dup2(11, 4)

        self.process = subprocess.Popen(
            [name, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
             "--hide-scrollbars", "--remote-debugging-pipe", f"--user-data-dir={profile}", "about:blank"],
            preexec_fn=place_pipes, close_fds=False, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=self.words, env={**os.environ, "HOME": profile})
        os.close(to_browser), os.close(from_browser)
        self.buffer, self.number = b"", 0

    def ask(self, method, session=None, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        try:
            os.write(self.out, json.dumps(message).encode() + b"\0")
        except BrokenPipeError:
            raise BrowserGone(f"{method}: the browser went away") from None
        end = time.monotonic() + ANSWER_S
        while True:
            while b"\0" in self.buffer:
                text, self.buffer = self.buffer.split(b"\0", 1)
                answer = json.loads(text)
                if answer.get("id") == self.number:
                    if "error" in answer:
                        raise RuntimeError(f"{method}: {answer['error']}")
                    return answer["result"]
            if not select.select([self.input], [], [], max(0.0, end - time.monotonic()))[0]:
                raise BrowserGone(f"{method}: no answer from the browser in {ANSWER_S} s")
            more = os.read(self.input, 1 << 20)
            if not more:
                raise BrowserGone(f"{method}: the browser went away")
            self.buffer += more

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.out), os.close(self.input)

    def last_words(self):
        self.words.seek(0)
        return self.words.read()[-2000:].decode(errors="replace")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("url")
    parser.add_argument("--width", type=int, default=1200)
    parser.add_argument("--height", type=int, default=900)
    parser.add_argument("--until", default="document.readyState === 'complete'")
    parser.add_argument("--tabs", type=int, default=1)
    parser.add_argument("--dark", action="store_true")
    parser.add_argument("--expression", default="document.documentElement.outerHTML")
    parser.add_argument("--screenshot")
    a = parser.parse_args()
    for start in range(1, STARTS + 1):
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            browser = Browser(profile)
            try:
                values = look(browser, a)
            except BrowserGone as gone:
                browser.close()
                print(f"start {start}: {gone}\n{browser.last_words()}", file=sys.stderr)
                continue
            browser.close()
            json.dump({"tabs": values}, sys.stdout)
            return 0
    return 1


def look(browser, a):
    tabs = []
    for _ in range(a.tabs):
        target = browser.ask("Target.createTarget", url="about:blank", newWindow=True)["targetId"]
        tab = browser.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        browser.ask("Emulation.setDeviceMetricsOverride", tab, width=a.width, height=a.height,
                    deviceScaleFactor=1, mobile=a.width < 700)
        if a.dark:
            browser.ask("Emulation.setEmulatedMedia", tab,
                        features=[{"name": "prefers-color-scheme", "value": "dark"}])
        browser.ask("Page.navigate", tab, url=a.url)
        tabs.append(tab)

    def evaluate(tab, expression):
        answer = browser.ask("Runtime.evaluate", tab, expression=expression, returnByValue=True)
        return answer["result"].get("value")

    end = time.monotonic() + PAGE_S
    while time.monotonic() < end and not all(evaluate(tab, a.until) for tab in tabs):
        time.sleep(0.2)
    if time.monotonic() >= end:
        print(f"the page did not come to {a.until} in {PAGE_S} s", file=sys.stderr)
    values = [evaluate(tab, a.expression) for tab in tabs]
    if a.screenshot:
        size = browser.ask("Page.getLayoutMetrics", tabs[0])["cssContentSize"]
        picture = browser.ask("Page.captureScreenshot", tabs[0], format="png", captureBeyondViewport=True,
                              clip={"x": 0, "y": 0, "width": a.width, "height": size["height"], "scale": 1})
        with open(a.screenshot, "wb") as file:
            file.write(base64.b64decode(picture["data"]))
    return values


if __name__ == "__main__":
    sys.exit(main())
