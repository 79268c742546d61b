# SPDX-License-Identifier: GPL-3.0-or-later
"""The workbench end to end: landmarks placed by clicks on a phantom's skull, a changed depth that moves the face, the full
face, pulls by a drag and by keys, a crash. A run of the folder from the command line must give the same bytes.
workbench_open_page.py tests opening files and comparing variants.

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

# Position in the window of a point of the head, by the page's camera.
PLACE = """
const [x, y, z] = arguments, canvas = document.querySelector('#view canvas'), box = canvas.getBoundingClientRect();
const at = new THREE.Vector3(x, y, z).project(window.semblance.scene.shared.camera.camera);
return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
"""
POSITIONS = "return Array.from(window.semblance.scene.faceGeometry().attributes.position.array);"
FACE = "return window.semblance.faces.kind;"
STATE = "return window.semblance.store.state;"
TURN = "return window.semblance.scene.shared.camera.turn;"

# Background colours of the view and of the page's style.
GROUND = """const {renderer, canvas} = window.semblance.scene.main.stage;
return [renderer.getClearColor().getHex(), new THREE.Color(getComputedStyle(canvas).backgroundColor).getHex()];"""

IS_FULL = "const {pace, shared} = window.semblance.scene; return !shared.camera || pace.isFull;"

# Records for each later picture the share of the full resolution at which it is drawn.
WATCH_SHARES = """
const {stage} = window.semblance.scene.main, draw = stage.draw;
window.shares = [];
stage.draw = function(share = 1) { window.shares.push(share); draw.call(this, share); };
"""

# Pretends that the last full picture has just taken so many milliseconds, then turns the head.
TURN_AFTER = """
const {pace, shared: {camera}} = window.semblance.scene;
[pace.full_ms, pace.timed_at, window.shares] = [arguments[0], performance.now(), []];
camera.rotate(5, 0);
"""

# The picture that a person would save now, and the point in the middle of the view.
SAVED_AND_HIT = """
const {scene} = window.semblance, {stage, canvas} = scene.main, box = canvas.getBoundingClientRect();
let saved = null;
const press = HTMLAnchorElement.prototype.click;
HTMLAnchorElement.prototype.click = function() { saved = this.href; };
if (arguments[0] < 1) { stage.draw(arguments[0]); }
const hit = stage.hit({clientX: box.left + box.width / 2, clientY: box.top + box.height / 2});
scene.picture();
HTMLAnchorElement.prototype.click = press;
return [saved, hit && hit.point.toArray()];
"""

# The largest relative error of distances along a plane, where they are straight lines, over pairs of triangles.
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

    def __init__(self, program, arguments, folder=None):
        self.process = subprocess.Popen([program, "workbench", *arguments], stdout=subprocess.PIPE, text=True, cwd=folder)
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
    """For each site: chooses it in the list, turns the head to it, and clicks on the bone."""
    for site, point in points.items():
        turn = {"_l": 75, "_r": -75}.get(site[-2:], 0)
        browser.run("window.semblance.scene.shared.camera.look(arguments[0], 5)", turn)
        browser.click(f'[data-site="{site}"]')
        browser.click_at(*browser.run(PLACE, *point))
        browser.wait("return window.semblance.store.state.landmarks.some((l) => l.site === arguments[0])", site)
        placed = landmark(browser, site)
        assert distance(placed["point"], point) < 1.5, (site, placed["point"], point)
        assert placed["from_bone_mm"] < 1e-3, placed


def drag_a_landmark(browser, site):
    """Drags the ball of a site over the bone."""
    browser.click("[data-tab=landmarks]")
    browser.run("window.semblance.scene.shared.camera.look(0, 5)")
    before = landmark(browser, site)["point"]
    x, y = browser.run(PLACE, *before)
    browser.press_and_drag((x, y), (x + 14, y + 6))
    browser.release()
    browser.wait("const l = window.semblance.store.state.landmarks.find((l) => l.site === arguments[0]);"
                 "return l.point[0] !== arguments[1]", site, before[0])
    moved = landmark(browser, site)
    assert 2 < distance(moved["point"], before) < 25 and moved["from_bone_mm"] < 1e-3, (moved, before)
    browser.press(UNDO)
    browser.wait("const l = window.semblance.store.state.landmarks.find((l) => l.site === arguments[0]);"
                 "return l.point[0] === arguments[1]", site, before[0])


def place_by_keys(browser, site):
    """P places the chosen site in the middle of the view; W A S D move it."""
    browser.run("window.semblance.scene.shared.camera.look(20, 0); document.activeElement.blur()")
    before = landmark(browser, site)["point"]
    browser.press("p")
    browser.wait("const l = window.semblance.store.state.landmarks.find((l) => l.site === arguments[0]);"
                 "return l.point[0] !== arguments[1]", site, before[0])
    middle = landmark(browser, site)["point"]
    browser.press("w")
    browser.wait("const l = window.semblance.store.state.landmarks.find((l) => l.site === arguments[0]);"
                 "return l.point[2] !== arguments[1]", site, middle[2])
    assert 0.5 < landmark(browser, site)["point"][2] - middle[2] < 1.5
    browser.press(UNDO)
    browser.press(UNDO)
    browser.wait("const l = window.semblance.store.state.landmarks.find((l) => l.site === arguments[0]);"
                 "return l.point[0] === arguments[1]", site, before[0])


def turn_a_dowel(browser, site):
    """L turns the chosen site's depth marker, a drag of the arrow's tip too; Undo turns it back."""
    known = "const words = document.querySelector('.about .direction'); return words && words.textContent.includes(arguments[0])"
    browser.run("window.semblance.scene.shared.camera.look(60, 0)")
    browser.click(f'[data-site="{site}"]')
    browser.wait(known, "arker")
    browser.run("document.activeElement.blur()")
    former = undo_words(browser)
    browser.press("l")
    browser.wait("return window.semblance.store.state.steps.undo !== arguments[0]", former)
    assert landmark(browser, site)["turned"]
    browser.wait(known, "is turned by")
    tip = browser.run("""const {arrow, shared, main} = window.semblance.scene, box = main.canvas.getBoundingClientRect();
        const at = new THREE.Vector3(0, 20, 0).applyQuaternion(arrow.quaternion).add(arrow.position).project(shared.camera.camera);
        return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];""")
    middle = undo_words(browser)
    browser.press_and_drag(tip, (tip[0] + 4, tip[1] - 40))
    browser.release()
    browser.wait("return window.semblance.store.state.steps.undo !== arguments[0]", middle)
    assert f"turned {site} to" in undo_words(browser), undo_words(browser)
    browser.press(UNDO)
    browser.wait("return window.semblance.store.state.steps.undo === arguments[0]", middle)
    browser.press(UNDO)
    browser.wait("return window.semblance.store.state.steps.undo === arguments[0]", former)


def brush_the_face(browser):
    """A touch of a brush changes control vertices, and makes the report out of date."""
    browser.click("[data-tab=sculpt]")
    browser.run("window.semblance.scene.shared.camera.look(35, 0)")
    before = state(browser)["edited_vertices"]
    browser.click("[data-tool=inflate]")
    browser.click("[data-pull=touch]")
    browser.wait("return window.semblance.store.state.edited_vertices !== arguments[0]", before)
    assert "inflate" in undo_words(browser)
    assert "out of date" in browser.run("return document.querySelector('#job a').textContent")
    browser.press(UNDO)
    browser.wait("return window.semblance.store.state.edited_vertices === arguments[0] && !window.semblance.faces.busy", before)
    assert browser.run("return document.querySelector('#job a').textContent") == "Report"
    browser.click("[data-tool=pull]")


def expect_site_picture(browser, site):
    """Expects the picture of the site beside its definition, both inside the window."""
    browser.run("document.querySelector(arguments[0]).click()", f'[data-site="{site}"]')
    browser.wait("const image = document.querySelector('.site-place img');"
                 "return image && image.src.endsWith(arguments[0]) && image.complete && image.naturalWidth === 440", site)
    browser.run("document.querySelector('.site-place').scrollIntoView({block: 'end'})")
    words, image = browser.run("return ['.site-place p', '.site-place img'].map((part) => {"
                               "const box = document.querySelector(part).getBoundingClientRect();"
                               "return {left: box.left, right: box.right, top: box.top, bottom: box.bottom}; })")
    wide, high = browser.run("return [document.documentElement.clientWidth, innerHeight]")
    assert words["right"] <= image["left"] + 1 and image["right"] <= wide, (words, image, wide)
    assert min(words["bottom"], image["bottom"]) > max(words["top"], image["top"]), (words, image)
    assert image["top"] >= 0 and image["bottom"] <= high, (image, high)
    assert image["right"] - image["left"] > 120, image


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


def most_moved(before, after):
    return max(abs(p - q) for p, q in zip(before, after))


def undo_words(browser):
    return state(browser)["steps"]["undo"]


def await_step(browser, former):
    """Waits for a new step and for its face."""
    browser.wait("return window.semblance.store.state.steps.undo !== arguments[0] && !window.semblance.faces.busy", former)


def pull_the_cheek(browser):
    """The face follows the pointer; Escape cancels the pull; a release makes it as it was shown."""
    browser.click("[data-tab=sculpt]")
    browser.run("window.semblance.scene.shared.camera.look(30, 0)")
    start = browser.run("const b = document.querySelector('#view canvas').getBoundingClientRect();"
                        "return [b.left + 0.42 * b.width, b.top + 0.55 * b.height]")
    before, turn = browser.run(POSITIONS), browser.run(TURN)
    moved = "const p = window.semblance.scene.faceGeometry().attributes.position.array;" \
            "return p.some((x, k) => Math.abs(x - arguments[0][k]) > 2)"
    browser.press_and_drag(start, [start[0] - 50, start[1] - 40])
    browser.wait(moved, before)
    browser.press("\ue00c")  # Escape
    browser.release()
    assert browser.run(POSITIONS) == before and state(browser)["edited_vertices"] == 0
    browser.press_and_drag(start, [start[0] - 14, start[1] - 10])
    browser.wait(moved, before)
    browser.settle()
    shown, former = browser.run(POSITIONS), undo_words(browser)
    browser.release()
    await_step(browser, former)
    assert most_moved(shown, browser.run(POSITIONS)) < 0.05, "the preview differs from the result"
    assert browser.run(TURN) == turn, "the head turned while the face was pulled"
    assert "pulled level 2" in undo_words(browser)


def pull_by_keys(browser):
    """Pulls the point in the middle of the view in the plane of the view; then undo and redo."""
    browser.run("window.semblance.scene.shared.camera.look(0, 0); document.querySelector('#view canvas').focus()")
    before, former = browser.run(POSITIONS), undo_words(browser)
    browser.press("h", "w")
    await_step(browser, former)
    after, vertices = browser.run(POSITIONS), state(browser)["edited_vertices"]
    up = [q - p for p, q in zip(before[2::3], after[2::3])]
    assert 1 < max(up) < 2.1, max(up)
    browser.press(UNDO)
    browser.wait("return window.semblance.store.state.steps.undo === arguments[0] && !window.semblance.faces.busy", former)
    assert most_moved(before, browser.run(POSITIONS)) < 0.01
    browser.click("#redo")
    browser.wait("return window.semblance.store.state.edited_vertices === arguments[0]", vertices)


def run_again(program, folder):
    """Starts a run of the folder's configuration from the command line, in parallel to the rest of the test."""
    return subprocess.Popen([program, "run", os.path.join(folder, "config.yaml"), "--out",
                             os.path.join(os.path.dirname(folder), "again"), "--quiet"], stdout=subprocess.DEVNULL)


def expect_same_files(folder):
    """Compares every file of the folder's run, except the times, with the run of the command line."""
    again, compared = os.path.join(os.path.dirname(folder), "again"), 0
    for root, _, names in os.walk(again):
        for name in names:
            path = os.path.join(root, name)
            if name == "timing.json":
                continue
            with open(path, "rb") as ours, open(os.path.join(folder, "run", os.path.relpath(path, again)), "rb") as theirs:
                assert ours.read() == theirs.read(), path
            compared += 1
    assert compared > 10, compared


def take_picture(browser, folder, name):
    """Takes the picture twice, because the first may show the previous frame."""
    if folder:
        browser.run("window.semblance.scene.draw()")
        browser.wait(IS_FULL)
        time.sleep(0.3)
        browser.picture(os.path.join(folder, name + ".png"))
        browser.picture(os.path.join(folder, name + ".png"))


def expect_coarse_pictures_while_it_moves(browser):
    """If a full picture takes long: a coarser one at once, the full one at rest, or once a requested face has arrived.
    A saved picture is full, and the point under the pointer is the same for both."""
    browser.run(WATCH_SHARES)
    browser.run("window.semblance.faces.busy = true")
    browser.run(TURN_AFTER, 400)
    browser.wait("return window.shares.length > 0")
    time.sleep(0.6)  # more than two rests
    assert browser.run("return window.shares") == [0.5]
    browser.run("window.semblance.faces.busy = false")
    browser.wait(IS_FULL)
    assert browser.run("return window.shares") == [0.5, 1]
    browser.run(TURN_AFTER, 40)
    browser.wait(IS_FULL)
    assert browser.run("return window.shares") == [1]
    coarse, full = (browser.run(SAVED_AND_HIT, share) for share in (0.5, 1))
    assert coarse == full and full[1] and full[0].startswith("data:image/png"), (coarse[1], full[1])


def take_skin_away(browser):
    """Removes the skin, because scoring a run takes time and proves nothing here."""
    browser.click("[data-tab=skull]")
    browser.run("[...document.querySelectorAll('#panel button')].find((b) => b.textContent === 'Remove the skin').click()")
    browser.wait("return !window.semblance.store.state.subject.skin")


def work(browser, program, config, folder, pictures):
    bench = Workbench(program, [config, "--out", folder])

    def picture(name):
        take_picture(browser, pictures, name)
    again = None
    try:
        browser.open(bench.url)
        browser.wait("return window.semblance && window.semblance.store.state && window.semblance.faces.kind === 'coarse'")
        take_skin_away(browser)
        points = {site: landmark(browser, site)["point"] for site in ("g", "pg", "zy_l", "go_r")}
        take_away(browser, points)
        expect_site_picture(browser, "zy_l")
        picture("landmarks")
        place_by_clicks(browser, points)
        drag_a_landmark(browser, "n")
        place_by_keys(browser, "n")
        turn_a_dowel(browser, "zy_l")
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
        brush_the_face(browser)
        pull_the_cheek(browser)
        pull_by_keys(browser)
        picture("sculpt")
        make_full_face(browser)
        vertices = state(browser)["edited_vertices"]

        # The program crashes, and another one continues.
        former = bench.url
        bench.kill()
        browser.wait("return !document.getElementById('lost').hidden")
        bench = Workbench(program, [folder])
        assert bench.url == former, "an open page finds the program again"
        browser.wait("return document.getElementById('lost').hidden")
        browser.complaints()  # the page requested from an ended program
        browser.darken()
        browser.open(bench.url)
        browser.wait("return window.semblance && window.semblance.faces.kind === 'full'")
        assert state(browser)["edited_vertices"] == vertices
        ground, page = browser.run(GROUND)
        assert ground == page != 0xffffff, (hex(ground), hex(page))
        assert state(browser)["face"]["saved"]
        again = run_again(program, folder)
        assert browser.run("return document.querySelectorAll('.depth').length") > 20

        browser.click("[data-tab=measure]")
        browser.run("window.semblance.scene.shared.camera.look(0, 0)")
        browser.click("[data-tool=distance]")
        for point in (points["g"], points["pg"]):
            browser.click_at(*browser.run(PLACE, *point))
        text = browser.wait("const l = document.querySelector('.view3d-label:not(.fault)'); return l && l.textContent")
        straight, along = (float(number) for number in re.findall(r"([\d.]+) mm", text))
        assert 80 < straight < along < 2 * straight, text
        browser.click("[data-tool=depth]")
        browser.click_at(*browser.run(PLACE, *points["g"]))
        text = browser.wait("const l = document.querySelectorAll('.view3d-label:not(.fault)'); return l.length === 2 && l[1].textContent")
        found = re.search(r"depth: face ([\d.]+) mm", text)
        assert found and 1 < float(found[1]) < 15, text  # measured through the transparent face
        picture("measure")
        expect_coarse_pictures_while_it_moves(browser)
        assert browser.run(PLANE) < 0.03

        browser.resize(400, 800)
        browser.run("window.scrollTo(0, 0)")
        for tab in ("landmarks", "person", "face", "sculpt", "report", "measure", "skull"):
            browser.click(f"[data-tab={tab}]")
            browser.settle()
            wide = browser.run("return document.documentElement.scrollWidth")
            assert wide <= 400, f"{tab}: {wide} pixels wide"
            if tab == "landmarks":
                expect_site_picture(browser, "go_r")
            picture("small-" + tab)
        expect_reports_on_a_phone(browser, program, bench.url, folder)
        complaints = browser.complaints()
        assert not complaints, complaints
        assert again.wait(200) == 0
    finally:
        browser.close()
        bench.close()
        if again:
            again.kill()
    expect_same_files(folder)


def expect_reports_on_a_phone(browser, program, url, folder):
    """The reports of the run and of a fit: which headings are open, and no sideways scrolling."""
    points = os.path.join(os.path.dirname(__file__), "..", "..", "..", "..", "configs", "fit", "points.csv")
    fit = os.path.abspath(os.path.join(os.path.dirname(folder), "fit"))
    subprocess.run([program, "fit", points, "--out", fit, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    for report, heads in ((url + "run/report.html", ["In three dimensions", "In figures"]),
                          (f"file://{fit}/report.html", ["In three dimensions", "In figures", "Distances of the points"])):
        browser.open(report)
        browser.wait("return document.querySelector('#view3d canvas')")
        wide = browser.run("return document.documentElement.scrollWidth")
        assert wide <= 400, f"{report}: {wide} pixels wide"
        shown = browser.run("return [...document.querySelectorAll('main h2')].filter((h) => !h.closest('details')).map((h) => h.textContent)")
        assert [head for head in shown if head in heads] == heads, shown


def run_in_browser(folders, pictures, work_in):
    """Runs work_in(browser) in a new browser and returns the test's exit code."""
    if words := webdriver.missing():
        print(f"skipped: {words} is not installed")
        return SKIPPED
    subprocess.run(["rm", "-rf", *folders], check=True)
    try:
        # A small window is drawn faster without a graphics card.
        browser = webdriver.Browser(1440, 900) if pictures else webdriver.Browser(1000, 560, rough=True)
    except webdriver.CannotStart as error:
        print(f"skipped: Chromium does not start here: {error}")
        return SKIPPED
    work_in(browser)
    print("the page of the workbench does what it should")
    return 0


def main():
    program, config, folder, *rest = sys.argv[1:]
    pictures = rest[0] if rest else None
    made = [folder, *(os.path.join(os.path.dirname(folder), name) for name in ("again", "fit"))]
    return run_in_browser(made, pictures,
                          lambda browser: work(browser, program, config, folder, pictures))


if __name__ == "__main__":
    sys.exit(main())
