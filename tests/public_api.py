#!/usr/bin/env python3
"""Compares the public items of the stable crates with the lists in `tests/public-api`.

A list holds the declaration of each item that `cargo doc --release --no-deps --lib` shows, its methods and its traits.
Usage: python3 tests/public_api.py TARGET [--write], with the target folder of cargo. `--write` writes the lists again.
"""

import difflib
import html
import re
import sys
from pathlib import Path

CRATES = ["asperity", "asperity-contact", "asperity-topography-files"]
LISTS = Path(__file__).parent / "public-api"
CODE = r'<h[34] class="code-header">(.*?)</h[34]>'


def public_items(docs):
    """Returns the public items of a crate from the folder of its documentation."""
    listed = re.findall(r'<li><a href="([^"]+)">([^<]+)</a></li>', (docs / "all.html").read_text(encoding="utf-8"))
    crates = re.findall(r"<code>(pub use .*?)</code>", (docs / "index.html").read_text(encoding="utf-8"))
    items = (described(name, (docs / path).read_text(encoding="utf-8")) for path, name in sorted(listed))
    return "\n".join([*(f"{text(one)}\n" for one in crates), *items])


def described(name, page):
    """Returns the path, the declaration, the methods and the traits of an item."""
    declaration = re.search(r'<pre class="rust item-decl"><code>(.*?)</code></pre>', page, re.S)
    # The implementations after these headings are automatic or hold for any type.
    own = re.split(r'<h2 id="(?:synthetic|blanket)-implementations', page)[0]
    methods = re.findall(r'<section id="[^"]*" class="method">.*?' + CODE, own, re.S)
    implemented = [text(one) for one in re.findall(r'<section id="impl-[^"]*" class="impl">.*?' + CODE, own, re.S)]
    of_item = re.compile(rf"impl(?:<.*?>)? (?!Structural)(.*) for {name.split('::')[-1]}\b")
    traits = sorted(found[1] for found in map(of_item.match, implemented) if found)
    lines = [text(declaration[1]), *map(text, methods), *([f"traits: {', '.join(traits)}"] if traits else [])]
    return f"{name}\n    " + "\n".join(lines).replace("\n", "\n    ") + "\n"


def text(markup):
    """Returns the text of a piece of HTML, whose attributes are blocks."""
    return html.unescape(re.sub(r"<[^>]+>", "", markup.replace("</div>", "\n"))).rstrip()


def main():
    docs, changes = Path(sys.argv[1]) / "doc", []
    for crate in CRATES:
        found, file = public_items(docs / crate.replace("-", "_")), LISTS / f"{crate}.txt"
        if "--write" in sys.argv:
            file.write_text(found, encoding="utf-8")
        lines = [text.splitlines() for text in (file.read_text(encoding="utf-8"), found)]
        changes += difflib.unified_diff(*lines, file.name, "cargo doc", lineterm="", n=5)
    if changes:
        print("\n".join(changes))
        sys.exit("public items have changed: read docs/reference/stability.md, then run this with `--write`")


if __name__ == "__main__":
    main()
