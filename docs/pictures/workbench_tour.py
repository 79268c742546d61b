#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the steps of docs/tutorial/tour.md: workbench_tour.py PROGRAM FOLDER

Drives the page by clicks from a CT to a report, and takes a picture of each step: tour-1-slices.png and so on. The head is the CT
of the Debian package invesalius-examples. Needs that package, chromium and chromedriver."""
import pathlib
import re
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(SOURCE / "tests/problems/app/workbench"))
import webdriver
from workbench_page import PLACE, Workbench, state, take_picture

VOLUME = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3"
IDLE = "return window.semblance.store.state.job.state !== 'running' && !window.semblance.faces.busy"
FIRST_CLICKS = ("n", "zy_l", "zy_r")
PERSON = (("tissue.table", "rhine_caucasoid"), ("tissue.sex", "male"), ("tissue.build", "normal"))


def known_points():
    """Where an observer has marked the first three sites."""
    text = (SOURCE / "configs/landmarks/cranium.yaml").read_text()
    number = r"\s*(-?[\d.]+)\s*"
    return {site: [float(x) for x in re.search(rf'site: "?{site}"?\s+point: \[{number},{number},{number}\]', text).groups()]
            for site in FIRST_CLICKS}


def look_at_slices(browser):
    browser.run("const field = document.querySelector('#panel .chooser input[type=text]'); field.value = arguments[0];"
                "field.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter'}))", VOLUME)
    browser.wait("return [...document.querySelectorAll('.slices img')].filter((i) => i.complete && i.naturalWidth).length === 3", seconds=300)


def open_head(browser):
    browser.click('#opening [data-way="head"]')
    browser.wait("return window.semblance.store.state.subject.triangles > 0 && window.semblance.scene.shared.camera", seconds=600)
    browser.wait(IDLE, seconds=300)
    browser.run("window.semblance.scene.shared.camera.look(0, 0)")


def click_three_sites(browser):
    browser.click('[data-go="landmarks"]')
    for site, point in known_points().items():
        browser.run("window.semblance.scene.shared.camera.look(arguments[0], 5)", {"_l": 70, "_r": -70}.get(site[-2:], 0))
        browser.click(f'[data-site="{site}"]')
        browser.click_at(*browser.run(PLACE, *point))
        browser.wait("return window.semblance.store.state.landmarks.some((l) => l.site === arguments[0])", site)


def press(browser, text):
    browser.run("[...document.querySelectorAll('#panel button')].find((b) => b.textContent.startsWith(arguments[0])).click()", text)


def let_the_program_suggest(browser):
    press(browser, "Suggest the other")
    browser.wait("return window.semblance.store.state.landmarks.length > 12", seconds=300)
    browser.wait(IDLE, seconds=300)
    press(browser, "Review")


def confirm_all(browser):
    """Confirms the doubtful points one by one, then the others together."""
    while any(landmark["doubtful"] for landmark in state(browser)["landmarks"]):
        revision = state(browser)["revision"]
        press(browser, "It is right")
        browser.wait("return window.semblance.store.state.revision > arguments[0]", revision)
    press(browser, "All are right")
    browser.wait("return window.semblance.store.state.landmarks.every((l) => !l.proposed)")


def state_the_person(browser):
    browser.click("[data-tab=person]")
    for path, value in PERSON:
        browser.run("const choice = document.querySelector(`[data-ask='${arguments[0]}'] select`);"
                    "choice.value = [...choice.options].find((option) => option.value.includes(arguments[1])).value;"
                    "choice.dispatchEvent(new Event('change'))", path, value)
        browser.wait("return window.semblance.store.state.settings.some((setting) => setting.path === arguments[0])", path)
    browser.run("const number = document.querySelector('[data-record=number]'); number.value = '17'; number.dispatchEvent(new Event('change'))")
    browser.wait("return window.semblance.store.state.values.record.number === '17'")
    browser.wait(IDLE, seconds=300)


def make_the_face(browser):
    browser.click("[data-tab=face]")
    browser.click("#run")
    browser.wait("return window.semblance.store.state.face.saved && !window.semblance.faces.busy", seconds=1200)
    browser.run("window.semblance.scene.shared.camera.look(35, 5)")


def sculpt(browser):
    browser.click("[data-tab=sculpt]")
    browser.click("[data-tool=smooth]")


def show_the_head(browser):
    browser.click("[data-tab=report]")
    browser.run("document.querySelector('#panel .check input').click()")
    browser.wait("return window.semblance.scene.main.stage.layers.has('head')")


STEPS = (("1-slices", look_at_slices), ("2-skull", open_head), ("3-landmarks", click_three_sites),
         ("4-review", let_the_program_suggest), ("5-person", lambda browser: (confirm_all(browser), state_the_person(browser))),
         ("6-face", make_the_face), ("7-sculpt", sculpt), ("8-report", show_the_head))


def main():
    program, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:])
    browser = webdriver.Browser(1200, 750)
    with tempfile.TemporaryDirectory() as name:
        bench = Workbench(program, ["--out", "out/tour"], folder=name)
        try:
            browser.open(bench.url)
            browser.wait("return window.semblance?.store.state")
            for step, act in STEPS:
                act(browser)
                browser.settle()
                browser.run("for (const code of document.querySelectorAll('#saved code')) {"
                            "code.textContent = code.textContent.replaceAll(arguments[0] + '/', ''); }", name)
                take_picture(browser, folder, f"tour-{step}")
                print(step, flush=True)
        finally:
            browser.close()
            bench.close()


if __name__ == "__main__":
    main()
