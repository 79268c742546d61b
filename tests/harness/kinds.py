# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of hostile calls: each an endless or a finite row of cases, drawn from a seed."""
import dataclasses
import gzip
import hashlib
import itertools
import json
import os
import pathlib
import random
import re
import subprocess

import mutations
import seeds


@dataclasses.dataclass(frozen=True)
class Link:
    target: str


@dataclasses.dataclass(frozen=True)
class Folder:
    pass


@dataclasses.dataclass(frozen=True)
class Copy:
    of: str  # a folder of the good files


@dataclasses.dataclass
class Case:
    kind: str
    what: str
    words: list
    files: dict = dataclasses.field(default_factory=dict)  # by name: bytes, Link, Folder, Copy; in this order
    names: tuple = ("hostile",)  # one of them must stand in a refusal
    stdin: bytes = b""
    env: dict = dataclasses.field(default_factory=dict)
    modes: dict = dataclasses.field(default_factory=dict)
    as_nobody: bool = False  # else root reads everything
    stdout: str = ""  # a device in place of a file
    closed: int = None  # a descriptor that is closed
    outputs: tuple = ()  # what may be changed though it was there
    most_lines: int = 1  # of a refusal
    may_leave_on_refusal: bool = False
    may_print_anything: bool = False
    must_refuse: bool = False
    law: object = None  # laws.Law: what a done case must give

    @property
    def id(self):
        told = repr((self.words, [(n, c) for n, c in self.files.items()], self.stdin, self.env, self.modes, self.as_nobody, self.stdout, self.closed))
        return hashlib.sha1(told.encode("utf-8", "surrogateescape")).hexdigest()[:10]


GOOD = "../seeds/"
QUIET = ["--quiet", "--threads", "1"]
FACE, BALL, SITES = GOOD + "run/face.hspline.json", GOOD + "ball.ply", GOOD + "phantom/landmarks.yaml"
YAML_LINES = 60  # a configuration has all its faults at once


class World:
    def __init__(self, program, folder, seed):
        self.program, self.folder, self.seed = program, folder, seed

    def good(self, name):
        return (self.folder / name).read_bytes()

    def draw(self, kind):
        return random.Random(f"{self.seed} {kind}")

    def ask(self, *words):
        return subprocess.run([self.program, *words], capture_output=True, text=True, check=True).stdout


# ---------------------------------------------------------------------------------------------- files


def case_yaml(tree):
    return json.dumps(tree).encode()


def experiment_with(tree):
    return {"case.yaml": case_yaml({"base": GOOD + "experiment.yaml", **tree})}


def mesh_calls(name, draw):
    """Words and files beside the mesh, for a command that reads it."""
    to = draw.choice([".vtp", ".glb", ".obj", ".stl", ".ply", ".vtu", ".off"])
    files_subject = {"type": "files", "skull": GOOD + "import/skull.ply", "skin": GOOD + "import/skin.ply", "landmarks": SITES}
    return draw.choice([
        lambda: (["evaluate", name, BALL, *QUIET], {}, 1),
        lambda: (["evaluate", BALL, name, *QUIET], {}, 1),
        lambda: (["evaluate", BALL, name, "--landmarks", SITES, *QUIET], {}, 1),
        lambda: (["evaluate", name, name, *QUIET], {}, 1),
        lambda: (["export", name, "--to", "out" + to, "--threads", "1"], {}, 1),
        lambda: (["export", name, "--to", "out" + to, "--threads", "1"], {}, 1),
        lambda: (["template", name, GOOD + "landmarks.csv", "--out", "out", *QUIET], {}, 1),
        lambda: (["check", "case.yaml"], experiment_with({"subject": {**files_subject, "skull": name}}), YAML_LINES),
        lambda: (["check", "case.yaml"], experiment_with({"subject": {**files_subject, "skin": name}}), YAML_LINES),
        lambda: (["check", "case.yaml"], experiment_with({"interp": {"type": "depth_map", "file": name}}), YAML_LINES),
    ])()


def meshes(world):
    draw = world.draw("mesh")
    goods = [("ball.ply", mutations.text), ("ball_le.ply", mutations.binary), ("ball_be.ply", mutations.binary), ("ball.obj", mutations.text),
             ("ball.off", mutations.text), ("ball.stl", mutations.text), ("ball_bin.stl", mutations.binary), ("run/depth.ply", mutations.binary)]
    while True:
        good, mutate = draw.choice(goods)
        what, data = mutate(world.good(good), draw)
        ending = pathlib.Path(good).suffix if draw.random() < 0.92 else draw.choice([".ply", ".obj", ".off", ".stl", ".PLY", "", ".json", ".xyz"])
        name = "hostile" + ending
        words, files, lines = mesh_calls(name, draw)
        yield Case("meshes", f"{good}: {what}", words, {name: data, **files}, most_lines=lines, names=("hostile", "from the skull", "landmark '"))


def volumes(world):
    draw = world.draw("volume")
    heads = [("head.nii", 348), ("head.nii.gz", None), ("head.nrrd", 260), ("head_gz.nrrd", None), ("head.nhdr", None), ("head.mha", 330), ("head.mhd", None),
             ("head.inv3", None)]
    while True:
        good, head = draw.choice(heads)
        data = world.good(good)
        if good.endswith((".nhdr", ".mhd")):
            what, data = mutations.text(data, draw)
        elif good == "head.nii.gz" and draw.random() < 0.7:
            what, raw = mutations.overwrite(gzip.decompress(data), draw, 348)
            data = gzip.compress(raw, mtime=0)
        elif good == "head.inv3":
            what, data = another_project(world, draw)
        elif head and draw.random() < 0.75:  # the header alone, as text or as bytes
            what, changed = (mutations.text if good != "head.nii" else mutations.overwrite)(data[:head], draw)
            data = changed + data[head:]
        else:
            what, data = mutations.binary(data, draw)
        ending = good[good.index("."):]
        name = "hostile" + ending
        more = draw.choice([[], [], [], ["--modality", "mr"], ["--edges", "half_maximum"], ["--fill-slices"], ["--series", "1"]])
        yield Case("volumes", f"{good}: {what}", ["import-ct", name, "--out", "out", *more, *QUIET], {name: data, "head.raw": world.good("head.raw")},
                   names=("hostile", "head.raw", "--skin-value"))


def another_project(world, draw):
    voxels = world.good("head.raw")
    kind = draw.choice(["plist", "plist", "plist", "bytes", "name", "order", "twice", "voxels"])
    if kind == "plist":
        what, plist = mutations.text(seeds.PLIST, draw)
        return what, seeds.packed([("main.plist", plist), ("matrix.dat", voxels)])
    if kind == "bytes":
        return mutations.binary(world.good("head.inv3"), draw)
    if kind == "name":
        name = draw.choice(["../matrix.dat", "/matrix.dat", "matrix.dat/", "x" * 90, "matrix.da", "MATRIX.DAT"])
        return f"entry {name[:20]}", seeds.packed([("main.plist", seeds.PLIST.replace(b"matrix.dat", draw.choice([name.encode(), b"matrix.dat"]))), (name, voxels)])
    if kind == "voxels":
        size = draw.choice([0, 1, len(voxels) - 2, len(voxels) + 2])
        return f"{size} bytes of voxels", seeds.packed([("main.plist", seeds.PLIST), ("matrix.dat", (voxels + b"\0\0")[:size])])
    entries = [("matrix.dat", voxels), ("main.plist", seeds.PLIST)]
    more = draw.choice([[], [("other", b"x" * draw.randrange(1, 999))], [("main.plist", b"")], [("matrix.dat", b"12")]])
    return f"entries {kind}, {len(more)} more", seeds.packed(entries + more if kind == "order" else more + entries)


def dicom(world):
    draw = world.draw("dicom")
    slices = sorted(p.name for p in (world.folder / "phantom/ct").iterdir())
    while True:
        files, kind = {"hostile": Copy("phantom/ct")}, draw.choice(["bytes", "bytes", "bytes", "many", "gap", "name", "foreign", "alone"])
        chosen = draw.sample(slices, draw.choice([1, 1, 2, 8, len(slices)]) if kind == "many" else 1)
        what = ""
        for one in chosen:
            data = world.good("phantom/ct/" + one)
            what, changed = draw.choice([mutations.cut, mutations.overwrite, mutations.flip, mutations.another_number, mutations.drop])(data[132:1100], draw)
            if kind == "gap":
                what, files["hostile/" + one] = "a slice that is empty", b""
            elif kind == "name":
                other = draw.choice(["slice0001.dcm.bak", "DICOMDIR", "x" * 200, "ünïcode", "-", "a\nb"])
                what, files["hostile/" + other] = f"a slice twice, {other[:12]!r}", data[:132] + draw.choice([data[132:], changed + data[1100:]])
            elif kind == "foreign":
                other = draw.choice(["ball.ply", "head.nii", "head.inv3", "landmarks.pp", "run/manifest.json"])
                what, files["hostile/" + one] = f"{other} among the slices", world.good(other)
            else:
                files["hostile/" + one] = data[:132] + changed + data[1100:]
        if kind == "alone":
            files = {"hostile/one.dcm": files["hostile/" + chosen[0]]}
        more = draw.choice([[], [], ["--fill-slices"], ["--series", draw.choice(["1", "2", "x", "1.2.3"])], ["--modality", "mr"]])
        yield Case("DICOM", f"{kind}, {len(chosen)} slices: {what}", ["import-ct", "hostile", "--out", "out", *more, *QUIET], files,
                   names=("hostile", "--skin-value"), most_lines=3)


def landmarks(world):
    draw = world.draw("landmarks")
    goods = [("phantom/landmarks.yaml", mutations.yaml), ("landmarks.mrk.json", mutations.json_text), ("landmarks.fcsv", mutations.text),
             ("landmarks.pp", mutations.text), ("landmarks.csv", mutations.text), ("landmarks.txt", mutations.text), ("landmarks.asc", mutations.text)]
    while True:
        good, mutate = draw.choice(goods)
        what, data = mutate(world.good(good), draw)
        ending = good[good.index("."):] if draw.random() < 0.95 else draw.choice([".yaml", ".csv", ".fcsv", ".json", "", ".PP"])
        name = "hostile" + ending
        to = draw.choice([".yaml", ".mrk.json", ".fcsv", ".pp", ".csv", ".txt", ".asc"])
        subject = {"type": "files", "skull": GOOD + "import/skull.ply", "skin": GOOD + "import/skin.ply", "landmarks": name}
        more = draw.choice([[], [], ["--axes", "RAS"], ["--axes", "LPS"], ["--leave-out-unknown"]])
        words, files = draw.choice([
            (["landmarks", "convert", name, "out" + to, *more], {}), (["landmarks", "convert", name, "out" + to, *more], {}),
            (["check", "case.yaml"], experiment_with({"subject": subject})),
            (["evaluate", BALL, BALL, "--landmarks", name, *QUIET], {}),
            (["template", BALL, name, "--out", "out", *QUIET], {}),
        ])
        yield Case("landmarks", f"{good}: {what}", words, {name: data, **files}, most_lines=YAML_LINES, names=("hostile", "landmark", "no dowel has a tissue depth"))


def points(world):
    draw = world.draw("points")
    goods = [("points.csv", mutations.text), ("points.xyz", mutations.text), ("points.npy", mutations.binary), ("points.ply", mutations.text),
             ("points.obj", mutations.text), ("points.csv.gz", mutations.binary)]
    while True:
        good, mutate = draw.choice(goods)
        what, data = mutate(world.good(good), draw)
        name, stdin = "hostile" + good[good.index("."):], b""
        if good != "points.csv.gz" and draw.random() < 0.1:
            name, data = name + ".gz", gzip.compress(data, mtime=0)
        given = draw.choice([[], [GOOD + "fit.yaml"], [GOOD + "fit.yaml"], [GOOD + "fit.yaml"]])
        if name == "hostile.csv" and draw.random() < 0.2:
            stdin, name = data, "-"
        yield Case("points", f"{good}: {what}", ["fit", name, *given, "--out", "out", *QUIET], {} if name == "-" else {name: data}, stdin=stdin,
                   names=("hostile", "standard input", "parameters", "(u,v)"))


def faces(world):
    """H-splines, features, templates, modes: JSON."""
    draw = world.draw("faces")
    face, feature = world.good("run/face.hspline.json"), world.good("library/nose.json")
    parts = {"surface": GOOD + "template/head.hspline.json", "sites": GOOD + "template/sites.csv", "features": GOOD + "template/features.json"}
    while True:
        to = draw.choice([".ply", ".vtu", ".step", ".iges", ".glb", ".vtp", ".obj", ".stl"])
        kind = draw.choice(["face", "face", "feature", "feature", "part"])
        name, files = "hostile.json", {}
        if kind == "face":
            what, data = mutations.json_text(face, draw)
            chord = [] if to in (".vtu", ".step", ".iges") else ["--chord_mm", "3"]
            words = draw.choice([["export", name, "--to", "out" + to, *chord, "--threads", "1"], ["export", name, "--to", "out" + to, *chord, "--threads", "1"],
                                 ["edit", name, GOOD + "edits.yaml", "--out", "out.json", "--inverse", "out.yaml"],
                                 ["feature", "extract", name, "--name", "a", "--library", "out"], ["evaluate", name, BALL, *QUIET],
                                 ["feature", "apply", name, GOOD + "library/nose.json", "--out", "out.json"]])
        elif kind == "feature":
            what, data = mutations.json_text(feature, draw)
            words = draw.choice([["feature", "apply", FACE, name, "--out", "out.json"], ["feature", "mirror", name, "--name", "a", "--library", "out"],
                                 ["feature", "blend", name, GOOD + "library/nose.json", "--weights", "0.5", "0.5", "--name", "a", "--library", "out"],
                                 ["feature", "list", "hostile"]])
            if words[1] == "list":
                name = "hostile/a.json"
        else:
            part = draw.choice(list(parts))
            name = "hostile" + pathlib.Path(parts[part]).suffix
            what, data = (mutations.text if part == "sites" else mutations.json_text)(world.good(parts[part][len(GOOD):]), draw)
            what = f"template's {part}: {what}"
            files = experiment_with({"template": {"type": "file", **parts, part: name}})
            words = ["check", "case.yaml"]
        yield Case("faces", f"{kind}: {what}", words, {name: data, **files}, most_lines=YAML_LINES if words[0] == "check" else 1)


def priors(world):
    draw = world.draw("priors")
    mean, _ = world.good("mean.ply"), None
    count = int(re.search(rb"element vertex (\d+)", mean).group(1))
    modes = seeds.npy([[draw.gauss(0, 1) for _ in range(3)] for _ in range(2 * count)], 3)
    modes = modes.replace(f"({2 * count}, 3)".encode(), f"(2,{count}, 3)".encode()[:len(f"({2 * count}, 3)")].ljust(len(f"({2 * count}, 3)")))
    sites = world.good("landmarks.csv")
    places = [row.split(",")[1:4] for row in sites.decode().splitlines()[1:]]
    features = ("i_multipie,x,y,z\n" + "".join(f"{k},{','.join(places[k % len(places)])}\n" for k in range(1, 69))).encode()
    while True:
        parts = {"mean.ply": mean, "modes.npy": modes, "sites.csv": sites, "features.csv": features}
        hostile = draw.choice(list(parts))
        what, parts[hostile] = (mutations.binary if hostile in ("mean.ply", "modes.npy") else mutations.text)(parts[hostile], draw)
        yield Case("priors", f"{hostile}: {what}", ["prior", "mean.ply", "modes.npy", "--sites", "sites.csv", "--features", "features.csv", "--template",
                                                    GOOD + "template", "--out", "out.json", "--threads", "1"], parts, names=tuple(parts) + ("seeds",))


# ---------------------------------------------------------------------------------------------- configurations


def configurations(world):
    draw = world.draw("configurations")
    experiment, fit = world.good("experiment.yaml"), world.good("fit.yaml")
    study = world.good("study.yaml") + b"set: {implicit.resolution: 20}\nzip: {rounds: [1, 2], fit.features: [restore, free]}\ntags: [x]\n"
    table, network = world.good("t_table_2023.yaml"), world.good("standard32.yaml")
    whole = b"".join([experiment, b"title: 'a'\nsites: {mine: {near: [n, rhi], depth: 4}}\nregion: {exclude: [{site: zy_r, radius_mm: 20}]}\n",
                      b"interp: {type: kriging, distance: geodesic}\nlandmarks: {keep: {type: all}}\nfit: {terms: [points, {type: smoothness, weight: 1e-3}]}\n"])
    goods = {
        "experiment": (experiment, [["check", "hostile.yaml"], ["depth", "hostile.yaml", "--out", "out", *QUIET]]),
        "options": (whole, [["check", "hostile.yaml"]]),
        "fit": (fit, [["check", "hostile.yaml"], ["fit", GOOD + "points.csv", "hostile.yaml", "--out", "out", *QUIET]]),
        "study": (study, [["check", "hostile.yaml"], ["study", "plan", "hostile.yaml"]]),
        "edits": (world.good("edits.yaml"), [["edit", FACE, "hostile.yaml", "--out", "out.json"]]),
        "table": (table, [["landmarks", "page", "hostile.yaml", "--out", "out"], ["check", "case.yaml"]]),
        "network": (network, [["check", "case.yaml"]]),
    }
    files = {"table": experiment_with({"tissue": {"depths": "table", "table": "hostile.yaml"}}), "network": experiment_with({"network": "hostile.yaml"}),
             "study": {"experiment.yaml": experiment}}
    while True:
        kind = draw.choice(list(goods))
        good, calls = goods[kind]
        what, data = mutations.yaml(good, draw)
        words = draw.choice(calls)
        yield Case("configurations", f"{kind}: {what}", words, {"hostile.yaml": data, **files.get(kind, {})}, most_lines=YAML_LINES)


def leaves(schema, path=()):
    """Options of a schema: a path and how to write a value there, and the option's own schema."""
    for key, value in schema.get("properties", {}).items():
        if key == "type" and "const" in value:
            continue
        here = path + (key,)
        yield here, value
        yield from leaves(value, here)
        items = value.get("items", {})
        for option in [o for o in value.get("anyOf", []) if "properties" in o]:
            kind = option["properties"].get("type", {}).get("const")
            yield from leaves(option, here[:-1] + ((key, kind),))
        for option in [o for o in items.get("anyOf", []) if "properties" in o]:
            kind = option["properties"].get("type", {}).get("const")
            yield from leaves(option, here[:-1] + ((key, kind, "list"),))


def written(path, value):
    tree = value
    for step in reversed(path):
        if isinstance(step, str):
            tree = {step: tree}
        elif len(step) == 2:
            tree = {step[0]: {"type": step[1], **(tree if isinstance(tree, dict) else {})}}
        else:
            tree = {step[0]: [{"type": step[1], **(tree if isinstance(tree, dict) else {})}]}
    return tree


def option_values(schema, draw):
    """Numbers at and beyond their ends, and values of other types."""
    found = []
    for option in [schema, *schema.get("anyOf", [])]:
        for key, sign in (("minimum", -1), ("maximum", 1), ("exclusiveMinimum", -1)):
            if key in option:
                end = option[key]
                found += [end, end + sign * max(1, abs(end) * 1e-9), -end, end * 1e300 if abs(end) < 1e8 else end]
    return found + draw.sample(mutations.VALUES, 3)


def options(world):
    """Every option of every kind of file: its ends, beyond them, other types."""
    draw = world.draw("options")
    rows = []
    for kind in ("experiment", "fit", "study"):
        schema = json.loads(world.ask("options", kind, "--schema"))
        for path, leaf in leaves(schema):
            for value in option_values(leaf, draw):
                tree = written(path, value)
                name = ".".join(step if isinstance(step, str) else step[0] for step in path)
                base = {"experiment": {"base": GOOD + "experiment.yaml"}, "study": {"base": GOOD + "experiment.yaml"}, "fit": {"patches_u": 4}}[kind]
                try:
                    text = json.dumps({**base, **tree}, allow_nan=True).replace("Infinity", ".inf").encode()
                except (ValueError, OverflowError):
                    continue
                rows.append(Case("options", f"{kind} {name} = {str(value)[:30]!r}", ["check", "hostile.yaml"], {"hostile.yaml": text}, most_lines=YAML_LINES))
    draw.shuffle(rows)
    yield from rows


# ---------------------------------------------------------------------------------------------- studies


def studies(world):
    draw = world.draw("studies")
    trials = sorted(p.name for p in (world.folder / "study/trials").iterdir())
    face_trials = sorted(p.name for p in (world.folder / "faces/trials").iterdir())
    while True:
        of, ids = draw.choice([("study", trials), ("study", trials), ("faces", face_trials)])
        name = draw.choice(["plan.json", "plan.json"] + [f"trials/{one}/trial.json" for one in ids] + [f"trials/{draw.choice(ids)}/manifest.json"])
        if not (world.folder / of / name).exists():
            continue
        what, data = mutations.json_text(world.good(f"{of}/{name}"), draw)
        files = {"hostile": Copy(of), f"hostile/{name}": data}
        extra = draw.random()
        if extra < 0.1:
            link = draw.choice(["trials/x", "trials/" + ids[0] + "/more", "report.html2"])
            files["hostile/" + link] = Link(draw.choice(["/etc/passwd", "..", "nosuch", ".", "/dev/zero"]))
            what += f", a link {link}"
        elif extra < 0.15:
            files["hostile/trials/" + draw.choice(["", "x\n", "ü", "-f"]) + "stray"] = b"x"
        words, outputs = draw.choice([
            (["status", "hostile"], ()), (["merge", "hostile"], ("hostile",)), (["merge", "out", "hostile"], ("out",)),
            (["report", "hostile"], ("hostile",)), (["compare", "hostile", GOOD + of], ()), (["compare", GOOD + of, "hostile", "--out", "out"], ()),
            (["merge", "out", GOOD + "shard0", "hostile"], ("out",)),
        ])
        if of == "study" and draw.random() < 0.1:
            words, outputs = ["study", GOOD + "study.yaml", "--out", "hostile", "--quiet"], ("hostile",)
        yield Case("studies", f"{of}/{name}: {what}", words, files, outputs=outputs, most_lines=YAML_LINES,
                   may_print_anything=".values." in what)  # the words of a value are told as they are


def runs(world):
    """The folder of a run with a file that is damaged, for report and export."""
    draw = world.draw("runs")
    names = [n for n in ("result.json", "scene.json", "timing.json", "provenance.json", "manifest.json", "resolved.yaml", "dowels.csv", "face.hspline.json",
                         "face.ply", "depth.ply", "implicit.ply") if (world.folder / "run" / n).exists()]
    while True:
        name = draw.choice(names)
        data = world.good("run/" + name)
        mutate = {".json": mutations.json_text, ".yaml": mutations.yaml, ".csv": mutations.text, ".ply": mutations.binary}[pathlib.Path(name).suffix]
        what, data = draw.choice([("gone", None), mutate(data, draw), mutate(data, draw), mutate(data, draw)])
        files = {f"hostile/{n}": world.good("run/" + n) for n in names}
        if data is None:
            del files["hostile/" + name]
        else:
            files["hostile/" + name] = data
        words, outputs = draw.choice([(["report", "hostile"], ("hostile",)), (["export", "hostile", "--to", "out.glb", "--threads", "1"], ())])
        yield Case("runs", f"{name}: {what}", words, files, outputs=outputs)


def populations(world):
    """A population whose file is damaged, or what was measured of a subject, in its folder or another shard's."""
    draw = world.draw("populations")
    good = world.good("crowd.yaml")
    measured = sorted(p.name for p in (world.folder / "crowd/subjects").iterdir())
    while True:
        if draw.random() < 0.4:
            what, data = mutations.yaml(good, draw)
            words = draw.choice([["check", "hostile.yaml"], ["population", "hostile.yaml", "--list"]])
            yield Case("populations", f"file: {what}", words, {"hostile.yaml": data}, most_lines=YAML_LINES)
            continue
        name = "subjects/" + draw.choice(measured)
        what, data = mutations.json_text(world.good("crowd/" + name), draw)
        words, outputs = draw.choice([(["--out", "hostile"], ("hostile",)), (["--out", "out", "--from", "hostile"], ("out",))])
        yield Case("populations", f"{name}: {what}", ["population", GOOD + "crowd.yaml", *words, *QUIET],
                   {"hostile": Copy("crowd"), "hostile/" + name: data}, outputs=outputs)


# ---------------------------------------------------------------------------------------------- command lines


CALLS = {
    "run": ["nosuch.yaml"], "depth": ["nosuch.yaml"], "fit": [GOOD + "points.csv", GOOD + "fit.yaml", "--out", "out", "--quiet"],
    "import-ct": [GOOD + "head.nii", "--out", "out", "--quiet"], "check": [GOOD + "fit.yaml"], "options": ["fit"], "evaluate": [BALL, BALL, "--quiet"],
    "report": ["nosuch"], "study": [GOOD + "study.yaml", "--list"], "submit": [GOOD + "study.yaml", "--slurm"], "merge": ["nosuch"],
    "compare": [GOOD + "study", GOOD + "shard0"], "status": [GOOD + "study"], "edit": [FACE, GOOD + "edits.yaml", "--out", "out.json"],
    "export": [FACE, "--to", "out.ply", "--chord_mm=5"], "prior": ["a.ply", "b.npy", "--sites", "c.csv", "--features", "d.csv", "--template", "e", "--out", "out"],
    "feature extract": [FACE, "--name", "a", "--library", "out"], "feature apply": [FACE, GOOD + "library/nose.json", "--out", "out.json"],
    "feature blend": [GOOD + "library/nose.json", "--weights", "1", "--name", "a", "--library", "out"],
    "feature mirror": [GOOD + "library/nose.json", "--name", "a", "--library", "out"], "feature list": [GOOD + "library"],
    "feature fuse": [BALL, BALL, "--out", "out.ply"],
    "landmarks convert": [SITES, "out.csv"], "landmarks page": [GOOD + "t_table_2023.yaml", "--out", "out"], "landmarks propose": ["nosuch.ply"],
    "template": [GOOD + "experiment.yaml", "--out", "out", "--quiet"], "recentre": ["nosuch.yaml", "--out", "out"],
    "phantom": ["--out", "out", "--head=smooth", "--pixel-mm=5", "--slice-mm=10"], "workbench": ["nosuch.ply"], "completion": ["bash"], "manual": [],
}
WORDS = ["", " ", "0", "-1", "1", "nan", "inf", "1e999", "1e308", "-0", "4294967296", "99999999999999999999", "0x10", "1.5", "abc", "'", "\"", "--", "-", "a b",
         "a\nb", "\x1b[2J", "\u202ex", "\U0001f480", "x" * 5000, "/", "..", ".", "nosuch/file", "=", "=1", "a=b", "a=", "%n%s", "$(id)", "`id`", "*", "~", "true", "1/2", "0/0"]


def command_lines(world):
    draw = world.draw("command lines")
    rows = []
    for command, base in CALLS.items():
        words = command.split()
        known = sorted(set(re.findall(r"(?<![\w-])--[a-z][\w-]*", world.ask(*words, "--help"))) - {"--help"})
        more = known + ["--nosuch", "-x", "--" + "y" * 3000, "--ou", "--\u00fc", "--out\n"]
        for option in more:
            for value in draw.sample(WORDS, 5):
                rows.append((command, [*words, *base, f"{option}={value}"], (option[:20], option.lstrip("-")[:20], value[:20] or " ", "nosuch")))
            rows.append((command, [*words, *base, option], (option[:20], "nosuch")))
            rows.append((command, [*words, option, *base, option], (option[:20], "nosuch", "is required", *base)))  # it may take the base as its value
        for cut in range(len(base)):
            rows.append((command, [*words, *base[:cut]], ("",)))
        for word in draw.sample(WORDS, 8):
            rows.append((command, [*words, *base, word], (word[:20] or " ", *base, "nosuch", "")))
            rows.append((command, [*words, word, *base], (word[:20] or " ", *base, "nosuch", "")))
    for word in WORDS + ["runs", "RUN", "Run ", "help", "feature", "landmarks", "feature x", "--", "-h -h"]:
        rows.append(("none", [word], ("",)))
        rows.append(("none", [word, "run"], ("",)))
    draw.shuffle(rows)
    for command, words, names in rows:
        listens = command == "workbench" and "nosuch.ply" not in words
        if not listens and not (command == "workbench" and any(w in ("", ".", "/", "..") for w in words)):
            yield Case("command lines", command, words, names=(*names, "no such file"), most_lines=YAML_LINES, outputs=("out",), may_print_anything=command in ("completion", "manual", "options"),
                       env={"PATH": "/nonexistent"} if command == "submit" else {}, may_leave_on_refusal=command == "submit")  # what was written is said


# ---------------------------------------------------------------------------------------------- names


def file_arguments(world):
    """For each command, calls with one file in the place of HERE."""
    return [
        ["run", "HERE", "--out", "out", *QUIET], ["depth", "HERE", "--out", "out", *QUIET], ["fit", "HERE", "--out", "out", *QUIET],
        ["fit", GOOD + "points.csv", "HERE", "--out", "out", *QUIET], ["import-ct", "HERE", "--out", "out", *QUIET], ["check", "HERE"],
        ["evaluate", "HERE", BALL, *QUIET], ["evaluate", BALL, "HERE", *QUIET], ["evaluate", BALL, BALL, "--landmarks", "HERE", *QUIET],
        ["evaluate", BALL, "--config", "HERE", *QUIET], ["report", "HERE"], ["study", "HERE", "--out", "out", "--quiet"], ["study", "plan", "HERE"],
        ["submit", "HERE", "--slurm", "--out", "out"], ["merge", "HERE"], ["merge", "out", "HERE"], ["compare", "HERE", GOOD + "study"], ["compare", GOOD + "study", "HERE"],
        ["status", "HERE"], ["edit", "HERE", GOOD + "edits.yaml", "--out", "out.json"], ["edit", FACE, "HERE", "--out", "out.json"],
        ["export", "HERE", "--to", "out.ply"], ["feature", "extract", "HERE", "--name", "a", "--library", "out"], ["feature", "apply", "HERE", GOOD + "library/nose.json", "--out", "out.json"],
        ["feature", "apply", FACE, "HERE", "--out", "out.json"], ["feature", "blend", "HERE", "--weights", "1", "--name", "a", "--library", "out"],
        ["feature", "mirror", "HERE", "--name", "a", "--library", "out"], ["feature", "list", "HERE"], ["landmarks", "convert", "HERE", "out.csv"],
        ["feature", "fuse", "HERE", BALL, "--out", "out.ply"], ["feature", "fuse", BALL, "HERE", "--out", "out.ply"],
        ["landmarks", "page", "HERE", "--out", "out"], ["landmarks", "propose", "HERE", "--out", "out.yaml", *QUIET],
        ["landmarks", "propose", GOOD + "import/skull.ply", "--reference", "HERE", SITES, "--out", "out.yaml", *QUIET],
        ["landmarks", "propose", GOOD + "import/skull.ply", "--reference", GOOD + "import/skull.ply", "HERE", "--out", "out.yaml", *QUIET],
        ["template", "HERE", "--out", "out", *QUIET], ["template", "HERE", GOOD + "landmarks.csv", "--out", "out", *QUIET], ["template", BALL, "HERE", "--out", "out", *QUIET],
        ["recentre", "HERE", "--out", "out"], ["prior", "HERE", "b.npy", "--sites", "c", "--features", "d", "--template", GOOD + "template", "--out", "out.json"],
        ["prior", GOOD + "mean.ply", "HERE", "--sites", SITES, "--features", "d", "--template", GOOD + "template", "--out", "out.json"],
        ["prior", GOOD + "mean.ply", "HERE", "--sites", "c", "--features", "d", "--template", "HERE", "--out", "out.json"],
    ]


def output_arguments():
    """Calls that would be done, with the output in the place of HERE."""
    return [
        ["depth", GOOD + "experiment.yaml", "--out", "HERE", *QUIET], ["fit", GOOD + "points.csv", GOOD + "fit.yaml", "--out", "HERE", *QUIET],
        ["import-ct", GOOD + "head.nii", "--out", "HERE", *QUIET], ["edit", FACE, GOOD + "edits.yaml", "--out", "HERE"],
        ["edit", FACE, GOOD + "edits.yaml", "--out", "out.json", "--inverse", "HERE"], ["export", FACE, "--to", "HERE.ply", "--chord_mm", "5"],
        ["feature", "mirror", GOOD + "library/nose.json", "--name", "a", "--library", "HERE"], ["feature", "apply", FACE, GOOD + "library/nose.json", "--out", "HERE"],
        ["landmarks", "convert", SITES, "HERE.csv"], ["landmarks", "page", GOOD + "t_table_2023.yaml", "--out", "HERE"],
        ["template", GOOD + "experiment.yaml", "--out", "HERE", *QUIET], ["phantom", "--out", "HERE", "--head", "smooth", "--pixel-mm", "5", "--slice-mm", "10"],
        ["merge", "HERE", GOOD + "shard0", GOOD + "shard1"], ["compare", GOOD + "study", GOOD + "shard0", "--out", "HERE"],
        ["study", GOOD + "study.yaml", "--out", "HERE", "--quiet"], ["workbench", "--out", "HERE/x"],
    ]


def places(name):
    """What lies under a name that is given for a file: the word, the files, and how the case is called."""
    byte_name = b"host\xff\xfeile" + pathlib.Path(name).suffix.encode()
    return [
        ("missing", name, {}, {}), ("a folder", name, {name: Folder()}, {}), ("empty", name, {name: b""}, {}), ("a loop", name, {name: Link(name)}, {}),
        ("dangling", name, {name: Link("nosuch")}, {}), ("/dev/null", "/dev/null", {}, {}), ("a file as a folder", "hostile/x.ply", {"hostile": b"x"}, {}),
        ("300 letters", "hostile" * 43, {}, {}), ("a long path", "hostile/" * 700, {}, {}), ("no name", "", {}, {}), ("unreadable", name, {name: b"{}"}, {"as_nobody": True, "modes": {name: 0}}),
        ("an unreadable folder", "hostile/x" + pathlib.Path(name).suffix, {"hostile/x" + pathlib.Path(name).suffix: b"{}"}, {"as_nobody": True, "modes": {"hostile": 0}}),
        ("a name with an order", "hostile\x1b[2J" + pathlib.Path(name).suffix, {"hostile\x1b[2J" + pathlib.Path(name).suffix: b"x"}, {}),
        ("a name of two lines", "hostile\nx" + pathlib.Path(name).suffix, {"hostile\nx" + pathlib.Path(name).suffix: b"x"}, {}),
        ("a name that is no UTF-8", os.fsdecode(byte_name), {byte_name: b"x"}, {"names": ("host",)}), ("/proc/self/mem", "/proc/self/mem", {}, {}),
        ("/dev/full", "/dev/full", {}, {}), ("a kilobyte of /dev/zero", name, {name: b"\0" * 1000}, {}), ("the root", "/", {}, {"names": ("/",)}),
    ]


def names(world):
    draw = world.draw("names")
    rows = []
    for call in file_arguments(world):
        ending = ".yaml" if call[0] in ("run", "depth", "check", "study", "submit", "recentre") else draw.choice([".ply", ".json", ".csv", ".yaml", ".nii", ".npy"])
        for what, word, files, more in places("hostile" + ending):
            must = more.get("names", ("hostile", word))
            rows.append(Case("names", f"{what} for {' '.join(call[:2])}", [word if w == "HERE" else w for w in call], files,
                             **{"names": must if word else ("",), "most_lines": YAML_LINES, "must_refuse": what not in ("/dev/null", "the root", "empty"),
                                "outputs": ("hostile",), **{k: v for k, v in more.items() if k != "names"}}))
    for call in output_arguments():
        for what, word, files, more in [
                ("a file", "hostile", {"hostile": b"mine", "hostile.ply": b"mine", "hostile.csv": b"mine"}, {}), ("a loop", "hostile", {"hostile": Link("hostile"), "hostile.ply": Link("hostile.ply"), "hostile.csv": Link("hostile.csv")}, {}),
                ("below a file", "hostile/x", {"hostile": b"mine"}, {}), ("a folder that holds something", "hostile", {"hostile/mine": b"mine", "hostile.ply/x": b"", "hostile.csv/x": b""}, {}),
                ("an unwritable folder", "hostile/x", {"hostile": Folder()}, {"as_nobody": True, "modes": {"hostile": 0o555}}), ("/dev/full", "/dev/full", {}, {"names": ("/dev/full",)}),
                ("/proc/x", "/proc/hostile", {}, {}), ("300 letters", "hostile" * 43, {}, {}), ("no name", "", {}, {"names": ("",)})]:
            if what == "no name" and any("HERE." in w or "HERE/" in w for w in call):
                continue  # a name all the same
            if what == "a folder that holds something" and call[0] == "workbench":
                continue  # a new folder in it; it would be served
            if what in ("/dev/full", "/proc/x") and any("HERE." in w for w in call):
                continue  # a name beside it
            allowed = what in ("a folder that holds something",) and call[0] in ("feature", "landmarks", "merge", "study", "workbench", "edit")
            rows.append(Case("names", f"output {what}: {' '.join(call[:2])}", [w.replace("HERE", word) for w in call], files,
                             **{"names": ("hostile",), "most_lines": 2, "must_refuse": not allowed, "outputs": (), **more}))
    draw.shuffle(rows)
    yield from rows


def many(world):
    """Many at once."""
    n = lambda k, word: [word] * k
    rows = [
        ["check", *n(300, GOOD + "fit.yaml"), "hostile.yaml"], ["check", *n(400, "hostile.yaml")], ["landmarks", "page", *n(60, GOOD + "t_table_2023.yaml"), "--out", "out"],
        ["feature", "apply", FACE, *n(400, GOOD + "library/nose.json"), "hostile.yaml", "--out", "out.json"],
        ["feature", "blend", *n(200, GOOD + "library/nose.json"), "--weights", *n(199, "1"), "--name", "a", "--library", "out"],
        ["feature", "blend", *n(200, GOOD + "library/nose.json"), "--weights", *n(200, "1e306"), "--name", "a", "--library", "out"],
        ["merge", "out", *n(500, "hostile.yaml")], ["merge", "out", *n(100, GOOD + "shard0"), "hostile.yaml"], ["compare", *n(100, GOOD + "study")], ["compare", *n(101, GOOD + "study")],
        ["template", BALL, *n(100, GOOD + "landmarks.csv"), "--out", "out", *QUIET], ["recentre", *n(300, "hostile.yaml"), "--out", "out"],
        ["evaluate", BALL, BALL, "--landmarks", SITES, *sum([["--exclude", "zy_r=15"]] * 500, []), *QUIET], ["check", GOOD + "experiment.yaml", *sum([["--set", "rounds=2"]] * 1000, [])],
        ["check", GOOD + "experiment.yaml", *sum([["--set", f"nosuch{k}=2"] for k in range(1000)], [])], ["check", GOOD + "experiment.yaml", "--set", "interp=" + "[" * 50000],
        ["landmarks", "propose", "hostile.yaml", *sum([["--reference", "hostile.yaml", SITES]] * 200, []), "--out", "out.yaml", *QUIET],
        ["depth", "hostile.yaml", "--out", "out", *sum([["--set", "a=1"]] * 3000, [])], ["status", *n(1000, "hostile.yaml")], ["study", *n(50, "hostile.yaml")],
        ["study", "hostile.yaml", "--only", "(" * 20000], ["study", "plan", GOOD + "study.yaml", "--only", "not " * 20000 + "subject = a"],
        ["study", "plan", GOOD + "study.yaml", "--only", " and ".join(["subject = a"] * 5000)], ["study", "plan", GOOD + "study.yaml", "--only", "subject ~ " + "*a" * 2000],
        ["study", "plan", GOOD + "study.yaml", "--only", "(" * 60 + "subject = a" + ")" * 60], ["study", "plan", GOOD + "study.yaml", "--only", "subject = 'a"],
    ]
    lists = {
        "a grid of 4e9": {"grid": {name: list(range(1, 250)) for name in ("subject.random_seed", "rounds", "implicit.resolution", "seeds.level")}},
        "150,000 subjects": {"subjects": [{"name": str(k)} for k in range(150000)]},
        "1,000 subjects of one name": {"subjects": [{"name": "a"} for _ in range(1000)]},
        "4,000 samples": {"sample": {"n": 4000, "ranges": {"seeds.weight": [0.1, 1.0]}}},
        "samples without end": {"sample": {"n": 10**18, "ranges": {"seeds.weight": [0.1, 1.0]}}},
        "a zip of unequal lists": {"zip": {"rounds": [1, 2], "seeds.weight": [0.1]}},
        "a list of 4,000": {"list": [{"rounds": 1}] * 4000},
        "200 axes": {"grid": {f"nosuch{k}": [1, 2] for k in range(200)}},
        "2,000 alternatives": {"alternatives": [{"name": str(k), "set": {"rounds": 1}} for k in range(2000)]},
        "10,000 sites": {"sites": {f"s{k}": {"near": ["n", "rhi"], "depth": 4} for k in range(10000)}},
        "50,000 terms": {"fit": {"terms": ["points"] * 50000}},
        "a schedule of 50,000": {"fit": {"plan": {"type": "listed", "schedule": [{"level": 0}] * 50000}}},
        "10,000 zones": {"region": {"exclude": [{"site": "zy_r", "radius_mm": 20}] * 10000}},
        "a key twice": None, "a base of itself": {"base": "hostile.yaml"}, "100,000 keys": {f"k{k}": 1 for k in range(100000)},
    }
    for words in rows:
        yield Case("many at once", " ".join(words[:2]), words, {"hostile.yaml": b"nosuch: 1\n"}, names=("",), most_lines=1200)
    for what, tree in lists.items():
        text = b"rounds: 1\nrounds: 2\n" if tree is None else case_yaml({"base": GOOD + "experiment.yaml", **tree})
        for words in (["check", "hostile.yaml"], ["study", "plan", "hostile.yaml"], ["study", "hostile.yaml", "--out", "out", "--shard", "9999/100000", "--quiet"]):
            if tree is not None and "subjects" in tree and len(tree["subjects"]) > 5000 and words[0] == "study" and "--shard" in words:
                continue
            yield Case("many at once", f"{what}: {words[0]}", words, {"hostile.yaml": text}, most_lines=YAML_LINES, outputs=("out",), may_leave_on_refusal=False)
    # A chain of bases, and a tree of them.
    for depth in (10, 60, 100, 1000):
        files = {f"b{k}.yaml": case_yaml({"base": f"b{k + 1}.yaml"}) for k in range(depth)}
        files[f"b{depth}.yaml"] = case_yaml({"base": GOOD + "experiment.yaml"})
        yield Case("many at once", f"{depth} bases", ["check", "b0.yaml"], files, names=("b",), most_lines=YAML_LINES)


def surroundings(world):
    """Variables, descriptors and devices."""
    calls = [["check", GOOD + "fit.yaml"], ["options"], ["evaluate", BALL, BALL, *QUIET], ["status", GOOD + "study"], ["fit", GOOD + "points.csv", GOOD + "fit.yaml", "--out", "out", *QUIET],
             ["manual"], ["landmarks", "convert", SITES, "out.csv"], ["depth", GOOD + "experiment.yaml", "--out", "out", *QUIET], ["fit", "-", GOOD + "fit.yaml", "--out", "out", *QUIET]]
    around = [{"HOME": "/nonexistent"}, {"HOME": ""}, {"LANG": "xx_YY.UTF-8", "LC_ALL": "nosuch"}, {"LC_ALL": "de_DE.UTF-8"}, {"TMPDIR": "/nonexistent"}, {"PATH": ""},
              {"TERM": "", "COLUMNS": "-1"}, {"COLUMNS": "99999999999"}, {"OMP_NUM_THREADS": "-3"}, {"OMP_NUM_THREADS": "abc", "OPENBLAS_NUM_THREADS": "0"},
              {"SLURM_ARRAY_TASK_ID": "x", "SLURM_ARRAY_TASK_COUNT": "y"}, {"ITK_AUTOLOAD_PATH": "/tmp"}, {"TZ": "x" * 2000}, {"CSF_OCCTResourcePath": "/nonexistent"}]
    for call, env in itertools.product(calls, around):
        yield Case("surroundings", str(env)[:60], call, env=env, names=("",), may_print_anything=call[0] in ("manual", "options"))
    for call, closed in itertools.product(calls, (0, 1, 2)):
        yield Case("surroundings", f"descriptor {closed} is closed", call, closed=closed, names=("",), may_print_anything=True)
    for call in calls:
        yield Case("surroundings", "a full standard output", call, stdout="/dev/full", names=("",), outputs=("out",), may_leave_on_refusal=True)
    for shard in ({"SLURM_ARRAY_TASK_ID": i, "SLURM_ARRAY_TASK_COUNT": n} for i, n in [("0", "0"), ("5", "2"), ("-1", "2"), ("x", "2"), ("1", ""), ("1e3", "9"), ("99999999999", "1")]):
        yield Case("surroundings", f"{shard}", ["study", GOOD + "study.yaml", "--out", "out", "--quiet"], env=shard, names=("shard",))


SHARES = {meshes: 260, volumes: 170, dicom: 60, landmarks: 190, points: 170, faces: 190, priors: 40, configurations: 230, options: 230, studies: 120, runs: 60, populations: 60,
          command_lines: 260, names: 260, many: 80, surroundings: 80}


def cases(program, folder, seed, count):
    """About `count` different cases, by kinds in turn."""
    world = World(program, folder, seed)
    found, seen = [], set()
    for kind, share in SHARES.items():
        wanted = max(1, round(share * count / sum(SHARES.values())))
        taken = 0
        rows = list(kind(world)) if kind in (many, surroundings) else kind(world)
        if isinstance(rows, list):
            world.draw(kind.__name__).shuffle(rows)
        for case in itertools.islice(rows, 50 * wanted):
            if taken == wanted:
                break
            if case.id not in seen:
                seen.add(case.id)
                found.append(case)
                taken += 1
    return found
