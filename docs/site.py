#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes static pages of the documents: site.py OUT. README.md becomes index.html, docs/FOLDER/NAME.md FOLDER-NAME.html, docs/NAME.md
docs-NAME.html, and docs/FOLDER/README.md FOLDER.html. Pictures and other files of the project that the documents link to are copied to files/. The pages load nothing from a network. Needs
Debian's python3-markdown-it, which `make site` installs."""
import html
import os
import re
import shutil
import sys
from pathlib import Path

try:
    from markdown_it import MarkdownIt
except ImportError:
    sys.exit("site.py: this Python has no markdown_it; install python3-markdown-it, or run `make site`, which installs it")

PARSER = MarkdownIt("commonmark").enable("table")
ROOT = Path(__file__).resolve().parent.parent
# The folders of docs/ in the order of the contents, with their headings. Within a folder the pages of ORDER come first, then the others by title.
PARTS = [("Start", ""), ("Tutorials", "tutorial"), ("How to", "how-to"), ("Reference", "reference"), ("Explanation", "explanation"),
         ("Experiments", "experiments"), ("The thesis", "docs")]
ORDER = ["README.md", "first-face.md", "first-study.md", "workbench.md", "gallery.md", "install.md", "architecture.md", "commands.md", "options.md"]
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
/* A shadow at the side where a wide table continues. */
.wide { background: linear-gradient(to right, var(--paper) 50%, transparent) left / 40px 100% local no-repeat,
  linear-gradient(to left, var(--paper) 50%, transparent) right / 40px 100% local no-repeat,
  linear-gradient(to right, var(--line), transparent) left / 14px 100% scroll no-repeat,
  linear-gradient(to left, var(--line), transparent) right / 14px 100% scroll no-repeat }
@media (max-width: 800px) { .wide table:has(th:nth-child(4)) { width: max-content } th, td { max-width: 15em } td code { overflow-wrap: anywhere }
  .page { display: block; padding: 12px 16px 40px } nav > div { display: none } nav details { display: block } }
"""


def documents():
    """The documents, README.md first."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def folder_of(path):
    """The folder below docs/ that holds a document; empty for the README.md of the project."""
    return "" if path.parent == ROOT else path.parent.name


def page_of(path):
    """The name of a document's page. All pages lie in one folder, so that their links to each other and to files/ are short."""
    if path.parent == ROOT:
        return "index.html"
    return path.parent.name + (".html" if path.name == "README.md" else f"-{path.stem}.html")


def plain(tokens):
    return "".join(token.content for token in tokens if token.type in ("text", "code_inline"))


def anchor(title, used):
    """The anchor of a heading, as GitHub makes it."""
    slug = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
    used[slug] = used.get(slug, -1) + 1
    return slug if used[slug] == 0 else f"{slug}-{used[slug]}"


class Site:
    def __init__(self, out):
        self.out = out
        self.documents = documents()
        self.titles = {}

    def link(self, target, source):
        """The target on the site of a link in the document `source`."""
        path, _, fragment = target.partition("#")
        if "://" in target or target.startswith("mailto:") or not path:
            return target
        file = (source.parent / path).resolve()
        if not file.is_file():
            sys.exit(f"site.py: {source.relative_to(ROOT)}: links to {target}, which is not a file of the project")
        if file in self.documents:
            return page_of(file) + (f"#{fragment}" if fragment else "")
        return self.copied(file)

    def copied(self, file):
        """Copies a file of the project beside the pages and returns its link."""
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

    def title(self, path, tokens):
        for token, inline in zip(tokens, tokens[1:]):
            if token.type == "heading_open":
                return plain(inline.children)
        return path.stem

    def contents(self, current):
        text = ""
        for part, folder in PARTS:
            paths = [path for path in self.documents if folder_of(path) == folder]
            paths.sort(key=lambda path: (ORDER.index(path.name) if path.name in ORDER else len(ORDER), self.titles[path]))
            rows = "".join(
                f'<li><a href="{page_of(path)}"{" aria-current=page" if path == current else ""}>'
                f"{html.escape(self.titles[path])}</a></li>" for path in paths)
            text += f"<p>{part}</p><ul>{rows}</ul>" if rows else ""
        return text

    def write(self):
        self.out.mkdir(parents=True, exist_ok=True)
        (self.out / "site.css").write_text(CSS.lstrip())
        parsed = {path: self.parse(path) for path in self.documents}
        self.titles = {path: self.title(path, tokens) for path, tokens in parsed.items()}
        for path, tokens in parsed.items():
            body = PARSER.renderer.render(tokens, PARSER.options, {})
            body = body.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
            contents = self.contents(path)
            (self.out / page_of(path)).write_text(
                f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
                f'<title>{html.escape(self.titles[path])}</title><link rel="icon" href="data:,"><link rel="stylesheet" href="site.css"></head>\n'
                f'<body><div class="page"><nav aria-label="Documents"><details><summary>Documents</summary>{contents}</details><div>{contents}</div></nav>\n'
                f"<main>\n{body}</main></div></body></html>\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: site.py OUT")
    folder = Path(os.path.abspath(sys.argv[1]))
    Site(folder).write()
    print(folder / "index.html")
