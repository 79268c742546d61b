# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile copies of a file: endless, from a generator of random numbers, each with the name of what was done to it."""
import json
import re
import struct

NUMBERS = [b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e999", b"1e-320", b"0", b"-0", b"-1", b"-3", b"0.5", b"1e15", b"4294967296",
           b"2147483648", b"18446744073709551615", b"-9223372036854775809", b"99999999999999999999", b"0x10", b"1,5", b"1e", b"--1",
           b"", b"abc", b"1.2.3", b"+", b"\xd9\xa3", b"1" * 400]
VALUES = [None, True, -1, 0, 0.5, 7, 1e308, -1e308, 2**31, 2**63, 10**30, "", " ", "x", "nan", "x" * 3000, "\u202e", "a\u0000b", "\x1b[2J", [], {}, [[]],
          [1, 2, 3], [None], {"a": 1}, {"type": "nosuch"}, "/dev/null", "..", "/", "no/such/file", "\U0001f480"]
RAW_VALUES = ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "01", "1.", "'x'", "\"\\ud800\"", "\"\xff\"", "[", "{", "tru", "", "//", "1 2"]
YAML_VALUES = ["", "~", "null", "true", "-1", "0", "0.5", "1e308", "1e999", ".nan", ".inf", "-.inf", "nan", "[]", "{}", "[[]]", "[1, 2, 3]", "{a: 1}",
               "{type: nosuch}", "\"", "'", "[", "{", "*x", "&a", "!!binary AAAA", "|", ">", "\"a\\nb\"", "\"\\x1b[2J\"", "18446744073709551616",
               "0x7fffffffffffffff", "1_000", "1:30", "2001-01-01", "- a", "a: b: c", "@", "%", "`", "\"\\ud800\"", "x" * 3000, "/dev/null", "..", "/",
               "no/such/file", "\U0001f480", "[" * 200, "!<tag:x> y", "? a", "<<: {a: 1}"]


def clip(data, most=200_000):
    return data[:most]


# ---------------------------------------------------------------------------------------------- bytes


def cut(data, draw):
    at = draw.choice([0, 1, 3, draw.randrange(len(data) + 1), draw.randrange(len(data) + 1), max(0, len(data) - 1)])
    return f"cut at {at}", data[:at]


def flip(data, draw, within=None):
    out = bytearray(data)
    for _ in range(draw.choice([1, 1, 2, 8])):
        if out:
            out[draw.randrange(min(len(out), within or len(out)))] ^= 1 << draw.randrange(8)
    return "bits flipped", bytes(out)


def overwrite(data, draw, within=None):
    pieces = [struct.pack("<f", float("nan")), struct.pack("<d", float("inf")), struct.pack("<I", 0xFFFFFFFF), struct.pack("<i", -1),
              struct.pack("<q", 2**62), struct.pack("<d", 1e300), struct.pack("<f", 1e38), b"\0" * 16, b"\xff" * 16, struct.pack(">I", 2**31)]
    piece = draw.choice(pieces)
    at = draw.randrange(max(1, min(len(data), within or len(data)) - len(piece)))
    return f"{len(piece)} bytes of another kind at {at}", data[:at] + piece + data[at + len(piece):]


def insert(data, draw):
    piece = draw.choice([b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"\n\n\n", b"\r", b"\x1a", b"\xc0\x80", b"\xed\xa0\x80", b"A" * 5000, b" " * 5000, b"#", b"\x1b[2J"])
    at = draw.choice([0, len(data), draw.randrange(len(data) + 1)])
    return f"{piece[:4]!r} put in at {at}", data[:at] + piece + data[at:]


def drop(data, draw):
    at = draw.randrange(max(1, len(data)))
    size = draw.choice([1, 2, 4, 100, len(data) // 2])
    return f"{size} bytes left out at {at}", data[:at] + data[at + size:]


def repeat(data, draw):
    at = draw.randrange(max(1, len(data)))
    size = draw.choice([1, 4, 80, 1000])
    return f"{size} bytes twice at {at}", data[:at + size] + data[at:]


def binary(data, draw):
    """A file of bytes: mostly in its head."""
    return draw.choice([cut, flip, lambda d, r: flip(d, r, 400), lambda d, r: flip(d, r, 400), overwrite, lambda d, r: overwrite(d, r, 400),
                        lambda d, r: overwrite(d, r, 400), insert, drop, repeat])(data, draw)


# ---------------------------------------------------------------------------------------------- lines of text


def another_number(data, draw):
    found = list(re.finditer(rb"-?\d+(\.\d*)?([eE][-+]?\d+)?", data[:100_000]))
    if not found:
        return insert(data, draw)
    # Counts stand at the beginning.
    at = draw.choice(found[:8] if draw.random() < 0.5 else found)
    number = draw.choice(NUMBERS)
    return f"{number[:12]!r} for {at.group()[:12]!r} at {at.start()}", data[:at.start()] + number + data[at.end():]


def another_line(data, draw):
    lines = data.split(b"\n")
    at = draw.randrange(len(lines))
    other = lines[draw.randrange(len(lines))]
    kind = draw.choice(["left out", "twice", "another's", "empty", "half", "long", "joined"])
    changed = {"left out": [], "twice": [lines[at]] * 2, "another's": [other], "empty": [b""], "half": [lines[at][:len(lines[at]) // 2]],
               "long": [lines[at] * 300], "joined": [lines[at] + b" " + other]}[kind]
    return f"line {at} {kind}", b"\n".join(lines[:at] + changed + lines[at + 1:])


def line_ends(data, draw):
    end = draw.choice([b"\r", b"\r\n", b"\n\r", b"\0", b" ", b"\n\n", b"\x0b", b";", b"\t\n"])
    return f"lines end with {end!r}", data.replace(b"\n", end)


def separators(data, draw):
    one, other = draw.choice([(b",", b";"), (b",", b" "), (b" ", b"  "), (b",", b",,"), (b" ", b"\t"), (b".", b","), (b"-", b"\xe2\x88\x92"), (b",", b"\",\"")])
    return f"{one!r} for {other!r}", data.replace(one, other)


def letters(data, draw):
    return draw.choice([("upper case", data.upper()), ("lower case", data.lower()), ("UTF-16", data.decode("latin1").encode("utf-16")),
                        ("blanks alone", b" \n\t\n" * 20), ("empty", b""), ("NULs", b"\0" * 100), ("backwards", data[::-1])])


def text(data, draw):
    return draw.choice([another_number] * 5 + [another_line] * 3 + [line_ends, separators, letters, cut, flip, insert, drop])(data, draw)


# ---------------------------------------------------------------------------------------------- JSON


def places(value, path=()):
    yield path
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from places(entry, path + (key,))
    elif isinstance(value, list):
        for n, entry in list(enumerate(value))[:3]:
            yield from places(entry, path + (n,))


MARK = "@here@"


def with_value(tree, path, value):
    if not path:
        return value
    copy = dict(tree) if isinstance(tree, dict) else list(tree)
    copy[path[0]] = with_value(copy[path[0]], path[1:], value)
    return copy


def without(tree, path):
    copy = dict(tree) if isinstance(tree, dict) else list(tree)
    if len(path) == 1:
        del copy[path[0]]
    else:
        copy[path[0]] = without(copy[path[0]], path[1:])
    return copy


def json_tree(data, draw):
    tree = json.loads(data)
    path = draw.choice([p for p in places(tree)])
    name = ".".join(map(str, path)) or "all"
    kind = draw.choice(["value"] * 4 + ["raw"] * 2 + ["left out", "twice", "more", "deep"])
    if kind == "value":
        value = draw.choice(VALUES)
        return f"{json.dumps(value)[:20]} at {name}", json.dumps(with_value(tree, path, value)).encode()
    if kind == "left out" and path:
        return f"without {name}", json.dumps(without(tree, path)).encode()
    if kind == "more":
        entry = draw.choice([("extra", 1), ("version", 99), ("__proto__", {}), ("", 0)])
        return f"with {entry[0]!r}", json.dumps({**tree, entry[0]: entry[1]} if isinstance(tree, dict) else [tree, entry]).encode()
    marked = json.dumps(with_value(tree, path, MARK))
    if kind == "deep":
        depth = draw.choice([60, 70, 100_000])
        return f"{depth} levels at {name}", marked.replace(f'"{MARK}"', "[" * depth + "]" * depth).encode()
    if kind == "twice" and path and isinstance(path[-1], str):
        return f"{name} twice", marked.replace(f'"{MARK}"', f"1, {json.dumps(path[-1])}: 2").encode()
    raw = draw.choice(RAW_VALUES)
    return f"{raw[:12]!r} at {name}", marked.replace(f'"{MARK}"', raw).encode("latin1", "replace")


def json_text(data, draw):
    return json_tree(data, draw) if draw.random() < 0.75 else text(data, draw)


# ---------------------------------------------------------------------------------------------- YAML


def yaml_value(data, draw):
    found = list(re.finditer(rb"(?<=[\w\"]: )[^\n,{}\[\]]+|(?<=- )[^\n]+", data))
    if not found:
        return text(data, draw)
    at = draw.choice(found)
    value = draw.choice(YAML_VALUES)
    return f"{value[:20]!r} for {at.group()[:20]!r}", data[:at.start()] + value.encode() + data[at.end():]


def yaml_key(data, draw):
    found = list(re.finditer(rb"(?m)[\w.]+(?=:)", data))
    if not found:
        return text(data, draw)
    at = draw.choice(found)
    key = draw.choice([b"", b"x", at.group() + b"s", at.group().upper(), b"\"a b\"", b"? ", b"<<", b"1", b"~", b"[a]", b"{a: b}", b"\xf0\x9f\x92\x80", b"k" * 2000])
    return f"key {key[:12]!r} for {at.group()!r}", data[:at.start()] + key + data[at.end():]


def yaml_shape(data, draw):
    lines = data.split(b"\n")
    at = draw.randrange(len(lines))
    kind = draw.choice(["indented", "a tab", "a document", "an anchor", "a quote", "merged", "deep"])
    changed = {"indented": b"   " + lines[at], "a tab": b"\t" + lines[at], "a document": b"---\n" + lines[at] + b"\n...\n", "an anchor": b"a: &a [*a]\n" + lines[at],
               "a quote": lines[at] + b"\nq: \"never closed", "merged": b"<<: *nosuch\n" + lines[at],
               "deep": b"q: " + b"[" * 300 + b"]" * 300 + b"\n" + lines[at]}[kind]
    return f"line {at}: {kind}", b"\n".join(lines[:at] + [changed] + lines[at + 1:])


def yaml(data, draw):
    return draw.choice([yaml_value] * 5 + [yaml_key] * 2 + [yaml_shape, another_line, text])(data, draw)
