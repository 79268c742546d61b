# SPDX-License-Identifier: GPL-3.0-or-later
"""Cases whose right result is known: the same input in another form, and everyday mistakes.

A case of the first kind must give the result of the plain input. A mistake must be refused, end as not usable, or be told in a
note; without a word only a result within the limit is allowed.
"""
import csv
import dataclasses
import io
import json
import math
import pathlib
import random
import re
import struct
import subprocess

from kinds import GOOD, QUIET, Case

FACE_LIMIT_MM = 0.02  # RMS between two faces that should be one
DEPTH_LIMIT_MM = 0.3  # RMS of depth against a skin that is mistaken, over the right one
NOISE_LIMIT = 0.5  # how many noises a fit may be farther from the truth than the plain fit


@dataclasses.dataclass
class Law:
    """deviation(folder, printed) compares what a done case wrote or printed with the right result."""
    deviation: object
    limit: float
    known_notes: frozenset = frozenset()  # those of the plain input
    is_mistake: bool = False


# ---------------------------------------------------------------------------------------------- geometry


def apply(matrix, p, shift=(0, 0, 0)):
    return tuple(row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + s for row, s in zip(matrix, shift))


def transposed(matrix):
    return [list(column) for column in zip(*matrix)]


def rotation(axis, degrees):
    a, n = math.radians(degrees), math.hypot(*axis)
    (x, y, z), c, s = (v / n for v in axis), math.cos(a), math.sin(a)
    t = 1 - c
    return [[t * x * x + c, t * x * y - s * z, t * x * z + s * y], [t * x * y + s * z, t * y * y + c, t * y * z - s * x],
            [t * x * z - s * y, t * y * z + s * x, t * z * z + c]]


IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
RAS, MIRROR = [[-1, 0, 0], [0, -1, 0], [0, 0, 1]], [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]


def any_direction(draw):
    return [draw.gauss(0, 1) for _ in range(3)]


def rms(values):
    values = list(values)
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.inf


@dataclasses.dataclass(frozen=True)
class Mesh:
    points: list
    triangles: list

    def moved(self, matrix, shift=(0, 0, 0)):
        return Mesh([apply(matrix, p, shift) for p in self.points], self.triangles)

    def scaled(self, factor):
        return Mesh([tuple(factor * c for c in p) for p in self.points], self.triangles)

    def flipped(self):
        return Mesh(self.points, [(a, c, b) for a, b, c in self.triangles])

    def permuted(self, draw):
        order = list(range(len(self.points)))
        draw.shuffle(order)
        number = {old: new for new, old in enumerate(order)}
        turned = [tuple(number[v] for v in (t[k:] + t[:k])) for t in self.triangles for k in [draw.randrange(3)]]
        draw.shuffle(turned)
        return Mesh([self.points[v] for v in order], turned)

    def refined(self):
        """Each triangle becomes four."""
        points, triangles, middle = list(self.points), [], {}

        def between(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle:
                middle[key] = len(points)
                points.append(tuple((x + y) / 2 for x, y in zip(points[a], points[b])))
            return middle[key]

        for a, b, c in self.triangles:
            ab, bc, ca = between(a, b), between(b, c), between(c, a)
            triangles += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        return Mesh(points, triangles)

    def parts(self, selections):
        """The selected triangles, each selection with vertices of its own."""
        points, triangles = [], []
        for selection in selections:
            number = {}
            for t in selection:
                for v in t:
                    if v not in number:
                        number[v] = len(points)
                        points.append(self.points[v])
                triangles.append(tuple(number[v] for v in t))
        return Mesh(points, triangles)

    def without_ball(self, centre, radius_mm):
        return self.parts([[t for t in self.triangles if math.dist(self.points[t[0]], centre) > radius_mm]])

    def in_pieces(self, draw):
        matrix = rotation(any_direction(draw), draw.uniform(0, 180))
        keys = [tuple(c > 0 for c in apply(matrix, self.points[t[0]])) for t in self.triangles]
        return self.parts([[t for t, k in zip(self.triangles, keys) if k == key] for key in sorted(set(keys))])


def ply(mesh, kind="double", comment=""):
    """Binary PLY."""
    letter = {"double": "d", "float": "f"}[kind]
    head = "ply\nformat binary_little_endian 1.0\n" + (f"comment {comment}\n" if comment else "")
    head += f"element vertex {len(mesh.points)}\n" + "".join(f"property {kind} {axis}\n" for axis in "xyz")
    head += f"element face {len(mesh.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    return head.encode() + b"".join(struct.pack(f"<3{letter}", *p) for p in mesh.points) + b"".join(struct.pack("<B3i", 3, *t) for t in mesh.triangles)


def obj(mesh):
    return ("".join("v {!r} {!r} {!r}\n".format(*p) for p in mesh.points)
            + "".join("f {} {} {}\n".format(*(v + 1 for v in t)) for t in mesh.triangles)).encode()


SIZES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}


def read_ply(path):
    head, _, body = path.read_bytes().partition(b"end_header\n")
    vertices, triangles, at, vertex = 0, 0, 0, "<"
    for words in map(str.split, head.decode().splitlines()):
        if words[:2] == ["element", "vertex"]:
            vertices = int(words[2])
        elif words[:2] == ["element", "face"]:
            triangles = int(words[2])
        elif words[:1] == ["property"] and words[1] != "list":
            vertex += SIZES[words[1]]
    row = struct.Struct(vertex)
    points = [row.unpack_from(body, k * row.size)[:3] for k in range(vertices)]
    at = vertices * row.size
    return Mesh(points, [struct.unpack_from("<3i", body, at + 13 * k + 1) for k in range(triangles)])


# ---------------------------------------------------------------------------------------------- heads


@dataclasses.dataclass(frozen=True)
class Mark:
    site: str
    point: tuple
    normal: tuple
    depth_mm: float


def other_side(site):
    return site[:-1] + {"l": "r", "r": "l"}[site[-1]] if site.endswith(("_l", "_r")) else site


@dataclasses.dataclass(frozen=True)
class Head:
    skull: Mesh
    skin: Mesh
    marks: list

    def moved(self, matrix, shift=(0, 0, 0)):
        marks = [Mark(m.site, apply(matrix, m.point, shift), apply(matrix, m.normal), m.depth_mm) for m in self.marks]
        return Head(self.skull.moved(matrix, shift), self.skin.moved(matrix, shift), marks)

    def mirrored(self):
        head = self.moved(MIRROR)
        return Head(head.skull.flipped(), head.skin.flipped(), [dataclasses.replace(m, site=other_side(m.site)) for m in head.marks])

    def with_marks(self, change):
        return dataclasses.replace(self, marks=[change(m) for m in self.marks])


def marks_file(marks, draw=None, axes="LPS", units="mm", depth_factor=1.0):
    """JSON, which is YAML. draw: shuffles landmarks and keys."""
    scale = {"mm": 1, "cm": 0.1, "m": 0.001, "in": 1 / 25.4}[units]
    turn = RAS if axes == "RAS" else IDENTITY
    rows = [{"site": m.site, "point": [scale * c for c in apply(turn, m.point)], "normal": list(apply(turn, m.normal)),
             "depth_along_normal_mm": depth_factor * m.depth_mm} for m in marks]
    tree = {"subject": "a head", "units": units, "axes": axes, "landmarks": rows}
    if draw:
        draw.shuffle(rows)
        shuffled = lambda d: dict(draw.sample(list(d.items()), len(d)))
        tree["landmarks"] = list(map(shuffled, rows))
        tree = shuffled(tree)
    return json.dumps(tree).encode()


def read_marks(text):
    number = r"\[(.*?)\]"
    found = re.findall(rf'site: "?(\w+)"?\s+point: {number}\s+normal: {number}\s+depth_along_normal_mm: (\S+)', text)
    triple = lambda words: tuple(map(float, words.split(",")))
    return [Mark(site, triple(point), triple(normal), float(depth)) for site, point, normal, depth in found]


RINGS = 50  # edges of 5 mm, which the program refines; finer meshes take more time per case
# A phantom's nasal bones may lie deeper than those of people: 8.1 mm are 5.1 standard deviations.
FACE = {"title": "a face", "report": False, "plausibility": {"depth_sds": 7}, "implicit": {"resolution": 60, "target_triangles": 4000}, "seeds": {"level": 1}, "first_fit": [],
        "template": {"type": "formula", "patches_u": 8, "patches_v": 8, "max_level": 2}, "uncertainty": {"sigma": False},
        "fit": {"plan": {"type": "listed", "schedule": [{"level": 0, "fraction": 1}, {"level": 1, "fraction": 1}]}}}
HEADS = 3


class World:
    """The plain inputs and their results, in one folder."""

    def __init__(self, program, configs, folder, seed):
        self.program, self.folder, self.seed = program, folder, seed
        folder.mkdir(exist_ok=True)
        (folder / "face.yaml").write_text(json.dumps({"base": str(configs / "phantom.yaml"), **FACE}))
        draw = self.draw("heads")
        self.known = {}  # notes of the plain inputs
        self.heads = [self.make_head(k, draw.randrange(1, 10**6)) for k in range(HEADS)]
        self.points = [self.make_points(k) for k in range(8)]

    def draw(self, kind):
        return random.Random(f"{self.seed} {kind}")

    def call(self, *words):
        done = subprocess.run([self.program, *map(str, words)], cwd=self.folder, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            raise SystemExit(f"a plain input is not accepted: {words}: {done.returncode}\n{done.stderr}{done.stdout}")
        return done.stdout, frozenset(notes(done.stdout + done.stderr))

    def make_head(self, k, random_seed):
        self.call("depth", "face.yaml", "--set", f"subject={{type: phantom, random_seed: {random_seed}, rings: {RINGS}}}", "--out", f"skull{k}", *QUIET)
        self.call("phantom", "--head", "smooth", "--random-seed", random_seed, "--out", f"head{k}", "--pixel-mm", 5, "--slice-mm", 8)
        marks = read_marks((self.folder / f"head{k}/landmarks.yaml").read_text())
        head = Head(read_ply(self.folder / f"skull{k}/depth.ply"), read_ply(self.folder / f"head{k}/true_skin.ply"), marks)
        folder = self.folder / f"plain{k}"
        folder.mkdir()
        for name, data in head_files(head).items():
            (folder / name).write_bytes(data)
        (self.folder / f"face{k}.ply").write_bytes(ply(read_ply(self.folder / f"skull{k}/tips.ply")))
        (folder / "case.yaml").write_bytes(case_yaml("../face.yaml"))
        (folder / "with_skin.yaml").write_bytes(case_yaml("../face.yaml", skin="skin.ply"))
        self.known["run", k] = self.call("run", f"plain{k}/case.yaml", "--out", f"plain{k}/out", *QUIET)[1]
        self.known["depth", k] = self.call("depth", f"plain{k}/with_skin.yaml", "--out", f"plain{k}/depth", *QUIET)[1]
        return head

    def make_points(self, k):
        points = Points.drawn(self.draw(f"points {k}"))
        (self.folder / f"points{k}.csv").write_bytes(points.csv())
        self.known["fit", k] = self.call("fit", f"points{k}.csv", "--set", "report=false", "--out", f"fit{k}", *QUIET)[1]
        return points


def notes(text):
    """The notes among lines, without their numbers."""
    is_note = lambda line: line.startswith(("note:", "warning:")) or re.search(r"outliers? left out", line)
    return [re.sub(r"[\d.]+(e[-+]?\d+)?", "0", line) for line in text.splitlines() if is_note(line)]


def verdict(case, got, folder):
    """right, noted, unusable or refused; and the fault, if there is one."""
    law = case.law
    if got.code != 0:
        ended = "refused" if got.code == 2 else "unusable"
        return ended, "" if law.is_mistake else f"{ended}, though it is a good input in another form"
    try:
        deviation = law.deviation(folder, got.out)
    except (OSError, ValueError, KeyError, TypeError, struct.error) as error:
        return "right", f"its result cannot be read: {error!r}"
    if deviation <= law.limit:
        return "right", ""
    if set(notes(got.out + got.err)) - law.known_notes:
        return "noted", ""
    return "silent", f"{deviation:.3g} from the right result, {law.limit} are allowed, and no note"


def head_files(head, **more):
    return {"skull.ply": ply(head.skull), "skin.ply": ply(head.skin), "marks.yaml": marks_file(head.marks, **more)}


def case_yaml(base, **subject):
    return json.dumps({"base": base, "subject": {"type": "files", "skull": "skull.ply", "landmarks": "marks.yaml", **subject}}).encode()


def face_distance(plain, back, is_mirrored=False):
    """RMS of the distances of corresponding vertices of two faces, after `back` moved the case's."""
    right = read_ply(plain)

    def measure(folder, _):
        face = read_ply(folder / "out/face.ply")
        if len(face.points) != len(right.points):
            return math.inf
        side = math.isqrt(len(right.points))
        twin = lambda n: n // side * side + side - 1 - n % side if is_mirrored else n
        return rms(math.dist(back(face.points[twin(n)]), right.points[n]) for n in range(0, len(right.points), 7))
    return measure


def same_forms(head, draw):
    """(name, head, options of the subject, options of the landmarks, back, is mirrored): forms of one head."""
    matrix, shift = rotation(any_direction(draw), draw.uniform(1, 25)), [draw.uniform(-300, 300) for _ in range(3)]
    inverse = transposed(matrix)
    unit, factor = draw.choice([("cm", 0.1), ("m", 0.001), ("in", 1 / 25.4)])
    stay = lambda p: p
    skull = lambda mesh: dataclasses.replace(head, skull=mesh)
    copies = draw.choice([2, 3, 4])
    twice = draw.sample(head.skull.triangles, len(head.skull.triangles) // draw.choice([1, 2, 10]))
    return {
        "rotation": lambda: (head.moved(matrix), {}, {}, lambda p: apply(inverse, p), False),
        "translation": lambda: (head.moved(IDENTITY, shift), {}, {}, lambda p: tuple(a - b for a, b in zip(p, shift)), False),
        "mirror image, sides renamed": lambda: (head.mirrored(), {}, {}, lambda p: apply(MIRROR, p), True),
        f"skull in {unit}": lambda: (skull(head.skull.scaled(factor)), {"units": unit}, {}, stay, False),
        f"landmarks in {unit}": lambda: (head, {}, {"units": unit}, stay, False),
        "skull in RAS": lambda: (skull(head.skull.moved(RAS)), {"axes": "RAS"}, {}, stay, False),
        "landmarks in RAS": lambda: (head, {}, {"axes": "RAS"}, stay, False),
        "permuted mesh": lambda: (skull(head.skull.permuted(draw)), {}, {}, stay, False),
        "mesh refined 1 to 4": lambda: (skull(head.skull.refined()), {}, {}, stay, False),
        f"{copies} copies": lambda: (skull(head.skull.parts([head.skull.triangles] * copies)), {}, {}, stay, False),
        f"{len(twice)} triangles twice": lambda: (skull(Mesh(head.skull.points, head.skull.triangles + twice)), {}, {}, stay, False),
        "pieces": lambda: (skull(head.skull.in_pieces(draw)), {}, {}, stay, False),
        "soup": lambda: (skull(head.skull.parts([[t] for t in head.skull.triangles])), {}, {}, stay, False),
        "reordered landmarks and keys": lambda: (head, {}, {"draw": draw}, stay, False),
    }


def face_laws(world):
    draw = world.draw("face")
    while True:
        k = draw.randrange(HEADS)
        forms = same_forms(world.heads[k], draw)
        name = draw.choice(list(forms))
        head, subject, landmarks, back, is_mirrored = forms[name]()
        files = {"skull.ply": ply(head.skull), "marks.yaml": marks_file(head.marks, **landmarks)}
        if draw.random() < 0.2:
            files["skull.obj"], subject = obj(head.skull), {**subject, "skull": "skull.obj"}
            del files["skull.ply"]
        files["case.yaml"] = case_yaml(GOOD + "face.yaml", **subject)
        law = Law(face_distance(world.folder / f"plain{k}/out/face.ply", back, is_mirrored), FACE_LIMIT_MM, world.known["run", k])
        yield Case("face", f"head {k}: {name}", ["run", "case.yaml", "--out", "out", *QUIET], files, names=("",), most_lines=60, law=law)


# ---------------------------------------------------------------------------------------------- distances of two meshes


def rms_printed(right_mm, factor=1.0):
    def measure(_, printed):
        got = json.loads(printed)
        return max(abs(factor * got["rms_mm"] - right_mm[0]), abs(factor * got["symmetric"]["rms_mm"] - right_mm[1]))
    return measure


def distance_laws(world):
    """A skin against a face; each in another form."""
    draw, right = world.draw("distance"), {}
    while True:
        k = draw.randrange(HEADS)
        skin, face = world.heads[k].skin, read_ply(world.folder / f"skull{k}/tips.ply")
        if k not in right:
            printed = json.loads(world.call("evaluate", f"face{k}.ply", f"head{k}/true_skin.ply", *QUIET)[0])
            right[k] = printed["rms_mm"], printed["symmetric"]["rms_mm"]
        matrix, shift = rotation(any_direction(draw), draw.uniform(0, 180)), [draw.uniform(-300, 300) for _ in range(3)]
        forms = {
            "both turned and shifted": lambda: (ply(face.moved(matrix, shift)), ply(skin.moved(matrix, shift))),
            "face permuted": lambda: (ply(face.permuted(draw)), ply(skin)),
            "skin permuted": lambda: (ply(face), ply(skin.permuted(draw))),
            "face refined": lambda: (ply(face.refined()), ply(skin)),
            "face a soup": lambda: (ply(face.parts([[t] for t in face.triangles])), ply(skin)),
            "face in pieces": lambda: (ply(face.in_pieces(draw)), ply(skin)),
            "face in two copies": lambda: (ply(face.parts([face.triangles] * 2)), ply(skin)),
            "both mirrored": lambda: (ply(face.moved(MIRROR).flipped()), ply(skin.moved(MIRROR).flipped())),
            "face with SPACE=RAS": lambda: (ply(face.moved(RAS), comment="SPACE=RAS"), ply(skin)),
            "both with SPACE=RAS": lambda: (ply(face.moved(RAS), comment="SPACE=RAS"), ply(skin.moved(RAS), comment="SPACE=RAS")),
            "skin with SPACE=RAS, face with SPACE=LPS": lambda: (ply(face, comment="SPACE=LPS"), ply(skin.moved(RAS), comment="SPACE=RAS")),
        }
        name = draw.choice(list(forms))
        one, other = forms[name]()
        yield Case("distance", f"head {k}: {name}", ["evaluate", "face.ply", "skin.ply", *QUIET], {"face.ply": one, "skin.ply": other},
                   names=("",), law=Law(rms_printed(right[k]), FACE_LIMIT_MM))


# ---------------------------------------------------------------------------------------------- landmark files


def marks_written(right):
    def measure(folder, _):
        got = {m["site"]: m for m in csv.DictReader(io.StringIO((folder / "out.csv").read_text()))}
        if set(got) != {m.site for m in right}:
            return math.inf
        at = lambda row: tuple(float(row.get(axis + "_mm") or row[axis]) for axis in "xyz")
        return max(math.dist(at(got[m.site]), m.point) for m in right)
    return measure


def marks_csv(marks, separator=",", comma=False, names=("site", "x_mm", "y_mm", "z_mm"), turn=IDENTITY):
    number = lambda v: repr(v).replace(".", ",") if comma else repr(v)
    rows = [[m.site, *map(number, apply(turn, m.point))] for m in marks]
    return "".join(separator.join(row) + "\n" for row in [list(names), *rows]).encode()


def markups_json(marks, turn, system, draw):
    """3D Slicer's list. Some more points that were never placed are no landmarks."""
    points = [{"label": m.site, "position": list(apply(turn, m.point)), "positionStatus": "defined"} for m in marks]
    points += [{"label": "mp", "position": [1.0, 2.0, 3.0], "positionStatus": draw.choice(["undefined", "missing", "preview"])}]
    tree = {"@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",
            "markups": [{"type": "Fiducial", "coordinateSystem": system, "coordinateUnits": "mm", "controlPoints": points},
                        {"type": "Line", "coordinateSystem": system, "coordinateUnits": "mm",
                         "controlPoints": [{"label": f"L-{n}", "position": [n, 0, 0], "positionStatus": "defined"} for n in (1, 2)]}]}
    return json.dumps(tree).encode()


def fcsv(marks, turn, system, draw):
    rows = [(n, *apply(turn, m.point), 0, 0, 0, 1, 1, 1, 0, m.site, "", "", 2, 0) for n, m in enumerate(marks)]
    rows += [(len(rows), 1, 2, 3, 0, 0, 0, 1, 1, 1, 0, "mp", "", "", draw.choice([0, 1, 3]), 0)]
    head = f"# Markups fiducial file version = 5.2\n# CoordinateSystem = {system}\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
    return (head + "".join(",".join(map(str, row)) + "\n" for row in rows)).encode()


def landmark_laws(world):
    draw = world.draw("landmark files")
    while True:
        k = draw.randrange(HEADS)
        marks = draw.sample([m for m in world.heads[k].marks if m.site != "mp"], 20)
        turn, system = draw.choice([(IDENTITY, "LPS"), (RAS, "RAS")])
        unit = draw.choice(["mm", "cm", "m", "in"])
        name, file, data = draw.choice([
            lambda: (f"YAML in {system} and {unit}", "marks.yaml", marks_file(marks, draw, system, unit)),
            lambda: (f"markups in {system} with unplaced points and a line", "marks.mrk.json", markups_json(marks, turn, system, draw)),
            lambda: (f"fiducials in {system} with a status", "marks.fcsv", fcsv(marks, turn, system, draw)),
            lambda: ("a table with decimal commas", "marks.csv", marks_csv(marks, ";", comma=True)),
            lambda: ("a table with tabs", "marks.csv", marks_csv(marks, "\t")),
            lambda: ("a table in capitals", "marks.csv", marks_csv(marks, names=("SITE", "X", "Y", "Z"))),
            lambda: (f"Slicer's table in {system}", "marks.csv", marks_csv(marks, names=("label", *("lps" if system == "LPS" else "ras")), turn=turn)),
            lambda: ("a table with empty rows", "marks.csv", marks_csv(marks).replace(b"\n", b"\n,,,\n")),
        ])()
        yield Case("landmark files", f"head {k}: {name}", ["landmarks", "convert", file, "out.csv"], {file: data}, names=("",),
                   law=Law(marks_written(marks), 1e-6))


# ---------------------------------------------------------------------------------------------- mistakes with heads


def depth_error(plain):
    read = lambda folder: json.loads((folder / "result.json").read_text())["depth_truth"]["along_direction"]["rms_mm"]
    right = read(plain)
    return lambda folder, _: abs(read(folder / "out") - right)


def skin_mistakes(world, k, draw):
    head = world.heads[k]
    other = world.heads[(k + draw.randrange(1, HEADS)) % HEADS]
    direction = any_direction(draw)
    size = draw.uniform(5, 60)
    shift = [size * c / math.hypot(*direction) for c in direction]
    factor = draw.choice([draw.uniform(0.5, 0.93), draw.uniform(1.07, 2)])
    name, skin = draw.choice([
        lambda: (f"skin shifted by {size:.0f} mm", head.skin.moved(IDENTITY, shift)),
        lambda: (f"skin scaled by {factor:.2f}", head.skin.scaled(factor)),
        lambda: ("another person's skin", other.skin),
        lambda: ("skin in RAS", head.skin.moved(RAS)),
        lambda: ("skin mirrored up and down", head.skin.moved([[1, 0, 0], [0, 1, 0], [0, 0, -1]]).flipped()),
        lambda: ("the skull as skin", head.skull),
        lambda: ("skin in cm", head.skin.scaled(0.1)),
        lambda: ("skin y up", head.skin.moved([[1, 0, 0], [0, 0, 1], [0, -1, 0]])),
        lambda: (f"skin turned by {10 + size:.0f} degrees", head.skin.moved(rotation(direction, 10 + size))),
    ])()
    files = {"skull.ply": ply(head.skull), "skin.ply": ply(skin), "marks.yaml": marks_file(head.marks), "case.yaml": case_yaml(GOOD + "face.yaml", skin="skin.ply")}
    law = Law(depth_error(world.folder / f"plain{k}/depth"), DEPTH_LIMIT_MM, world.known["depth", k], is_mistake=True)
    return Case("mistakes: skin", f"head {k}: {name}", ["depth", "case.yaml", "--out", "out", *QUIET], files, names=("",), most_lines=60, law=law)


def skull_mistakes(world, k, draw):
    head = world.heads[k]
    files = {"skull.ply": ply(head.skull), "marks.yaml": marks_file(head.marks)}
    one, two = draw.sample(head.marks, 2)
    direction, size, near = any_direction(draw), draw.uniform(30, 60), draw.choice(head.marks).point
    moved = tuple(a + size * b / math.hypot(*direction) for a, b in zip(one.point, direction))
    exchanged = {one.site: two.point, two.site: one.point}
    turns = draw.choice([[[1, 0, 0], [0, 0, 1], [0, -1, 0]], [[0, 1, 0], [0, 0, 1], [1, 0, 0]], RAS, [[-1, 0, 0], [0, 0, 1], [0, 1, 0]]])
    factor = draw.choice([0.1, 10, 25.4, 1 / 25.4, 1000])
    stray = [tuple(c + draw.choice([500, -900, 3000]) for c in p) for p in [(0, 0, 0), (1, 0, 0), (0, 1, 0)]]
    count = len(head.skull.points)
    marks = lambda change: {"marks.yaml": marks_file(head.with_marks(change).marks)}
    nan = list(head.skull.points)
    nan[draw.randrange(count)] = (math.nan, 0.0, 0.0)
    name, changed = draw.choice([
        lambda: ("all files turned by axes", {"skull.ply": ply(head.skull.moved(turns)), "marks.yaml": marks_file(head.moved(turns).marks)}),
        lambda: ("skull turned by axes", {"skull.ply": ply(head.skull.moved(turns))}),
        lambda: (f"skull times {factor:.4g}", {"skull.ply": ply(head.skull.scaled(factor))}),
        lambda: (f"landmarks times {factor:.4g}", marks(lambda m: dataclasses.replace(m, point=tuple(factor * c for c in m.point)))),
        lambda: ("sides exchanged", marks(lambda m: dataclasses.replace(m, site=other_side(m.site)))),
        lambda: (f"{one.site} and {two.site} exchanged", marks(lambda m: dataclasses.replace(m, point=exchanged.get(m.site, m.point)))),
        lambda: (f"{one.site} moved by {size:.0f} mm", marks(lambda m: dataclasses.replace(m, point=moved if m == one else m.point))),
        lambda: (f"depths times {factor:.4g}", {"marks.yaml": marks_file(head.marks, depth_factor=factor)}),
        lambda: (f"depth of {one.site} times {factor:.4g}", marks(lambda m: dataclasses.replace(m, depth_mm=factor * m.depth_mm) if m == one else m)),
        lambda: ("normals inwards", marks(lambda m: dataclasses.replace(m, normal=tuple(-c for c in m.normal)))),
        lambda: ("inside out", {"skull.ply": ply(head.skull.flipped())}),
        lambda: ("cut", {"skull.ply": files["skull.ply"][:draw.randrange(len(files["skull.ply"]))]}),
        lambda: ("a stray triangle", {"skull.ply": ply(Mesh(head.skull.points + stray, head.skull.triangles + [(count, count + 1, count + 2)]))}),
        lambda: ("a hole", {"skull.ply": ply(head.skull.without_ball(near, draw.uniform(8, 40)))}),
        lambda: ("NaN", {"skull.ply": ply(Mesh(nan, head.skull.triangles))}),
        lambda: ("another person's landmarks", {"marks.yaml": marks_file(world.heads[(k + 1) % HEADS].marks)}),
    ])()
    law = Law(face_distance(world.folder / f"plain{k}/out/face.ply", lambda p: p), FACE_LIMIT_MM, world.known["run", k], is_mistake=True)
    return Case("mistakes: skull", f"head {k}: {name}", ["run", "case.yaml", "--out", "out", *QUIET],
                {**files, **changed, "case.yaml": case_yaml(GOOD + "face.yaml")}, names=("",), most_lines=60, law=law)


def head_mistakes(world):
    draw = world.draw("mistakes with heads")
    while True:
        yield draw.choice([skin_mistakes, skull_mistakes])(world, draw.randrange(HEADS), draw)


# ---------------------------------------------------------------------------------------------- points


@dataclasses.dataclass(frozen=True)
class Points:
    """A height field z = a sin(x / p) cos(y / q) with noise; rows are (x, y, z, u, v) or (x, y, z)."""
    a: float
    p: float
    q: float
    noise: float
    rows: list
    has_uv: bool

    @staticmethod
    def drawn(draw):
        a, p, q, noise = draw.uniform(2, 5), draw.uniform(9, 15), draw.uniform(9, 15), draw.choice([0.01, 0.05, 0.2])
        uv = [(draw.random(), draw.random()) for _ in range(draw.choice([400, 800, 1500]))]
        rows = [(60 * u, 60 * v, a * math.sin(60 * u / p) * math.cos(60 * v / q) + draw.gauss(0, noise), u, v) for u, v in uv]
        return Points(a, p, q, noise, rows, draw.random() < 0.5)

    def csv(self, rows=None):
        columns = 5 if self.has_uv else 3
        rows = self.rows if rows is None else rows
        return (",".join("xyzuv"[:columns]) + "\n" + "".join(",".join(map(repr, r[:columns])) + "\n" for r in rows)).encode()

    def error_of(self, path, back):
        """RMS distance along z of a surface's vertices from the field without noise, away from the border."""
        at = map(back, read_ply(path).points)
        return rms(z - self.a * math.sin(x / self.p) * math.cos(y / self.q) for x, y, z in at if 3 < x < 57 and 3 < y < 57)


def fit_error(world, k, back):
    points = world.points[k]
    right = points.error_of(world.folder / f"fit{k}/surface.ply", lambda p: p)
    return lambda folder, _: max(0.0, points.error_of(folder / "out/surface.ply", back) - right) / points.noise


def fit_case(world, k, kind, what, data, back=lambda p: p, more=(), is_mistake=False):
    law = Law(fit_error(world, k, back), NOISE_LIMIT, world.known["fit", k], is_mistake=is_mistake)
    return Case(kind, f"points {k}: {what}", ["fit", "points.csv", "--set", "report=false", *more, "--out", "out", *QUIET], {"points.csv": data},
                names=("",), law=law)


def with_place(row, place):
    return (*place, *row[3:])


def fit_form(points, draw):
    """One form of the same points: its name, its rows, and the way back to the plain points."""
    rows, count = points.rows, len(points.rows)
    factor, matrix = 10 ** draw.uniform(-2, 2), rotation(any_direction(draw), draw.uniform(0, 180))
    shift = [draw.choice([10, 1e3, 1e5]) * draw.uniform(-1, 1) for _ in range(3)]
    near, far = 10 ** draw.uniform(-9, -1), draw.choice([3, 10, 100])
    twin = lambda r: with_place(r, [c + near * draw.uniform(-1, 1) for c in r[:3]])
    single = lambda r: with_place(r, [struct.unpack("f", struct.pack("f", c))[0] for c in r[:3]])
    stray = lambda: with_place(rows[0], [30 + 60 * far * draw.choice([-1, 1]), 30 + 60 * far * draw.uniform(-1, 1), 60 * far * draw.uniform(-1, 1)])
    stay, mirror = lambda p: p, lambda p: (60 - p[0], p[1], p[2])
    heights = [] if points.has_uv else [  # the unit of z has no effect on heights over x and y
        lambda: (f"z times {factor:.3g}", [with_place(r, (r[0], r[1], factor * r[2])) for r in rows], lambda p: (p[0], p[1], p[2] / factor))]
    return draw.choice([
        *heights,
        lambda: ("permuted", draw.sample(rows, count), stay),
        lambda: ("mirrored", [with_place(r, mirror(r)) for r in rows], mirror),
        lambda: ("u and v exchanged", [(*r[:3], r[4], r[3]) for r in rows], stay),
        lambda: (f"times {factor:.3g}", [with_place(r, [factor * c for c in r[:3]]) for r in rows], lambda p: tuple(c / factor for c in p)),
        lambda: (f"shifted by {math.hypot(*shift):.3g}", [with_place(r, [a + b for a, b in zip(r, shift)]) for r in rows],
                 lambda p: tuple(a - b for a, b in zip(p, shift))),
        lambda: ("rotated", [with_place(r, apply(matrix, r[:3])) for r in rows], lambda p: apply(transposed(matrix), p)),
        lambda: (f"twins within {near:.1g}", rows + [twin(r) for r in draw.sample(rows, count // draw.choice([1, 2, 5]))], stay),
        lambda: ("twins in single precision", rows + list(map(single, rows)), stay),
        lambda: ("copies", rows + draw.sample(rows, count // 2), stay),
        lambda: (f"a stray point {far} extents away", rows + [stray()], stay),
    ])()


def fit_laws(world):
    draw = world.draw("fit")
    while True:
        k = draw.randrange(len(world.points))
        what, rows, back = fit_form(world.points[k], draw)
        yield fit_case(world, k, "fit", what, world.points[k].csv(rows), back)


def fit_mistakes(world):
    draw = world.draw("mistakes with points")
    while True:
        k = draw.randrange(len(world.points))
        points = dataclasses.replace(world.points[k], has_uv=True)
        rows, count = points.rows, len(points.rows)
        uv = [r[3:] for r in draw.sample(rows, count)]
        share = draw.uniform(0.02, 0.25)
        lost = set(draw.sample(range(count), max(1, int(share * count))))
        anywhere = lambda: [draw.uniform(0, 60), draw.uniform(0, 60), draw.uniform(-60, 60)]
        plain = dataclasses.replace(points, has_uv=world.points[k].has_uv)
        data = plain.csv()
        what, text = draw.choice([
            lambda: ("(u,v) in another order", points.csv([(*r[:3], *other) for r, other in zip(rows, uv)])),
            lambda: ("(u,v) all the same", points.csv([(*r[:3], 0.5, 0.5) for r in rows])),
            lambda: ("two sheets over the same (u,v)", points.csv(rows + [with_place(r, (r[0], r[1], r[2] + 50)) for r in rows])),
            lambda: (f"{share:.0%} of the points anywhere", plain.csv([with_place(r, anywhere()) if n in lost else r for n, r in enumerate(rows)])),
            lambda: ("some NaN", plain.csv([with_place(r, (math.nan, r[1], r[2])) if n in lost else r for n, r in enumerate(rows)])),
            lambda: ("rows of zeros", plain.csv([with_place(r, (0.0, 0.0, 0.0)) if n in lost else r for n, r in enumerate(rows)])),
            lambda: ("decimal commas", data.replace(b",", b";").replace(b".", b",")),
            lambda: ("cut", data[:draw.randrange(len(data))]),
        ])()
        yield fit_case(world, k, "mistakes: points", what, text, is_mistake=True)


# ---------------------------------------------------------------------------------------------- all


SHARES = {face_laws: 170, distance_laws: 170, landmark_laws: 150, fit_laws: 250, head_mistakes: 170, fit_mistakes: 90}


def cases(world, count):
    """About `count` cases, by kinds in turn."""
    total = sum(SHARES.values())
    for kind, share in SHARES.items():
        row = kind(world)
        for _ in range(max(1, round(share * count / total))):
            yield next(row)
