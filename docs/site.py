#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The documents as static pages: site.py OUT. README.md becomes index.html, docs/NAME.md NAME.html; pictures and other files of the
project that they name lie in files/. The pages ask no network for anything. Needs Debian's python3-markdown-it; `make site` installs it."""
import html
import os
import re
import shutil
import sys
from pathlib import Path

try:
    from markdown_it import MarkdownIt
except ImportError:
    sys.exit("site.py: there is no markdown_it for this Python; install python3-markdown-it, or run `make site`, which does")

PARSER = MarkdownIt("commonmark").enable("table")
ROOT = Path(__file__).resolve().parent.parent
# Headings of the contents, and the documents below each. Those that are in none stand under the last one.
# The folders of docs/ in the order of the contents. Pages of a folder are listed in the order of ORDER, the others after them by name.
PARTS = [("Start", ""), ("Tutorials", "tutorial"), ("How to", "how-to"), ("Reference", "reference"), ("Explanation", "explanation"),
         ("Experiments", "experiments")]
ORDER = ["README", "first-face", "workbench", "gallery", "architecture"]
CSS = """
:root { color-scheme: light dark; --ink: #1d2126; --paper: #fff; --line: #dfe3e8; --link: #0b5a8f; --code: #f4f6f8 }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ec; --paper: #14171a; --line: #31363c; --link: #86c5f4; --code: #1d2126 } }
* { box-sizing: border-box }
body { margin: 0; font: 16px/1.6 "DejaVu Sans", system-ui, sans-serif; color: var(--ink); background: var(--paper) }
.page { display: flex; gap: 40px; max-width: 1320px; margin: 0 auto; padding: 16px 24px 60px }
nav { flex: 0 0 210px; font-size: 14px } nav > div { position: sticky; top: 16px }
nav p { margin: 18px 0 4px; font-weight: bold } nav ul { list-style: none; margin: 0; padding: 0 } nav li { margin: 3px 0 }
nav [aria-current] { font-weight: bold; color: var(--ink); text-decoration: none }
main { flex: 1; min-width: 0; overflow-wrap: break-word } a { color: var(--link) }
h1 { line-height: 1.2; margin-top: 8px } h2 { border-top: 1px solid var(--line); padding-top: 18px; margin-top: 34px }
img { max-width: 100%; height: auto; border-radius: 6px } pre { overflow-x: auto; background: var(--code); padding: 12px; border-radius: 6px; line-height: 1.4 }
code { background: var(--code); border-radius: 4px; padding: 1px 3px; font: 0.88em "DejaVu Sans Mono", monospace } pre code { padding: 0 }
.wide { overflow-x: auto } table { border-collapse: collapse; font-size: 14px }
th, td { text-align: left; vertical-align: top; border-bottom: 1px solid var(--line); padding: 6px 12px 6px 0; min-width: 5em }
summary { cursor: pointer; color: var(--link) } nav details { display: none }
/* A shadow at the side to which a table goes on. */
.wide { background: linear-gradient(to right, var(--paper) 50%, transparent) left / 40px 100% local no-repeat,
  linear-gradient(to left, var(--paper) 50%, transparent) right / 40px 100% local no-repeat,
  linear-gradient(to right, var(--line), transparent) left / 14px 100% scroll no-repeat,
  linear-gradient(to left, var(--line), transparent) right / 14px 100% scroll no-repeat }
@media (max-width: 800px) { .wide table:has(th:nth-child(4)) { width: max-content } th, td { max-width: 15em } td code { overflow-wrap: anywhere }
  .page { display: block; padding: 12px 16px 40px } nav > div { display: none } nav details { display: block } }
"""


def documents():
    """The documents by name, README first."""
    found = {"README": ROOT / "README.md"}
    found.update({path.stem: path for path in sorted((ROOT / "docs").rglob("*.md"))})
    return found


def folder_of(path):
    """The folder below docs/ that holds a document; empty for README.md."""
    return path.parent.name if path.parent.parent.name == "docs" else ""


def page_of(name):
    return "index.html" if name == "README" else name + ".html"


def plain(tokens):
    return "".join(token.content for token in tokens if token.type in ("text", "code_inline"))


def anchor(title, used):
    """What a heading is called by those that link to it, as on GitHub."""
    slug = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
    used[slug] = used.get(slug, -1) + 1
    return slug if used[slug] == 0 else f"{slug}-{used[slug]}"


class Site:
    def __init__(self, out):
        self.out = out
        self.documents = documents()
        self.names = {path.resolve(): name for name, path in self.documents.items()}
        self.titles = {}

    def link(self, target, source):
        """Where a link of the document `source` leads on the site."""
        path, _, fragment = target.partition("#")
        if "://" in target or target.startswith("mailto:") or not path:
            return target
        file = (source.parent / path).resolve()
        if not file.is_file():
            sys.exit(f"site.py: {source.relative_to(ROOT)}: links to {target}, which is no file of the project")
        if file in self.names:
            return page_of(self.names[file]) + (f"#{fragment}" if fragment else "")
        return self.copied(file)

    def copied(self, file):
        """A file of the project beside the pages."""
        name = f"files/{file.relative_to(ROOT)}"
        (self.out / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, self.out / name)
        return name

    def parse(self, source):
        tokens = PARSER.parse(source.read_text())
        used = {}
        for token, inline in zip(tokens, tokens[1:] + tokens[-1:]):
            if token.type == "heading_open":
                token.attrSet("id", anchor(plain(inline.children), used))
        for token in tokens:
            for child in token.children or []:
                for attribute in ("href", "src"):
                    if child.attrGet(attribute):
                        child.attrSet(attribute, self.link(child.attrGet(attribute), source))
        return tokens

    def title(self, name, tokens):
        for token, inline in zip(tokens, tokens[1:]):
            if token.type == "heading_open":
                return plain(inline.children)
        return name

    def name_links(self, tokens):
        """A link that is called by a document's file is called by its title."""
        for token in tokens:
            for first, second in zip(token.children or [], (token.children or [])[1:]):
                name = Path(second.content).stem
                if first.type == "link_open" and second.content.endswith(".md") and name in self.titles:
                    second.content = self.titles[name]

    def contents(self, current):
        text = ""
        for part, folder in PARTS:
            names = [name for name, path in self.documents.items() if folder_of(path) == folder]
            names.sort(key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), self.titles[name]))
            rows = "".join(
                f'<li><a href="{page_of(name)}"{" aria-current=page" if name == current else ""}>'
                f"{html.escape(self.titles[name])}</a></li>" for name in names)
            text += f"<p>{part}</p><ul>{rows}</ul>" if rows else ""
        return text

    def write(self):
        self.out.mkdir(parents=True, exist_ok=True)
        (self.out / "site.css").write_text(CSS.lstrip())
        parsed = {name: self.parse(path) for name, path in self.documents.items()}
        self.titles = {name: self.title(name, tokens) for name, tokens in parsed.items()}
        for name, tokens in parsed.items():
            self.name_links(tokens)
            body = PARSER.renderer.render(tokens, PARSER.options, {})
            body = body.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
            contents = self.contents(name)
            (self.out / page_of(name)).write_text(
                f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
                f'<title>{html.escape(self.titles[name])}</title><link rel="icon" href="data:,"><link rel="stylesheet" href="site.css"></head>\n'
                f'<body><div class="page"><nav aria-label="Documents"><details><summary>Documents</summary>{contents}</details><div>{contents}</div></nav>\n'
                f"<main>\n{body}</main></div></body></html>\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: site.py OUT")
    folder = Path(os.path.abspath(sys.argv[1]))
    Site(folder).write()
    print(folder / "index.html")
