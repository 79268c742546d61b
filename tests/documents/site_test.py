#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The documents' pages: every link leads to a file and a heading that are there, and nothing is asked of a network.

usage: site_test.py SOURCE
"""
import importlib.util
import pathlib
import subprocess
import sys
import tempfile
from html.parser import HTMLParser
from urllib.parse import unquote

ASKED = {("link", "href"), ("script", "src"), ("img", "src"), ("iframe", "src"), ("source", "src")}


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.asked = set(), [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id":
                self.ids.add(value)
            elif name in ("href", "src"):
                self.links.append(value)
                if (tag, name) in ASKED:
                    self.asked.append(value)


def faults_of(folder):
    pages = {path: Page(path.read_text()) for path in sorted(folder.rglob("*.html"))}
    for path, page in pages.items():
        name = path.relative_to(folder)
        for link in page.asked:
            if "://" in link or link.startswith("//"):
                yield f"{name}: asks the network for {link}"
        for link in page.links:
            if "://" in link or link.startswith(("data:", "mailto:")):
                continue
            file, _, heading = link.partition("#")
            target = (path.parent / unquote(file)).resolve() if file else path
            if not target.is_file():
                yield f"{name}: leads to {link}, which is not there"
            elif heading and unquote(heading) not in pages[target].ids:
                yield f"{name}: leads to {link}, and there is no such heading"


def main():
    source = pathlib.Path(sys.argv[1]).resolve()
    if importlib.util.find_spec("markdown_it") is None:
        print("skipped: python3-markdown-it is not installed")
        return 77
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary).resolve() / "site"
        subprocess.run([sys.executable, source / "docs" / "site.py", folder], check=True, stdout=subprocess.DEVNULL)
        faults = list(faults_of(folder))
        documents = [*(source / "docs").rglob("*.md"), source / "README.md"]
        if len(list(folder.glob("*.html"))) != len(documents):
            faults.append(f"{len(documents)} documents, but another number of pages")
        # A planted fault is found.
        (folder / "planted.html").write_text('<a href="index.html#nowhere">a</a><img src="https://example.org/a.png" alt="a">')
        planted = len(list(faults_of(folder))) - len([f for f in faults if "documents" not in f])
        if planted != 2:
            faults.append(f"of 2 planted faults {planted} were found")
    print("\n".join(faults) or f"{len(documents)} pages, every link leads somewhere")
    return 1 if faults else 0


sys.exit(main())
