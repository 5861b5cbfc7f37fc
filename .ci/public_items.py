#!/usr/bin/env python3
"""Public items that nobody names: no other package, no test or example beside the library, no page, no public signature of their own package.

Such an item is `pub(crate)`, or nothing. Fails where there are more than a few; `-v` lists them.
"""

import collections
import pathlib
import re
import sys

MOST = 30
ROOT = pathlib.Path(__file__).resolve().parent.parent
KINDS = "fn|struct|enum|trait|const|static|type|union"
ITEM = re.compile(rf"^[ \t]*pub (?:const |unsafe |async |extern \"C\" )*(?P<kind>{KINDS}) (?P<name>\w+)", re.M)
WORD = re.compile(r"[A-Za-z_]\w*")
# What of a library its users see: signatures and fields, variants, methods of traits, what is implemented for what.
EXAMPLE = re.compile(r"^[ \t]*//[/!] ```\n.*?^[ \t]*//[/!] ```", re.M | re.S)
SEEN = [
    re.compile(r"^[ \t]*pub [^{};]*[{;]", re.M),
    re.compile(r"^[ \t]*pub \w+: [^\n]*", re.M),
    re.compile(r"^[ \t]*pub (?:enum|trait)\b.*?^\}", re.M | re.S),
    re.compile(r"^[ \t]*impl\b[^{]*\{", re.M),
    re.compile(r"^    type \w+ = [^\n]*", re.M),
]


def package(path):
    """The folder of the nearest manifest."""
    return next(folder for folder in path.parents if (folder / "Cargo.toml").exists())


def in_library(path):
    return "src" in path.parts and not re.search(r"/tests?(/|\.rs)", path.as_posix())


def main():
    sources = [path for folder in ("crates", "lab", "examples", "fuzz") for path in (ROOT / folder).rglob("*.rs")]
    texts = {path: path.read_text() for path in sources if "target" not in path.parts}
    # Words by who writes them: a library, the tests and examples beside it, pages and other languages.
    words = collections.defaultdict(set)
    signatures = collections.defaultdict(str)
    for path, text in texts.items():
        owner = package(path)
        words[(owner, in_library(path))] |= set(WORD.findall(text))
        if in_library(path):
            words[(owner, False)] |= set(WORD.findall("\n".join(EXAMPLE.findall(text))))
            signatures[owner] += "\n".join(match for kind in SEEN for match in kind.findall(text))
    for pattern in ("docs/**/*.md", "README.md", "crates/**/*.h", "crates/**/*.py", "crates/**/*.pyi"):
        for path in ROOT.glob(pattern):
            words[(None, True)] |= set(WORD.findall(path.read_text()))
    seen = {owner: collections.Counter(WORD.findall(text)) for owner, text in signatures.items()}
    count, unnamed = 0, []
    for path, text in texts.items():
        if not in_library(path):
            continue
        owner = package(path)
        for item in ITEM.finditer(text.split("#[cfg(test)]\nmod tests {")[0]):
            kind, name = item["kind"], item["name"]
            count += 1
            elsewhere = any(name in own for who, own in words.items() if who != (owner, True))
            # Its own declaration and those of its methods name a type, too.
            own = len(re.findall(rf"^[ \t]*(?:pub (?:{KINDS}) {name}\b|impl\b[^{{]*\b{name}\b[^{{]*\{{)", signatures[owner], re.M))
            if not elsewhere and (kind in ("fn", "const", "static") or seen[owner][name] <= own):
                line = text[: item.start("name")].count("\n") + 1
                unnamed.append(f"{path.relative_to(ROOT)}:{line}: {kind} {name}")
    print(f"{len(unnamed)} of {count} public items are named by nobody; at most {MOST} may be")
    if len(unnamed) > MOST or "-v" in sys.argv:
        print("\n".join(unnamed))
    return len(unnamed) > MOST


if __name__ == "__main__":
    sys.exit(main())
