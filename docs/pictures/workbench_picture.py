#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of docs/tutorial/workbench.md, of the page as it is: workbench_picture.py PROGRAM FOLDER

The head of configs/demo.yaml, in a window of 1440 x 900 pixels: workbench-landmarks.png, a site with what is known of it; and
workbench.png, the face once a depth was changed. Needs chromium and chromedriver."""
import pathlib
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(SOURCE / "tests/problems/app/workbench"))
import webdriver
from workbench_page import Workbench, change_depth, take_picture

READY = "return window.semblance?.scene.shared.camera && window.semblance.faces.kind === 'coarse' && !window.semblance.faces.busy"
PICTURE_CAME = "return document.querySelector('.site-place img')?.complete"


def show_a_site(browser, site):
    browser.click("[data-tab=landmarks]")
    browser.run("window.semblance.scene.shared.camera.look(50, 5)")
    browser.click(f'[data-site="{site}"]')
    browser.run("document.getElementById('panel').scrollTop = 0")
    browser.wait(PICTURE_CAME)


def show_a_change(browser, site, depth_mm):
    browser.run("window.semblance.scene.shared.camera.look(35, 5)")
    change_depth(browser, site, depth_mm)
    browser.run("document.querySelector('#panel .check input').click(); document.getElementById('panel').scrollTop = 0")


def keep_picture(browser, folder, name, place):
    """Without the path of the folder that was made for it."""
    browser.run("for (const code of document.querySelectorAll('#saved code')) {"
                "code.textContent = code.textContent.replaceAll(arguments[0] + '/', ''); }", place)
    take_picture(browser, folder, name)


def main():
    program, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:])
    browser = webdriver.Browser(1440, 900)
    with tempfile.TemporaryDirectory() as name:
        bench = Workbench(program, [SOURCE / "configs/demo.yaml", "--out", "out/demo_workbench"], folder=name)
        try:
            browser.open(bench.url)
            browser.wait(READY)
            show_a_site(browser, "zy_l")
            keep_picture(browser, folder, "workbench-landmarks", name)
            show_a_change(browser, "im_l", 30)
            keep_picture(browser, folder, "workbench", name)
        finally:
            browser.close()
            bench.close()


if __name__ == "__main__":
    main()
