# SPDX-License-Identifier: GPL-3.0-or-later
"""The page for raters in a browser of 400 pixels: ranked by keys and by clicks, taken back, kept over a reload, saved as CSV, scored.

usage: rater_page.py PROGRAM CONFIG FOLDER [PICTURES]     exit code 77: skipped, as something is not installed
"""
import os
import shutil
import subprocess
import sys

import webdriver

SKIPPED = 77
SCREEN = (400, 800)  # pixels
POOL = 3
PRESSED = "return document.querySelectorAll('#pool [aria-pressed=true]').length;"
HEAD = "return document.getElementById('head').textContent;"
ENTER, BACKSPACE = "\ue007", "\ue003"


def begin(browser, name):
    browser.run("document.getElementById('name').value = arguments[0]; document.querySelector('#begin button').click();", name)


def answer(browser, folder):
    begin(browser, 'Rita "R", 1')
    assert browser.run(HEAD) == "Question 1 of 2", browser.run(HEAD)
    assert browser.run("return document.querySelectorAll('#pool button').length;") == POOL
    assert browser.run("return document.documentElement.scrollWidth;") <= SCREEN[0]
    assert browser.run("return [...document.images].every((image) => image.complete && image.naturalWidth > 100);")
    browser.press("2")
    browser.wait("return document.querySelectorAll('#pool [aria-pressed=true]').length === 1;")
    browser.press(BACKSPACE)
    browser.wait("return document.querySelectorAll('#pool [aria-pressed=true]').length === 0;")
    assert browser.run("return document.getElementById('next').disabled;")
    browser.press("3")
    browser.press("1")
    browser.wait("return document.querySelectorAll('#pool [aria-pressed=true]').length === arguments[0];", POOL)
    ranks = browser.run("return [...document.querySelectorAll('#pool b')].map((mark) => mark.textContent);")
    assert ranks == ["2", "3", "1"], ranks
    browser.press(ENTER)
    browser.wait("return document.getElementById('head').textContent === 'Question 2 of 2';")
    browser.run("location.reload();")  # answers stay
    browser.wait("return !document.getElementById('start').hidden;")
    begin(browser, 'Rita "R", 1')
    browser.wait("return document.getElementById('head').textContent === 'Question 2 of 2';")
    for _ in range(POOL - 1):
        browser.run("document.querySelector('#pool [aria-pressed=false]').click();")
    browser.run("document.getElementById('next').click();")
    browser.wait("return !document.getElementById('end').hidden;")
    csv = browser.run("return window.semblanceRaters.csv();")
    assert csv.splitlines()[0] == "rater,question,candidate,rank" and len(csv.splitlines()) == 1 + 2 * POOL, csv
    name = browser.run("return document.getElementById('save').download;")
    assert name == "answers_Rita__R___1.csv", name
    path = os.path.join(folder, "answers.csv")
    with open(path, "w", encoding="utf-8") as file:
        file.write(csv)
    return path


def main():
    program, config, folder = sys.argv[1:4]
    if words := webdriver.missing():
        print(f"skipped: {words} is not installed")
        return SKIPPED
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    runs = []
    for seed in range(1, POOL + 1):
        runs.append(os.path.join(folder, f"person_{seed}"))
        subprocess.run([program, "run", config, "--set", f"subject.random_seed={seed}", "--out", runs[-1], "--quiet"],
                       check=True, stdout=subprocess.DEVNULL)
    raters = os.path.join(folder, "raters")
    subprocess.run([program, "raters", "page", *runs[:2], "--others", *runs[2:], "--pool", str(POOL), "--out", raters, "--quiet"],
                   check=True)
    with open(os.path.join(raters, "page.html"), encoding="utf-8") as file:
        assert "person_" not in file.read()
    try:
        browser = webdriver.Browser(*SCREEN, rough=True)
    except webdriver.CannotStart as error:
        print(f"skipped: Chromium does not start here: {error}")
        return SKIPPED
    try:
        browser.open(f"file://{os.path.abspath(raters)}/page.html")
        if len(sys.argv) > 4:
            begin(browser, "picture")
            browser.settle()
            browser.picture(os.path.join(sys.argv[4], "raters_400.png"))
            browser.resize(1440, 900)
            browser.picture(os.path.join(sys.argv[4], "raters_1440.png"))
            browser.resize(*SCREEN)
            browser.run("location.reload();")
        answers = answer(browser, folder)
        complaints = browser.complaints()
        assert complaints == [], complaints
    finally:
        browser.close()
    score = subprocess.run([program, "raters", "score", os.path.join(raters, "key.csv"), answers,
                            "--out", os.path.join(folder, "statistics.csv")], check=True, capture_output=True, text=True).stdout
    assert "2 answers to 2 questions" in score, score
    print("the page for raters does what it should")
    return 0


if __name__ == "__main__":
    sys.exit(main())
