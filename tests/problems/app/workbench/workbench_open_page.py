# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening files in the workbench's page: by path, chosen, dropped; a configuration, the slices of a CT, a mesh in metres,
landmarks; with names that contain tags or are very long. Then variants of a head side by side, first coarse, then full.

usage: workbench_open_page.py PROGRAM CONFIG FOLDER [PICTURES]     exit code 77: skipped, as something is not installed
"""
import os
import pathlib
import sys

import dicom_slices
from workbench_page import Workbench, landmark, run_in_browser, state, take_picture

MESSAGE = "return document.getElementById('message').textContent"
IDLE = "return window.semblance.store.state.job.state !== 'running' && !window.semblance.faces.busy" \
       " && !window.semblance.opener.waits"
HOSTILE = "<script>window.hurt=1</script><img src=x onerror=window.hurt=1>\"'&"
LONG = "long" * 75


def give_path(browser, path):
    browser.click("[data-tab=skull]")
    browser.run("const field = document.querySelector('#panel .chooser input[type=text]'); field.value = arguments[0];"
                "field.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter'}))", str(path))


def choose_role(browser, role):
    browser.wait("return document.querySelector(arguments[0])", f'#opening [data-way="{role}"]')
    browser.click(f'#opening [data-way="{role}"]')


def go_to(browser, panel):
    """Compare is a part of the step that begins with Sculpt."""
    browser.click(f"[data-tab={'sculpt' if panel == 'compare' else panel}]")
    if panel == "compare":
        browser.click("[data-part=compare]")


def name_case(browser, name):
    browser.click("[data-tab=person]")
    browser.run("const field = document.querySelector('[data-record=name]'); field.value = arguments[0];"
                "field.dispatchEvent(new Event('change'))", name)
    await_subject(browser, name)


def expect_questions(browser):
    """A case without a configuration has no sex, build and table until the person states them."""
    open_fields = "return [...document.querySelectorAll('#panel .field.open')].map((field) => field.dataset.ask)"
    browser.click("[data-tab=person]")
    assert browser.run(open_fields) == ["tissue.table", "tissue.sex", "tissue.build"]
    browser.run("window.semblance.makeFace()")
    assert "state the person" in browser.run(MESSAGE)
    for path, value in (("tissue.table", "rhine_caucasoid"), ("tissue.sex", "female"), ("tissue.build", "normal")):
        browser.click(f"[data-ask='{path}'] input[value*='{value}']")
        browser.wait("return window.semblance.store.state.settings.some((setting) => setting.path === arguments[0])", path)
    assert browser.run(open_fields) == []
    assert state(browser)["values"]["tissue"]["sex"] == "female"


def await_subject(browser, name):
    browser.wait("return window.semblance.store.state.subject.name === arguments[0]", name)
    browser.wait(IDLE)


def drop(browser, files):
    """Drops files {name: text} together on the view."""
    browser.run("""const data = new DataTransfer();
        for (const [name, text] of Object.entries(arguments[0])) { data.items.add(new File([text], name)); }
        const event = (type) => new DragEvent(type, {dataTransfer: data, bubbles: true, cancelable: true});
        const view = document.getElementById('view');
        for (const type of ['dragenter', 'dragover', 'drop']) { view.dispatchEvent(event(type)); }""", files)


def refused(browser, give, words):
    """Expects a message with these words, and no change of the state."""
    revision = state(browser)["revision"]
    browser.run("document.getElementById('message').textContent = ''")
    give()
    message = browser.wait(MESSAGE)
    assert words in message, (words, message)
    assert state(browser)["revision"] == revision, message


def mesh_in_metres(path):
    """Writes a box as wide as a head, in metres, as OBJ."""
    points = "".join(f"v {x} {y} {z}\n" for x in (-.08, .08) for y in (-.1, .1) for z in (-.1, .1))
    faces = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
    path.write_text(points + "".join(f"f {a} {b} {c}\nf {a} {c} {d}\n" for a, b, c, d in faces))
    return path


def open_from_nothing(browser, config):
    """Opens the first head by its path. A wrong path gives one line. The opening is one step of the history."""
    refused(browser, lambda: give_path(browser, "/no/such/head.ply"), "/no/such/head.ply: no such file")
    give_path(browser, config)
    await_subject(browser, "phantom 1")
    assert len(state(browser)["landmarks"]) > 20
    browser.click("#undo")
    browser.wait("return !window.semblance.store.state.subject.triangles")
    browser.click("#redo")
    await_subject(browser, "phantom 1")


def expect_slices(browser):
    """The volume is shown in three planes before it is opened; the threshold tints other voxels as bone."""
    note = "return document.querySelector('.volume-look [role=status]').textContent"
    browser.wait(note + " !== 'Reading the volume \u2026'")
    if "ITK" in browser.run(note):
        return
    loaded = "return [...document.querySelectorAll('.slices img')].filter((i) => i.complete && i.naturalWidth > 100).length === 3"
    browser.wait(loaded)
    browser.run("const bone = document.querySelector('[data-control=bone_hu]'); bone.value = 500;"
                "bone.dispatchEvent(new Event('input')); bone.dispatchEvent(new Event('change'))")
    browser.wait("return [...document.querySelectorAll('.slices img')].every((i) => i.complete && i.src.includes('bone_hu=500'))")
    assert browser.run("return window.semblance.opener.volume.import.bone_hu") == 500
    browser.run("const bone = document.querySelector('[data-control=bone_hu]'); bone.value = 230; bone.dispatchEvent(new Event('input'))")


def open_slices(browser, folder, pictures):
    """Chooses several files together. The page asks before it replaces the head; the new head has its skin."""
    folder.mkdir()
    slices = dicom_slices.write_slices(folder)
    browser.click("[data-tab=skull]")
    browser.choose_files("#panel .chooser input[type=file]", *slices)
    browser.wait("return document.querySelector('#opening [data-way]')", seconds=100)
    expect_slices(browser)
    take_picture(browser, pictures, "ask")
    assert state(browser)["subject"]["name"] == "phantom 1", "replaced without a question"
    choose_role(browser, "head")
    browser.wait("const s = window.semblance.store.state; return s.job.name === 'open' && s.job.state !== 'running'")
    browser.wait(IDLE)
    message = browser.run(MESSAGE)
    if "ITK" in message:
        print(f"no DICOM in this build: {message}")
        browser.run("return window.semblance.opener.forget()")
        return
    now = state(browser)
    assert now["subject"]["skin"] and 130 < now["subject"]["size_mm"][0] < 150, (message, now["subject"])
    assert not now["landmarks"] and now["subject"]["name"] == "volume"
    browser.wait("const box = window.semblance.scene.main.stage.layers.get('skull').object.geometry.boundingBox;"
                 "return box && Math.abs(box.max.x - box.min.x - arguments[0]) < 2", now["subject"]["size_mm"][0])
    take_picture(browser, pictures, "ct")
    browser.click("#undo")
    await_subject(browser, "phantom 1")
    assert len(state(browser)["landmarks"]) > 20


def correct_unit(browser, mesh):
    """Corrects the unit with the button that the page offers."""
    give_path(browser, mesh)
    choose_role(browser, "head")
    await_subject(browser, mesh.stem)
    assert state(browser)["subject"]["size_mm"][0] < 1
    browser.run("[...document.querySelectorAll('#panel button')].find((b) => b.textContent === 'Use metres').click()")
    browser.wait("return window.semblance.store.state.subject.size_mm[0] > 150")
    browser.run("const axes = [...document.querySelectorAll('#panel select')].find((s) => s.value === 'LPS');"
                "axes.value = 'RAS'; axes.dispatchEvent(new Event('change'))")
    browser.wait("return window.semblance.store.state.values.subject.axes === 'RAS'")


def hostile_names(browser, pictures):
    """Names that contain tags or are longer than any line, in subject, file, site, note and title."""
    scripts = browser.run("return document.scripts.length")
    text = f"subject: {quoted(HOSTILE)}\nlandmarks:\n  - {{site: g, point: [0, -80, 0], note: {quoted(HOSTILE)}}}\n"
    drop(browser, {f"{HOSTILE.replace('/', '_')}.yaml": text})
    browser.wait("return window.semblance.store.state.landmarks.length === 1")
    assert landmark(browser, "g")["note"] == HOSTILE
    assert state(browser)["subject"]["name"] == "block", "landmarks do not rename the case"
    name_case(browser, HOSTILE)
    browser.click("[data-tab=landmarks]")
    browser.click('[data-site="g"]')
    refused(browser, lambda: drop(browser, {f"{HOSTILE.replace('/', '_')}.docx": "x"}), "<script>")
    refused(browser, lambda: drop(browser, {"a\n\u0007b.docx": "x"}), "a__b.docx")
    refused(browser, lambda: drop(browser, {f"{LONG}.zip": "x"}), "unpack it")
    drop(browser, {"sites.yaml": f"landmarks:\n  - {{site: {quoted(HOSTILE)}, point: [0, 0, 0]}}\n"})
    choose_role(browser, "landmarks")
    assert "<script>" in browser.wait(MESSAGE)
    browser.run("return window.semblance.opener.forget()")
    drop(browser, {f"{LONG}.yaml": f"title: {quoted(HOSTILE + LONG)}\ntissue: {{depths: measured}}\n"})
    choose_role(browser, "options")
    browser.wait("return window.semblance.store.state.values.title.startsWith('<script>')")
    drop(browser, {"long.yaml": f"subject: {LONG}\nlandmarks:\n  - {{site: g, point: [0, -80, 0]}}\n"})
    choose_role(browser, "landmarks")
    browser.wait(IDLE)
    name_case(browser, LONG)
    for width, height in ((1000, 640), (400, 800)):
        browser.resize(width, height)
        for tab in ("skull", "landmarks", "person", "face", "sculpt", "compare", "report", "measure"):
            go_to(browser, tab)
            browser.settle()
            wide = browser.run("return document.documentElement.scrollWidth")
            assert wide <= width, f"{tab}: {wide} pixels wide"
        take_picture(browser, pictures, f"hostile-{width}")
    browser.resize(1000, 640)
    assert browser.run("return window.hurt === undefined && document.scripts.length === arguments[0]"
                       " && !document.querySelector('[onerror], [onload], [onclick]')", scripts)


def quoted(text):
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def expect_kept(browser, button, name, begin):
    """Checks the file that a button of the panel would save. The browser does not save it."""
    browser.run("URL.createObjectURL = (blob) => { window.kept = blob; return 'blob:'; };"
                "HTMLAnchorElement.prototype.click = function () { window.keptAs = this.download; };"
                "[...document.querySelectorAll('#panel button')].find((b) => b.textContent === arguments[0]).click()", button)
    assert browser.wait("return window.keptAs") == name
    text = browser.run("return window.kept.text().then((text) => text.slice(0, 100))")
    assert text.startswith(begin), text


def compare_variants(browser, config, pictures):
    """Minus and plus one standard deviation: coarse at once, then full; under one camera, with their differences."""
    give_path(browser, config)
    choose_role(browser, "head")
    await_subject(browser, "phantom 1")
    go_to(browser, "compare")
    browser.click("[data-set=deviations]")
    frames = "document.querySelectorAll('#view .view3d-frame:not([hidden]) canvas').length"
    browser.wait(f"return {frames} === 3")
    assert browser.run("return document.querySelector('.compare-kind').dataset.kind") == "coarse"
    take_picture(browser, pictures, "compare-coarse")
    browser.click("[data-make=variants]")
    browser.wait("return document.querySelector('.compare-kind').dataset.kind === 'full'", seconds=200)
    browser.wait(f"return {frames} === 3 && !document.querySelector('#panel [role=status]').textContent")
    assert sorted(state(browser)["variants"]) == ["as_is", "thicker", "thinner"]
    means = browser.run("const mean = ({stage}) => { const v = stage.layers.get('face').object.userData.values;"
                        "return v ? v.reduce((sum, x) => sum + x, 0) / v.length : 0; };"
                        "return window.semblance.scene.others.map(mean)")
    assert means[1] == 0 and means[0] + 2 < means[2], means
    assert browser.run("const [first, ...rest] = window.semblance.scene.others;"
                       "return rest.every(({stage}) => stage.shared.camera === first.stage.shared.camera)")
    take_picture(browser, pictures, "compare-full")
    expect_kept(browser, "+ 1 SD", "thicker.ply", "ply")
    browser.resize(400, 800)
    browser.settle()
    assert browser.run("return document.documentElement.scrollWidth") <= 400
    take_picture(browser, pictures, "compare-small")


def work(browser, program, config, folder, pictures):
    folder.parent.mkdir(parents=True)
    bench = Workbench(program, ["--out", str(folder)])
    try:
        browser.open(bench.url)
        browser.wait("return window.semblance && window.semblance.store.state")
        expect_questions(browser)
        open_from_nothing(browser, config)
        open_slices(browser, folder.parent / "slices", pictures)
        correct_unit(browser, mesh_in_metres(folder.parent / "block.obj"))
        hostile_names(browser, pictures)
        compare_variants(browser, config, pictures)
        complaints = browser.complaints()
        assert not complaints, complaints
        assert not list((folder / "incoming").glob("*")), "opened and cancelled uploads are deleted"
        # The work survives a crash.
        subject = state(browser)["subject"]["name"]
        bench.kill()
        bench = Workbench(program, [str(folder)])
        browser.open(bench.url)
        browser.wait("return window.semblance && window.semblance.store.state")
        assert state(browser)["subject"]["name"] == subject
        assert len(state(browser)["variants"]) == 3
    finally:
        browser.close()
        bench.close()


def main():
    program, config, folder, *rest = sys.argv[1:]
    pictures = rest[0] if rest else None
    return run_in_browser([os.path.dirname(folder)], pictures,
                          lambda browser: work(browser, program, config, pathlib.Path(folder), pictures))


if __name__ == "__main__":
    sys.exit(main())
