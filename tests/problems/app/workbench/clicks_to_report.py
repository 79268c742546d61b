# SPDX-License-Identifier: GPL-3.0-or-later
"""From a CT to a report by clicks alone. Counts the clicks and the seconds, and compares the face with the one from an
expert's landmarks. The person who clicks knows three sites: nasion and both zygia.

usage: clicks_to_report.py PROGRAM FOLDER                        a phantom's CT with slices at unequal distances
       clicks_to_report.py PROGRAM FOLDER CT LANDMARKS [TABLE]   a CT, where its landmarks lie, and the table of depths

Exit code 77: skipped, as something is not installed. 1: a limit of LIMITS is exceeded. The goal for the seconds is 360; they
fail no test, as machines differ.
"""
import json
import pathlib
import re
import subprocess
import sys
import time

import webdriver
from workbench_page import PLACE, SKIPPED, Workbench

FIRST_CLICKS = ("n", "zy_l", "zy_r")
LIMITS = {"clicks": 12, "bone outside (%)": 1, "worse than the expert's (mm)": 0.15}
PHANTOM = ["--random-seed", "3", "--pixel-mm", "1.5", "--slice-mm", "1"]
IDLE = "return window.semblance.store.state.job.state !== 'running' && !window.semblance.faces.busy" \
       " && !window.semblance.opener.waits"


class Clicker(webdriver.Browser):
    """Clicks with the mouse alone, and counts the clicks."""

    clicks = 0

    def click_at(self, x, y):
        self.clicks += 1
        super().click_at(x, y)

    def press_button(self, text):
        """Clicks on the button of the panel whose text begins so."""
        self.wait("for (const b of document.querySelectorAll('[data-pressed]')) { delete b.dataset.pressed; }"
                  "const found = [...document.querySelectorAll('#panel button')].find((b) => b.textContent.startsWith(arguments[0]));"
                  "if (found) { found.dataset.pressed = 1; } return found && !found.disabled", text)
        self.click("[data-pressed]")


def known_points(landmarks):
    """Where the expert has marked the first three sites."""
    number = r"\s*(-?[\d.e-]+)\s*"
    text = pathlib.Path(landmarks).read_text()
    return {site: [float(x) for x in re.search(rf'site: "?{site}"?\s+point: \[{number},{number},{number}\]', text).groups()]
            for site in FIRST_CLICKS}


def look_at_ct(browser, path):
    """Types the path, because a page cannot click in the dialog of the system that chooses files."""
    browser.run("document.querySelector('#panel .chooser input[type=text]').value = arguments[0]", str(path))
    browser.press_button("Open")
    browser.wait("return [...document.querySelectorAll('.slices img')].filter((i) => i.complete && i.naturalWidth).length === 3", seconds=300)


def open_head(browser):
    browser.click('#opening [data-way="head"]')
    browser.wait("return window.semblance.store.state.subject.triangles > 0 && window.semblance.scene.shared.camera", seconds=600)
    browser.wait(IDLE, seconds=300)


def go_to_landmarks(browser):
    browser.press_button("Yes: go on to the landmarks")


def click_sites(browser, points):
    """The page chooses each site and turns the head to it."""
    for site, point in points.items():
        browser.wait("return window.semblance.store.site === arguments[0]", site)
        browser.settle()
        browser.click_at(*browser.run(PLACE, *point))
        browser.wait("return window.semblance.store.state.landmarks.some((l) => l.site === arguments[0])", site)


def await_suggestions(browser):
    browser.wait("return window.semblance.store.state.landmarks.some((l) => l.proposed)", seconds=300)
    browser.wait(IDLE, seconds=300)


def keep_sure_points(browser):
    """Leaves out the doubtful suggestions and confirms the others."""
    doubtful = browser.run("return window.semblance.store.state.landmarks.some((l) => l.doubtful)")
    browser.press_button("Leave out the" if doubtful else "All are right")
    browser.wait("return window.semblance.store.state.landmarks.every((l) => !l.proposed)")


def state_person(browser, table):
    for path, value in (("tissue.table", table), ("tissue.sex", "male"), ("tissue.build", "normal")):
        browser.wait("return document.querySelector(arguments[0])", f"[data-ask='{path}']")
        browser.click(f"[data-ask='{path}'] input[value*='{value}']")
        browser.wait("return window.semblance.store.state.settings.some((setting) => setting.path === arguments[0])", path)
    browser.wait(IDLE, seconds=300)


def make_face(browser):
    browser.click("#run")
    browser.wait("return window.semblance.store.state.face.saved && !window.semblance.faces.busy", seconds=1200)


def open_report(browser):
    browser.click("#job a")


def walk(browser, bench, ct, landmarks, table):
    """Goes through the steps of the page. Returns the seconds, which include those that the program works."""
    begin = time.monotonic()
    browser.open(bench.url)
    browser.wait("return window.semblance?.store.state")
    look_at_ct(browser, ct)
    open_head(browser)
    go_to_landmarks(browser)
    click_sites(browser, known_points(landmarks))
    await_suggestions(browser)
    keep_sure_points(browser)
    state_person(browser, table)
    make_face(browser)
    open_report(browser)
    return time.monotonic() - begin


def result_of(folder):
    return json.loads((folder / "result.json").read_text())


def run_with_expert(program, folder, landmarks):
    """The same head and options with all landmarks of the expert, whose depths come from the same table."""
    config = folder / "expert.yaml"
    subject = next(folder.glob("subject/*/skull.ply")).parent
    config.write_text(f'base: config.yaml\nsubject: {{type: files, skull: "{subject}/skull.ply", skin: "{subject}/skin.ply",'
                      f' landmarks: "{landmarks}"}}\n')
    subprocess.run([program, "run", config, "--out", folder / "expert", "--quiet"], check=True, stdout=subprocess.DEVNULL)
    return result_of(folder / "expert")


def make_phantom(program, folder):
    """A phantom's CT with slices 2 mm apart in its lower half, and 3 mm in the upper one."""
    subprocess.run([program, "phantom", "--head", "smooth", "--out", folder, *PHANTOM], check=True, stdout=subprocess.DEVNULL)
    slices = sorted((folder / "ct").iterdir())
    half = len(slices) // 2
    for k, path in enumerate(slices):
        if (k - half) % (2 if k < half else 3):
            path.unlink()
    return folder / "ct", folder / "landmarks.yaml"


def judge(figures):
    """Prints the figures, and returns whether all are within their limits."""
    for name, value in figures.items():
        print(f"{name}: {value:.2f}".replace(".00", "") + (f" (limit: {LIMITS[name]})" if name in LIMITS else ""))
    return all(figures[name] <= limit for name, limit in LIMITS.items())


def main():
    program, folder, *rest = sys.argv[1:]
    program, folder = pathlib.Path(program).resolve(), pathlib.Path(folder).resolve()
    if words := webdriver.missing():
        print(f"skipped: {words} is not installed")
        return SKIPPED
    subprocess.run(["rm", "-rf", folder], check=True)
    folder.mkdir(parents=True)
    ct, landmarks = (pathlib.Path(path).resolve() for path in rest[:2]) if rest else make_phantom(program, folder / "phantom")
    try:
        browser = Clicker(1440, 900)
    except webdriver.CannotStart as error:
        print(f"skipped: Chromium does not start here: {error}")
        return SKIPPED
    bench = Workbench(program, ["--out", str(folder / "bench")])
    try:
        seconds = walk(browser, bench, ct, landmarks, rest[2] if len(rest) > 2 else "rhine_caucasoid")
        complaints = browser.complaints()
        assert not complaints, complaints
    finally:
        browser.close()
        bench.close()
    ours, expert = result_of(folder / "bench/run"), run_with_expert(program, folder / "bench", landmarks)
    errors = [result["face"]["mean_abs_mm"] for result in (ours, expert)]
    good = judge({"clicks": browser.clicks, "seconds": seconds,
                  "bone outside (%)": 100 * ours["plausibility"]["bone_share"]["value"],
                  "error (mm)": errors[0], "error with the expert's landmarks (mm)": errors[1],
                  "worse than the expert's (mm)": errors[0] - errors[1]})
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
