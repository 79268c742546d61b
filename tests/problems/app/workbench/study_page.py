# SPDX-License-Identifier: GPL-3.0-or-later
"""The live page of a study in a browser: its bar and report follow the trials, an open part stays open, and the page has the last
report when the program has ended. At 400 pixels the folded report is shorter than ten screens.

usage: study_page.py PROGRAM CONFIG FOLDER     exit code 77: skipped, as something is not installed
"""
import os
import re
import shutil
import subprocess
import sys

import webdriver

SKIPPED = 77
SCREEN = (400, 800)  # pixels
STUDY = """title: live <study>
base: {config}
job: depth
subjects: [{subjects}]
grid:
  interp: [nearest, mean, kriging]
  landmarks.keep: [all, {{type: spread, n: 8}}, {{type: spread, n: 16}}]
metric: depth_truth.along_direction.rms_mm
"""
FINISHED = "return document.getElementById('bar').value;"
HEADINGS = "return Array.from(document.querySelectorAll('main h2'), (heading) => heading.textContent);"
OPEN = """const fold = [...document.querySelectorAll('details')].find((part) => part.textContent.includes(arguments[0]));
fold.open = true;"""
IS_OPEN = "return [...document.querySelectorAll('details[open] > summary')].map((line) => line.textContent.trim());"
HEIGHT = "for (const fold of document.querySelectorAll('main details')) { fold.open = false; } return document.body.scrollHeight;"


def work(browser, program, study, folder):
    run = subprocess.Popen([program, "study", study, "--out", folder, "--serve", "--quiet"], stdout=subprocess.PIPE, text=True)
    try:
        browser.open(re.search(r"http\S+", run.stdout.readline()).group(0))
        browser.wait("return document.querySelector('main h2') !== null && document.getElementById('bar').value > 0;")
        assert browser.run("return document.title;") == "live <study>"
        before = browser.run(FINISHED)
        browser.run(OPEN, "Trials")
        ended = "document.getElementById('words').textContent.includes('has ended')"
        browser.wait(f"return document.getElementById('bar').value > arguments[0] || {ended};", before)  # a fast study may be done
        browser.wait(f"return {ended};")
        run.stdout.read()
        assert run.wait() == 0
    finally:
        run.kill()
    assert browser.run(FINISHED) == 27
    assert "Factors" in browser.run(HEADINGS), browser.run(HEADINGS)
    assert "Trials" in browser.run(IS_OPEN)
    complaints = browser.complaints()
    assert complaints == [], complaints
    browser.open(f"file://{os.path.abspath(folder)}/report.html")
    height = browser.run(HEIGHT)
    assert height < 10 * SCREEN[1], height
    assert browser.run("return document.documentElement.scrollWidth;") <= SCREEN[0]


def main():
    program, config, folder = sys.argv[1:]
    if words := webdriver.missing():
        print(f"skipped: {words} is not installed")
        return SKIPPED
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    subjects = ", ".join(f"{{name: phantom {n}, set: {{subject.random_seed: {n}}}}}" for n in range(1, 4))
    study = os.path.join(folder, "live.yaml")
    with open(study, "w", encoding="utf-8") as file:
        file.write(STUDY.format(config=config, subjects=subjects))
    try:
        browser = webdriver.Browser(*SCREEN, rough=True)
    except webdriver.CannotStart as error:
        print(f"skipped: Chromium does not start here: {error}")
        return SKIPPED
    try:
        work(browser, program, study, os.path.join(folder, "out"))
    finally:
        browser.close()
    print("the live page of a study does what it should")
    return 0


if __name__ == "__main__":
    sys.exit(main())
