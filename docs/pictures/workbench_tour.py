#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the steps of docs/tutorial/tour.md: workbench_tour.py PROGRAM FOLDER

Drives the page by clicks from a CT to a report, and takes a picture of each step: tour-1-slices.png and so on. The head is the CT
of the Debian package invesalius-examples. Needs that package, chromium and chromedriver."""
import pathlib
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(SOURCE / "tests/problems/app/workbench"))
from clicks_to_report import (Clicker, await_suggestions, click_sites, go_to_landmarks, keep_sure_points, known_points, look_at_ct,
                              make_face, open_head, state_person)
from workbench_page import Workbench, take_picture

VOLUME = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3"
POINTS = known_points(SOURCE / "configs/landmarks/cranium.yaml")


def open_and_face(browser):
    open_head(browser)
    browser.run("window.semblance.scene.shared.camera.look(0, 0)")


def click_two_sites(browser):
    go_to_landmarks(browser)
    click_sites(browser, {site: POINTS[site] for site in ("n", "zy_l")})
    browser.wait("return window.semblance.store.site === 'zy_r'")


def click_last_site(browser):
    click_sites(browser, {"zy_r": POINTS["zy_r"]})
    await_suggestions(browser)
    browser.press_button("Review")


def state_case(browser):
    keep_sure_points(browser)
    state_person(browser, "rhine_caucasoid")
    browser.run("const number = document.querySelector('[data-record=number]'); number.value = '17'; number.dispatchEvent(new Event('change'))")
    browser.wait("return window.semblance.store.state.values.record.number === '17'")


def show_face(browser):
    browser.click("[data-tab=face]")
    make_face(browser)
    browser.run("window.semblance.scene.shared.camera.look(35, 5)")


def sculpt(browser):
    browser.click("[data-tab=sculpt]")
    browser.click("[data-tool=smooth]")


def show_the_head(browser):
    browser.click("[data-tab=report]")
    browser.run("document.querySelector('#panel .check input').click()")
    browser.wait("return window.semblance.scene.main.stage.layers.has('head')")


STEPS = (("1-slices", lambda browser: look_at_ct(browser, VOLUME)), ("2-skull", open_and_face), ("3-landmarks", click_two_sites),
         ("4-review", click_last_site), ("5-person", state_case), ("6-face", show_face), ("7-sculpt", sculpt), ("8-report", show_the_head))


def main():
    program, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:])
    browser = Clicker(1200, 750)
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
