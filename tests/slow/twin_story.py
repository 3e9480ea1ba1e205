#!/usr/bin/env python3
"""From a STEP file to a trained reach, as docs/twin.md tells it: its commands, one after the other, and a picture of each step in a real
browser (Chromium without a window). Fails where a step does. Where Chromium or consac-cad is not, it says so and ends.

    python3 tests/slow/twin_story.py FOLDER        # where twin-step-1.png and the others go; those of the page are docs/images"""
import json
import pathlib
import re
import shutil
import sys
import tempfile

from viewer_page import ARM, CONSAC, Browser, Served, chosen, consac, move

TRAIN = ["--algo", "sac", "--steps", "8000", "--seed", "1", "--set", "replay_buffer_class=HerReplayBuffer", "gamma=0.95", "learning_rate=1e-3",
         "learning_starts=1000", "net_arch=[64,64]", "norm_obs=true"]


def page(browser, folder, arguments, picture, act):
    """Opens the viewer, does something there, takes the picture."""
    served = Served(folder, *arguments)
    try:
        browser.open(served.url)
        browser.ask("Emulation.setDeviceMetricsOverride", width=1060, height=620, deviceScaleFactor=1, mobile=False)
        browser.wait("document.body?.dataset.ready === 'yes'")
        act(browser)
        browser.picture(picture)
    finally:
        served.end()


def farther(browser):
    """The camera goes back a bit."""
    browser.mouse("mouseWheel", 700, 320, deltaX=0, deltaY=240)


def look_at_a_candidate(browser):
    browser.wait("!document.getElementById('candidates').hidden")
    browser.value("document.querySelector('#list button').click()")
    assert "joint_1" in chosen(browser), chosen(browser)


def see_what_hints_say(browser):
    assert browser.value("document.querySelectorAll('#joints input').length") == 3, "the hints make joint 3"
    browser.value("document.getElementById('axes').checked || document.getElementById('axes').click()")


def bend(browser):
    for joint, degrees in (("joint_1", -35), ("joint_2", 30), ("joint_3", 25)):
        move(browser, joint, degrees)
    farther(browser)
    browser.value("document.getElementById('joints').scrollIntoView({block: 'end'})")


def play(browser):
    browser.wait("!document.getElementById('play').hidden")
    farther(browser)
    browser.value("document.getElementById('start').click()")
    browser.wait("/episode [3-9]/.test(document.getElementById('told').textContent)")
    browser.wait("/step (4[0-9]|3[0-9])/.test(document.getElementById('told').textContent)")
    browser.value("document.getElementById('pause').click()")
    browser.wait("/stands/.test(document.getElementById('told').textContent)")


def main() -> int:
    pictures = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/viewer").resolve()
    program = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
    if program is None or not (CONSAC.parent / "consac-cad").exists():
        print("twin story: no Chromium (apt-get install chromium) or no consac-cad (tools/setup.sh cad), so nobody has seen it")
        return 0
    pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        folder = pathlib.Path(scratch)
        browser = Browser(program, folder / "profile")
        try:
            found = consac(folder, "twin", "candidates", ARM / "arm.step")
            assert re.search("joint_1|joint 1", found), found
            page(browser, folder, [ARM / "arm.step"], pictures / "twin-step-1.png", look_at_a_candidate)
            page(browser, folder, [ARM / "arm.step", "--hints", ARM / "reach_hints.json"], pictures / "twin-step-2.png", see_what_hints_say)
            consac(folder, "twin", "import", ARM / "arm.step", "--hints", ARM / "reach_hints.json", "--density", "1200", "-o", "arm")
            page(browser, folder, ["arm"], pictures / "twin-step-3.png", bend)
            consac(folder, "twin", "reach", "arm")
            consac(folder, "train", "twin-reach-v0:arm", "--name", "arm-reach", "--no-progress", "--no-table", *TRAIN)
            verdict = json.loads(consac(folder, "eval", "arm-reach", "--json"))
            assert verdict["min_reward"] > -10, verdict
            page(browser, folder, ["arm", "--model", "arm-reach"], pictures / "twin-step-4.png", play)
        finally:
            browser.process.kill()
    print(f"twin story: {verdict['episodes']} episodes, the longest way takes {-verdict['min_reward']:.0f} steps; pictures are in {pictures}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
