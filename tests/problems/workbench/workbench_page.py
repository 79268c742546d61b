# SPDX-License-Identifier: GPL-3.0-or-later
"""The workbench end to end: landmarks by clicks on a phantom's skull, a depth changed, the face seen to move, the full
face, a pull, a reload; then the folder is run from the command line, and the bytes are the same.

usage: workbench_page.py PROGRAM CONFIG FOLDER [PICTURES]     exit code 77: skipped, as something is not installed
"""
import os
import re
import subprocess
import sys
import time

import webdriver

SKIPPED = 77
UNDO = ("\ue009", "z")  # Control

# Where a point of the head lies in the window: the page's own camera, asked through its canvas.
PLACE = """
const [x, y, z] = arguments, canvas = document.querySelector('#view canvas'), box = canvas.getBoundingClientRect();
const at = new THREE.Vector3(x, y, z).project(window.semblance.scene.shared.camera.camera);
return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
"""
POSITIONS = "return Array.from(window.semblance.scene.faceGeometry().attributes.position.array);"
FACE = "return window.semblance.faces.kind;"
STATE = "return window.semblance.store.state;"


# The worst relative error of distances along a plane, where they are straight, over pairs of triangles.
PLANE = """
const plane = new THREE.PlaneBufferGeometry(2, 2, 24, 24), count = plane.index.count / 3;
const middle = (t) => [0, 1, 2].reduce((sum, k) => sum.add(new THREE.Vector3().fromArray(
    plane.attributes.position.array, 3 * plane.index.array[3 * t + k])), new THREE.Vector3()).divideScalar(3);
let worst = 0;
for (let k = 0; k < 60; ++k) {
  const a = (k * 487) % count, b = (k * 811 + 300) % count, exact = middle(a).distanceTo(middle(b));
  const found = SemblanceSurface.alongSurface(plane, {faceIndex: a, point: middle(a)}, {faceIndex: b, point: middle(b)});
  if (exact > 0.3) { worst = Math.max(worst, Math.abs(found.length - exact) / exact); }
}
return worst;
"""


def state(browser):
    return browser.run(STATE)


def landmark(browser, site):
    return next((l for l in state(browser)["landmarks"] if l["site"] == site), None)


def distance(a, b):
    return sum((p - q) ** 2 for p, q in zip(a, b)) ** 0.5


class Workbench:
    """The program, and the address that it printed."""

    def __init__(self, program, arguments):
        self.process = subprocess.Popen([program, "workbench", *arguments], stdout=subprocess.PIPE, text=True)
        for line in self.process.stdout:
            if found := re.search(r"http://127\.0\.0\.1:\d+/\w+/", line):
                self.url = found.group(0)
                return
        raise AssertionError("the program printed no address")

    def close(self):
        self.process.terminate()
        return self.process.wait(20)

    def kill(self):
        self.process.kill()
        self.process.wait(20)


def take_away(browser, sites):
    browser.click("[data-tab=landmarks]")
    for site in sites:
        browser.click(f'[data-site="{site}"]')
        browser.run("[...document.querySelectorAll('.about button')].find((b) => b.textContent === 'Remove').click()")
        browser.wait("return !window.semblance.store.state.landmarks.some((l) => l.site === arguments[0])", site)


def place_by_clicks(browser, points):
    """Each site is chosen in the list, the head is turned to it, and the bone is clicked."""
    for site, point in points.items():
        turn = {"_l": 50, "_r": -50}.get(site[-2:], 0)
        browser.run("window.semblance.scene.shared.camera.look(arguments[0], 5)", turn)
        browser.click(f'[data-site="{site}"]')
        browser.click_at(*browser.run(PLACE, *point))
        browser.wait("return window.semblance.store.state.landmarks.some((l) => l.site === arguments[0])", site)
        placed = landmark(browser, site)
        assert distance(placed["point"], point) < 1.5, (site, placed["point"], point)
        assert placed["from_bone_mm"] < 1e-3, placed


def change_depth(browser, site, depth_mm):
    browser.click("[data-tab=face]")
    browser.wait(FACE)
    before = browser.run(POSITIONS)
    browser.run("""const row = document.querySelector(`.depth[data-site="${arguments[0]}"] input`);
        row.value = arguments[1]; row.dispatchEvent(new Event('input')); row.dispatchEvent(new Event('change'));""",
                site, depth_mm)
    browser.wait("const s = window.semblance.store.state.settings.find((o) => o.path === arguments[0]);"
                 "return s && Number(s.value) === arguments[1] && !window.semblance.faces.busy",
                 "tissue.set_mm." + site, depth_mm)
    after = browser.run(POSITIONS)
    return max(abs(p - q) for p, q in zip(before, after))


def make_full_face(browser):
    browser.click("#run")
    browser.wait("const s = window.semblance.store.state; return s.job.state !== 'running' && s.face.saved"
                 " && window.semblance.faces.kind === 'full'", seconds=200)


def pull_the_nose(browser):
    browser.click("[data-tab=sculpt]")
    browser.run("window.semblance.scene.shared.camera.look(0, 0)")
    middle = browser.run("const b = document.querySelector('#view canvas').getBoundingClientRect();"
                         "return [b.left + b.width / 2, b.top + b.height / 2]")
    browser.click_at(*middle)
    before = browser.run(POSITIONS)
    browser.run("[...document.querySelectorAll('#panel button')].find((b) => b.textContent === 'Pull out').click()")
    browser.wait("return window.semblance.store.state.edited_vertices > 0 && !window.semblance.faces.busy")
    browser.wait("const p = window.semblance.scene.faceGeometry().attributes.position.array;"
                 "return p.some((x, k) => Math.abs(x - arguments[0][k]) > 1)", before)


def same_from_the_command_line(program, folder):
    """Every file of the folder's run but the times, against a run of its config.yaml."""
    again = os.path.join(os.path.dirname(folder), "again")
    subprocess.run([program, "run", os.path.join(folder, "config.yaml"), "--out", again, "--quiet"], check=True,
                   stdout=subprocess.DEVNULL)
    compared = 0
    for root, _, names in os.walk(again):
        for name in names:
            path = os.path.join(root, name)
            if name == "timing.json":
                continue
            with open(path, "rb") as ours, open(os.path.join(folder, "run", os.path.relpath(path, again)), "rb") as theirs:
                assert ours.read() == theirs.read(), path
            compared += 1
    assert compared > 10, compared


def work(browser, program, config, folder, pictures):
    bench = Workbench(program, [config, "--out", folder])

    def picture(name):
        if pictures:
            browser.run("window.semblance.scene.draw()")
            time.sleep(0.7)
            browser.picture(os.path.join(pictures, name + ".png"))
            browser.picture(os.path.join(pictures, name + ".png"))
    try:
        browser.open(bench.url)
        browser.wait("return window.semblance && window.semblance.store.state && window.semblance.faces.kind === 'coarse'")
        points = {site: landmark(browser, site)["point"] for site in ("g", "pg", "zy_l", "go_r")}
        take_away(browser, points)
        picture("landmarks")
        place_by_clicks(browser, points)
        browser.press(UNDO)
        browser.wait("return !window.semblance.store.state.landmarks.some((l) => l.site === 'go_r')")
        browser.click("#redo")
        browser.wait("return window.semblance.store.state.landmarks.some((l) => l.site === 'go_r')")
        moved = change_depth(browser, "n", 12)
        assert moved > 2, f"the face moved by {moved} mm"
        browser.run("document.querySelector('#panel .check input').click()")
        assert browser.run("return window.semblance.faces.change.most") > 2
        browser.run("document.querySelector('#panel .check input').click()")
        picture("face")
        make_full_face(browser)
        picture("full")
        pull_the_nose(browser)
        picture("sculpt")
        make_full_face(browser)
        vertices = state(browser)["edited_vertices"]

        # A crash of the program, and another one that goes on.
        bench.kill()
        bench = Workbench(program, [folder])
        browser.complaints()  # the page has asked a dead program
        browser.open(bench.url)
        browser.wait("return window.semblance && window.semblance.faces.kind === 'full'")
        assert state(browser)["edited_vertices"] == vertices
        assert state(browser)["face"]["saved"]
        assert browser.run("return document.querySelectorAll('.depth').length") > 20

        browser.click("[data-tab=compare]")
        browser.wait("return document.querySelectorAll('#view canvas:not(.view3d-compass)').length === 4")
        picture("compare")
        browser.click("[data-tab=measure]")
        browser.run("window.semblance.scene.shared.camera.look(0, 0)")
        browser.click("[data-tool=distance]")
        for point in (points["g"], points["pg"]):
            browser.click_at(*browser.run(PLACE, *point))
        text = browser.wait("const l = document.querySelector('.view3d-label'); return l && l.textContent")
        straight, along = (float(number) for number in re.findall(r"([\d.]+) mm", text))
        assert 80 < straight < along < 2 * straight, text
        picture("measure")
        assert browser.run(PLANE) < 0.03

        browser.resize(400, 800)
        browser.run("window.scrollTo(0, 0)")
        for tab in ("landmarks", "face", "sculpt", "measure", "skull"):
            browser.click(f"[data-tab={tab}]")
            time.sleep(0.3)
            wide = browser.run("return document.documentElement.scrollWidth")
            assert wide <= 400, f"{tab}: {wide} pixels wide"
            picture("small-" + tab)
        complaints = browser.complaints()
        assert not complaints, complaints
    finally:
        browser.close()
        bench.close()
    same_from_the_command_line(program, folder)


def main():
    program, config, folder, *rest = sys.argv[1:]
    if words := webdriver.missing():
        print(f"skipped: {words} is not installed")
        return SKIPPED
    subprocess.run(["rm", "-rf", folder, os.path.join(os.path.dirname(folder), "again")], check=True)
    try:
        browser = webdriver.Browser(1440, 900)
    except webdriver.CannotStart as error:
        print(f"skipped: Chromium does not start here: {error}")
        return SKIPPED
    work(browser, program, config, folder, rest[0] if rest else None)
    print("the page of the workbench does what it should")
    return 0


if __name__ == "__main__":
    sys.exit(main())
