#!/usr/bin/env python3
"""The page of `consac twin view` in a real browser: Chromium without a window, WebGL in software. Moves sliders and compares the page's pose
with `consac twin fk`; clicks, hovers and turns; lets a model play. Run by `make test-slow` where Chromium is installed; says so and
ends where it is not. Pictures go into FOLDER, for people to look at.

    python3 tests/slow/viewer_page.py build/viewer"""
import base64
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONSAC = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/release")).resolve() / "cli/consac"
YUMI = ROOT / "examples/robots/yumi/yumi_description/urdf"
ARM = ROOT / "examples/robots/low_cost_robot_arm"
DEADLINE = 60.0  # s that anything may take
REACH = ["--algo", "sac", "--steps", "8000", "--seed", "1", "--set", "replay_buffer_class=HerReplayBuffer", "gamma=0.95", "learning_rate=1e-3", "learning_starts=1000",
         "net_arch=[64,64]", "norm_obs=true"]
HOW = ["--headless=new", "--remote-debugging-pipe", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--use-gl=angle",
       "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=1280,800", "--hide-scrollbars"]


class Browser:
    """Chromium, told what to do through a pipe (its DevTools protocol: JSON that ends with a zero byte)."""

    def __init__(self, program, profile):
        to_browser, self.to = os.pipe()
        self.of, from_browser = os.pipe()

        def take_pipes():  # the browser reads descriptor 3 and writes descriptor 4
            held = os.dup(to_browser), os.dup(from_browser)
            os.dup2(held[0], 3)
            os.dup2(held[1], 4)

        self.process = subprocess.Popen([program, *HOW, f"--user-data-dir={profile}", "about:blank"], preexec_fn=take_pipes, close_fds=False,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.number, self.rest, self.told, self.session = 0, b"", [], None

    def ask(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters} | ({"sessionId": self.session} if self.session else {})
        os.write(self.to, json.dumps(message).encode() + b"\0")
        while True:
            message = self.read()
            if message.get("id") == self.number:
                if "error" in message:
                    raise AssertionError(f"{method}: {message['error']}")
                return message["result"]
            self.told.append(message)

    def read(self):
        while b"\0" not in self.rest:
            piece = os.read(self.of, 1 << 20)
            if not piece:
                raise AssertionError("the browser has ended")
            self.rest += piece
        line, self.rest = self.rest.split(b"\0", 1)
        return json.loads(line)

    def open(self, url):
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")
        self.ask("Emulation.setDeviceMetricsOverride", width=1280, height=800, deviceScaleFactor=1, mobile=False)
        self.ask("Page.navigate", url=url)

    def value(self, expression):
        result = self.ask("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            raise AssertionError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait(self, expression):
        """Until it is true on the page, as often as the page draws."""
        end = time.monotonic() + DEADLINE
        while not (value := self.value(expression)):
            if time.monotonic() > end:
                raise AssertionError(f"never came: {expression}; the page says {self.value('document.getElementById(`error`).textContent')!r}")
            self.value("new Promise(requestAnimationFrame).then(() => 0)")
        return value

    def mouse(self, kind, x, y, **more):
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def picture(self, path, **options):
        self.value("new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame)).then(() => 0)")
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot", **({"format": "png"} | options))["data"]))

    def end(self):
        self.ask("Browser.close")
        self.process.wait(DEADLINE)


class Served:
    """`consac twin view` on a free port."""

    def __init__(self, folder, *arguments):
        port_file = folder / "port"
        port_file.unlink(missing_ok=True)
        self.process = subprocess.Popen([CONSAC, "twin", "view", *map(str, arguments), "--port", "0", "--port-file", port_file], stdout=subprocess.DEVNULL, cwd=folder)
        end = time.monotonic() + DEADLINE
        while not port_file.exists():
            assert self.process.poll() is None and time.monotonic() < end, "the viewer did not begin"
            time.sleep(0.01)
        self.url = f"http://127.0.0.1:{port_file.read_text().strip()}/"

    def end(self):
        self.process.terminate()
        assert self.process.wait(DEADLINE) == 130, "stopped as if by Ctrl-C"


def consac(folder, *arguments):
    return subprocess.run([CONSAC, *map(str, arguments)], cwd=folder, check=True, capture_output=True, text=True).stdout


def check_pose(browser, folder, said):
    """What the page shows of its link is what `consac twin fk` says for the positions of the sliders."""
    exact = json.loads(browser.wait("document.getElementById('pose').dataset.exact"))
    given = "--q=" + ",".join(repr(value) for value in exact["positions"])
    row = json.loads(consac(folder, "twin", "fk", "yumi", "--link", exact["link"], "--json", given))[0]
    apart = max(abs(a - b) for name in ("position", "rotation") for a, b in zip(exact[name], row[name], strict=True))
    assert apart < 1e-12, f"{said}: {apart} apart"
    shown = [float(number) for number in browser.value("document.getElementById('position').textContent").split()]
    assert max(abs(a - b) for a, b in zip(shown, row["position"], strict=True)) < 6e-5, f"{said}: the page shows {shown}"
    return exact


def move(browser, joint, degrees):
    """A slider, as a hand moves it; waits for the pose of just that position."""
    browser.value(f"""(() => {{ const slider = document.getElementById('joint {joint}'); slider.value = {degrees};
                  slider.dispatchEvent(new Event('input', {{bubbles: true}})); }})()""")
    place = browser.value(f"[...document.querySelectorAll('input[type=range]')].findIndex(slider => slider.id === 'joint {joint}')")
    browser.wait(f"Math.abs(JSON.parse(document.getElementById('pose').dataset.exact).positions[{place}] - {math.radians(degrees)}) < 1e-9")


def try_page(browser, folder, pictures, url):
    browser.open(url)
    browser.wait("document.body?.dataset.ready === 'yes'")
    begin = check_pose(browser, folder, "at the beginning")
    for joint, degrees in (("yumi_joint_1_r", 40), ("yumi_joint_2_r", -60), ("yumi_joint_3_r", 25), ("yumi_joint_1_l", -40), ("yumi_joint_2_l", -90), ("yumi_joint_5_l", 70)):
        move(browser, joint, degrees)
        check_pose(browser, folder, joint)
    browser.value("document.getElementById('link').value = 'yumi_link_7_r'; document.getElementById('link').dispatchEvent(new Event('change'))")
    moved = check_pose(browser, folder, "a chosen link")
    assert moved["link"] == "yumi_link_7_r" and moved["position"] != begin["position"]
    browser.picture(pictures / "moved.png")
    browser.value("document.getElementById('axes').click()")
    browser.picture(pictures / "axes.png")

    names = set()
    for x in range(560, 1100, 90):
        for y in range(160, 700, 90):
            browser.mouse("mouseMoved", x, y)
            if browser.value("!document.getElementById('hover').hidden"):
                names.add((browser.value("document.getElementById('hover').textContent"), x, y))
    links = {name for name, _, _ in names}
    assert "yumi_body" in links and len(links) >= 4, f"the mouse meets only {links}"
    name, x, y = sorted(names)[-1]
    browser.mouse("mouseMoved", x, y)
    browser.picture(pictures / "hover.png")
    for kind in ("mousePressed", "mouseReleased"):
        browser.mouse(kind, x, y, button="left", buttons=1, clickCount=1)
    browser.wait(f"document.getElementById('link').value === '{name}'")
    check_pose(browser, folder, "a clicked link")

    browser.mouse("mousePressed", 900, 700, button="left", buttons=1, clickCount=1)
    browser.mouse("mouseMoved", 700, 620, button="left", buttons=1)
    browser.mouse("mouseReleased", 700, 620, button="left", buttons=0, clickCount=1)
    browser.mouse("mouseWheel", 800, 400, deltaX=0, deltaY=-200)
    browser.picture(pictures / "turned.png")
    browser.value("document.getElementById('reset').click()")
    browser.wait("JSON.parse(document.getElementById('pose').dataset.exact).positions.every(value => value === 0)")
    check_pose(browser, folder, "zero pose")


def try_model(browser, folder, pictures, url):
    browser.open(url)
    browser.wait("document.body?.dataset.ready === 'yes' && !document.getElementById('play').hidden")
    ready = browser.value("document.getElementById('told').textContent")
    assert "stands, episode 1, step 0" in ready, ready
    browser.value("document.getElementById('start').click()")
    browser.wait("/episode [3-9]/.test(document.getElementById('told').textContent)")
    browser.value("document.getElementById('pause').click()")
    browser.wait("/stands/.test(document.getElementById('told').textContent)")
    browser.wait("JSON.parse(document.getElementById('pose').dataset.exact).positions.some(value => Math.abs(value) > 0.1)")
    check_pose(browser, folder, "as the model left it")
    browser.picture(pictures / "model.png")
    browser.value("document.getElementById('again').click()")
    browser.wait("/stands, episode 1, step 0/.test(document.getElementById('told').textContent)")


def chosen(browser) -> str:
    return browser.value("document.querySelector('#list .chosen')?.textContent ?? ''")


def fill(browser, **fields):
    for field, text in fields.items():
        browser.value(f"document.getElementById('hint-{field}').value = {json.dumps(text)}")


def press_and_reload(browser, button):
    browser.value("document.body.dataset.ready = 'old'")
    browser.value(f"document.getElementById('hint-{button}').click()")
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        try:
            if browser.value("document.body?.dataset.ready === 'yes'"):
                return
        except AssertionError as left:  # the page that was asked has just gone
            assert "navigated" in str(left) or "context" in str(left), left
    raise AssertionError(f"{button}: the page says {browser.value('document.getElementById(`error`).textContent')!r}")


def try_candidates(browser, folder, pictures, url):
    """Axes of a STEP file's candidates: one clicked, taken with limits, another rejected; what is saved imports."""
    hints = folder / "picked.json"
    sliders = "document.querySelectorAll('#joints input').length"
    browser.open(url)
    browser.wait("document.body?.dataset.ready === 'yes' && !document.getElementById('candidates').hidden")
    assert not hints.exists() and browser.value(sliders) == 2
    for x, y in ((x, y) for y in range(160, 700, 20) for x in range(600, 1240, 25)):
        for kind in ("mousePressed", "mouseReleased"):
            browser.mouse(kind, x, y, button="left", buttons=1, clickCount=1)
        if chosen(browser):
            break
    assert chosen(browser), "no click meets an axis"
    browser.picture(pictures / "candidates.png")
    browser.value("document.querySelector('#list button').click()")
    assert "joint_1" in chosen(browser), chosen(browser)
    fill(browser, name="turntable", lower="-170", upper="160.5")
    press_and_reload(browser, "take")
    (joint,) = json.loads(hints.read_text(encoding="utf-8"))["joints"]
    assert joint["name"] == "turntable" and all(abs(a - math.radians(b)) < 1e-12 for a, b in zip(joint["limit"], (-170, 160.5), strict=True)), joint
    assert browser.value(sliders) == 2 and browser.value("document.getElementById('joint turntable') !== null")
    browser.value("[...document.querySelectorAll('#list button')].find(row => row.textContent.includes('connector v6:1 – XL-430_new v1:2')).click()")
    fill(browser, name="elbow")
    press_and_reload(browser, "reject")
    assert browser.value(sliders) == 1, "what is rejected turns no more"
    kept = hints.read_bytes()
    browser.value("document.querySelector('#list button').click()")
    fill(browser, lower="5", upper="-5")
    browser.value("document.getElementById('hint-take').click()")
    browser.wait("/lower limit is above its upper one/.test(document.getElementById('error').textContent)")
    browser.picture(pictures / "refused.png")
    stolen = "fetch('/hints', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify({token: 'x', hints: {}})}).then(answer => answer.status)"
    assert browser.value(stolen) == 403
    assert hints.read_bytes() == kept, "what is refused changes nothing"
    consac(folder, "twin", "import", ARM / "arm.step", "--hints", hints, "-o", "picked")


def main() -> int:
    pictures = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/viewer").resolve()
    program = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
    if program is None:
        print("viewer page: no Chromium is installed (apt-get install chromium), so no browser has seen it")
        return 0
    pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        folder = pathlib.Path(scratch)
        consac(folder, "twin", "import", YUMI / "yumi_calibrated.urdf", "-o", "yumi", "--srdf", YUMI / "yumi.srdf")
        consac(folder, "train", "yumi-reach-v0", "--name", "reach", "--no-progress", "--no-table", *REACH)
        browser = Browser(program, folder / "profile")
        try:
            shown = [(try_page, ["yumi"]), (try_model, ["yumi", "--model", "reach"])]
            if (CONSAC.parent / "consac-cad").exists():
                shown.append((try_candidates, [ARM / "arm.step", "--hints", "picked.json"]))
            for part, arguments in shown:
                served = Served(folder, *arguments)
                try:
                    part(browser, folder, pictures, served.url)
                finally:
                    served.end()
        except BaseException:
            browser.process.kill()
            raise
        faults = [message for message in browser.told if message.get("method") == "Runtime.exceptionThrown"
                  or message.get("method") == "Log.entryAdded" and message["params"]["entry"]["level"] == "error"
                  and not message["params"]["entry"].get("url", "").endswith("/hints")]  # those are refused on purpose
        asked = {message["params"]["request"]["url"].split("/")[2].split(":")[0] for message in browser.told if message.get("method") == "Network.requestWillBeSent"
                 and message["params"]["request"]["url"].startswith("http")}
        browser.end()
    assert not faults, faults
    assert asked == {"127.0.0.1"}, f"the page asked {asked}"
    print(f"viewer page: every pose as `consac twin fk` says it; pictures are in {pictures}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
