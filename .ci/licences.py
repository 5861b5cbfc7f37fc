"""Fails if a dependency has a licence that is not permissive (see docs/lab/dependencies.md)."""

import json
import re
import subprocess
import sys

ALLOWED = {
    "MIT", "MIT-0", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "ISC", "Zlib",
    "0BSD", "BSL-1.0", "CC0-1.0", "Unlicense", "Unicode-3.0",
    "MPL-2.0",  # file-level copyleft: fine for crates used unchanged
}

# Fonts: their licences let them be embedded and passed on with any program; only a changed font must take another name.
FONTS = {"OFL-1.1", "Ubuntu-font-1.0"}
OF_FONTS = {"epaint_default_fonts"}


def allowed(expression, known=ALLOWED):
    """True if some choice that an SPDX expression leaves is made of known licences only."""
    tokens = re.findall(r"\(|\)|[^\s()]+(?: WITH [^\s()]+)?", expression.replace("/", " OR "))

    def either():
        result = both()
        while tokens and tokens[0] == "OR":
            tokens.pop(0)
            result = both() or result
        return result

    def both():
        result = one()
        while tokens and tokens[0] == "AND":
            tokens.pop(0)
            result = one() and result
        return result

    def one():
        token = tokens.pop(0)
        if token == "(":
            result = either()
            tokens.pop(0)
            return result
        return token in known

    return either()


def main():
    # A check that cannot fail is a defect.
    assert allowed("MIT OR GPL-3.0") and allowed("(MIT OR Apache-2.0) AND Unicode-3.0")
    assert not allowed("GPL-3.0-only") and not allowed("MIT AND AGPL-3.0") and not allowed("LGPL-2.1")
    assert not allowed("OFL-1.1") and allowed("MIT AND OFL-1.1", ALLOWED | FONTS)
    metadata = json.loads(subprocess.check_output(["cargo", "metadata", "--format-version", "1", "--locked"]))
    packages = metadata["packages"]

    def fine(package):
        known = ALLOWED | FONTS if package["name"] in OF_FONTS else ALLOWED
        return bool(package["license"]) and allowed(package["license"], known)

    bad = [p for p in packages if not fine(p)]
    for package in bad:
        print(f"{package['name']} {package['version']}: {package['license'] or 'no licence given'}")
    if bad:
        sys.exit(1)
    print(f"{len(packages)} packages, all under permissive licences.")


main()
