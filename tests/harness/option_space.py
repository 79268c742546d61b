# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be chosen in a configuration, out of the JSON Schema of its options, and a covering array over it.

A factor is one choice: a word of an enum, a variant's type, a boolean, auto or a number, null or a value, a term added to
a list. Factors within a variant's type exist only where that type is chosen. Numbers at the ends of their range are
`ends`: they go one at a time into the cases, on top of the choices.
"""
import dataclasses
import itertools
import json
import random


@dataclasses.dataclass
class Factor:
    name: str  # fit.plan[adaptive].margin
    path: tuple  # ("fit", "plan", "margin"); a number is a slot of a list
    values: list
    needs: tuple = ()  # ((name of a factor, its value), ...): there only where these are chosen
    is_end: bool = False
    is_variant: bool = False
    is_json: bool = False  # the values are texts of JSON, so that they can be keys
    default: object = None


def is_variant(schema):
    options = schema.get("anyOf", [])
    return bool(options) and "enum" in options[0] and all("properties" in o for o in options[1:])


def number(value, schema):
    return int(value) if schema.get("type") == "integer" else value


class OptionSpace:
    """lists: by a factor's name, the values that a list may take. work: by the end of a factor's name, what stands for ends
    that only ask for more work. beside: by (name, value), the choices without which it means nothing. files: by (name,
    value), the entries that name its files or keep its work small. defaults: by name, what the configuration below the cases chooses."""

    def __init__(self, schema, lists, work, beside, files, defaults):
        self.lists, self.work, self.beside, self.files = lists, work, beside, files
        self.factors = []
        for key, value in schema["properties"].items():
            self._walk(key, (key,), value, ())
        for factor in self.factors:
            factor.default = defaults.get(factor.name, factor.default)
        self.by_name = {f.name: f for f in self.factors}
        self.choices = [f for f in self.factors if not f.is_end]
        self.ends = [(f, v) for f in self.factors if f.is_end for v in f.values]

    def _add(self, name, path, values, needs, **more):
        self.factors.append(Factor(name, path, values, needs, **more))

    def _walk(self, name, path, schema, needs):
        default = schema.get("default")
        if name in self.lists:
            self._add(name, path, [json.dumps(v) for v in self.lists[name]], needs, is_json=True)
        elif is_variant(schema):
            types = [o["properties"]["type"]["const"] for o in schema["anyOf"][1:]]
            self._add(name, path, types, needs, is_variant=True, default=default and default["type"])
            self._alternatives(name, path, schema, needs)
        elif "anyOf" in schema:
            self._either(name, path, schema["anyOf"], needs)
        elif "properties" in schema:
            for key, value in schema["properties"].items():
                self._walk(f"{name}.{key}", path + (key,), value, needs)
        elif schema.get("type") == "array" and is_variant(schema.get("items", {})):
            self._list(name, path, schema["items"], needs)
        elif "enum" in schema or schema.get("type") == "boolean":
            self._add(name, path, schema.get("enum", [False, True]), needs, default=default)
        elif schema.get("type") in ("integer", "number"):
            self._ends(name, path, schema, needs)

    def _alternatives(self, name, path, schema, needs):
        for option in schema["anyOf"][1:]:
            kind = option["properties"]["type"]["const"]
            for key, value in option["properties"].items():
                if key != "type":
                    self._walk(f"{name}[{kind}].{key}", path + (key,), value, needs + ((name, kind),))

    def _either(self, name, path, options, needs):  # a number, or auto, or null
        numbers = next((o for o in options if o.get("type") in ("integer", "number")), None)
        word = next((o["const"] for o in options if "const" in o), None)
        if numbers is not None and word is not None:
            self._add(name, path, [word, numbers.get("minimum", 0) + 1], needs)
        elif numbers is not None:
            self._ends(name, path, numbers, needs)

    def _ends(self, name, path, schema, needs):
        ends = [number(schema[k], schema) for k in ("minimum", "maximum") if k in schema]
        ends = next((v for k, v in self.work.items() if name.endswith(k)), ends)
        if ends:
            self._add(name, path, ends, needs, is_end=True)

    def _list(self, name, path, items, needs):  # two slots, each with any of the types or nothing
        types = [o["properties"]["type"]["const"] for o in items["anyOf"][1:]]
        for slot in (0, 1):
            self._add(f"{name}#{slot}", path + (slot,), [None] + types, needs)
        self._alternatives(f"{name}#0", path + (0,), items, needs)  # the second one's own choices stay at their default

    # ------------------------------------------------------------------ cases

    def closure(self, chosen):
        """`chosen` (names to values) with all that these need; None where that is a contradiction."""
        result, todo = {}, list(chosen.items())
        while todo:
            name, value = todo.pop()
            if name in result:
                if result[name] != value:
                    return None
                continue
            result[name] = value
            todo += self.by_name[name].needs
            todo += self.beside.get((name, value), [])
        return result

    def exists(self, factor, case):
        return all(case.get(name, self.by_name[name].default) == value for name, value in factor.needs)

    def without(self, case, names):
        """The case without these, and without what then means nothing."""
        case = {n: v for n, v in case.items() if n not in names}
        while True:
            left = {n: v for n, v in case.items()
                    if self.exists(self.by_name[n], case)
                    and all(case.get(*b[:1], self.by_name[b[0]].default) == b[1] for b in self.beside.get((n, v), []))}
            if len(left) == len(case):
                return left
            case = left

    def tree(self, case, list_defaults):
        """The case as a configuration. list_defaults: by path, what a list holds that is only added to."""
        root, lists = {}, {}
        for name in sorted(case, key=lambda n: len(self.by_name[n].path)):
            factor, value = self.by_name[name], case[name]
            slot = next((k for k, key in enumerate(factor.path) if isinstance(key, int)), None)
            if slot is not None:
                entry = lists.setdefault(factor.path[:slot], {}).setdefault(factor.path[slot], {})
                if value is not None:
                    place(entry, factor.path[slot + 1:] or ("type",), value)
            elif factor.is_variant:
                place(root, factor.path, {"type": value})
            else:
                place(root, factor.path, json.loads(value) if factor.is_json else value)
            for path, file in self.files.get((name, value), {}).items():
                place(root, path, file)
        for path, slots in lists.items():
            added = [entry for _, entry in sorted(slots.items()) if "type" in entry]
            place(root, path, merged(added, list_defaults.get(".".join(path), [])))
        return root


def place(tree, path, value):
    for key in path[:-1]:
        tree = tree.setdefault(key, {})
    if isinstance(value, dict) and isinstance(tree.get(path[-1]), dict):
        tree[path[-1]].update(value)
    else:
        tree[path[-1]] = value


def merged(entries, defaults):
    """The defaults, with entries of their types in their place and the others behind."""
    result = {entry["type"]: dict(entry) for entry in defaults}
    for entry in entries:
        result.setdefault(entry["type"], {}).update(entry)
    return list(result.values())


class CoveringArray:
    """Cases one after the other, each with as many pairs of choices that were in none before as a greedy search finds."""

    def __init__(self, space, seed):
        self.space = space
        self.random = random.Random(seed)
        self.left = set()
        for a, b in itertools.combinations(space.choices, 2):
            for x, y in itertools.product(a.values, b.values):
                if space.closure({a.name: x, b.name: y}) is not None:
                    self.left.add(((a.name, x), (b.name, y)))
        self.order = {f.name: k for k, f in enumerate(space.choices)}
        self.queue = sorted(self.left, key=repr)
        self.random.shuffle(self.queue)
        self.total = len(self.left)
        self.ends = list(space.ends)
        self.random.shuffle(self.ends)

    def pair(self, a, b):
        return (a, b) if self.order[a[0]] < self.order[b[0]] else (b, a)

    def pairs_of(self, case):
        chosen = [(n, v) for n, v in case.items() if n in self.order]
        return {self.pair(a, b) for a, b in itertools.combinations(chosen, 2)}

    def next_pair(self):
        while self.queue:
            pair = self.queue.pop()
            if pair in self.left:
                return pair
        return None

    def case_for(self, pair):
        case = self.space.closure(dict(pair))
        factors = list(self.space.choices)
        self.random.shuffle(factors)
        factors.sort(key=lambda f: len(f.needs))
        for factor in factors:
            if factor.name in case or not self.space.exists(factor, case):
                continue
            gains = []
            for value in factor.values:
                gain = sum(self.pair((factor.name, value), chosen) in self.left
                           for chosen in case.items() if chosen[0] in self.order)
                gains.append((gain, self.random.random(), value))
            with_value = self.space.closure({**case, factor.name: max(gains, key=lambda g: g[:2])[2]})
            if with_value is not None:
                case = with_value
        return case

    def with_ends(self, case, count):
        """Up to `count` numbers at an end, none of them taken before."""
        taken, case = [], dict(case)
        for factor, value in self.ends:
            if len(taken) < count and factor.name not in case and self.space.exists(factor, case):
                case[factor.name] = value
                taken.append((factor, value))
        for end in taken:
            self.ends.remove(end)
        return case, taken

    def give_back(self, pairs, ends):
        """What a case was to cover and does not."""
        self.left |= pairs
        self.queue = sorted(pairs, key=repr) + self.queue
        self.ends += ends
