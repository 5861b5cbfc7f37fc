"""Fails if a dependency has a known vulnerability. Looks nothing up: it reads a copy of RustSec's advisory database
(https://rustsec.org) where one is at hand: in $PLIANT_ADVISORIES, or where cargo-audit and cargo-deny keep theirs.
Where there is none it says NOT CHECKED and passes; with --required, as a release asks for, it fails. Unmaintained and
unsound crates are listed, and do not fail."""

import os
import pathlib
import re
import sys
import tomllib


def version(text):
    """A version as a tuple that sorts as semver does; a pre-release comes before its release."""
    core, _, pre = text.strip().split("+")[0].partition("-")
    numbers = [int(number) for number in core.split(".")]
    parts = tuple((0, int(part), "") if part.isdigit() else (1, 0, part) for part in pre.split(".")) if pre else ()
    return tuple(numbers + [0] * (3 - len(numbers))), not pre, parts


def satisfies(found, requirement):
    """Whether a version fulfils all comparators of a requirement, such as `>= 1.2.3, < 2`."""
    return all(fulfils(version(found), comparator) for comparator in requirement.split(",") if comparator.strip())


def fulfils(found, comparator):
    sign, text = re.fullmatch(r"\s*(>=|<=|>|<|=|\^|~|)\s*(\S+)\s*", comparator).groups()
    text = text.removesuffix(".*")
    if text == "*":
        return True
    bound, given = version(text), len(text.split("-")[0].split("."))
    numbers = bound[0]
    if sign in (">=", "<=", ">", "<"):
        return {">=": found >= bound, "<=": found <= bound, ">": found > bound, "<": found < bound}[sign]
    if sign == "=":
        return found == bound if given == 3 else found[0][:given] == numbers[:given]
    if sign == "~":
        fixed = max(1, min(given, 2))
    else:  # As Cargo reads it: the first number that is not 0 stays.
        fixed = next((place + 1 for place, number in enumerate(numbers[:given]) if number), given)
    return found >= bound and found[0][:fixed] == numbers[:fixed]


def databases():
    """Folders that hold a copy of the database."""
    named = os.environ.get("PLIANT_ADVISORIES")
    if named:
        if not (pathlib.Path(named) / "crates").is_dir():
            sys.exit(f"PLIANT_ADVISORIES: {named} has no folder `crates`")
        return [pathlib.Path(named)]
    home = pathlib.Path(os.environ.get("CARGO_HOME", pathlib.Path.home() / ".cargo"))
    return [path for path in [home / "advisory-db", *home.glob("advisory-dbs/*")] if (path / "crates").is_dir()]


def advisories(database, name):
    """The advisories about a crate, without those withdrawn."""
    for path in sorted((database / "crates" / name).glob("*.md")):
        block = re.search(r"```toml\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL)
        entry = tomllib.loads(block.group(1))
        if "withdrawn" not in entry["advisory"]:
            yield entry


def concerns(entry, found):
    """Whether a version has what an advisory is about."""
    versions = entry.get("versions", {})
    fine = versions.get("patched", []) + versions.get("unaffected", [])
    return not any(satisfies(found, requirement) for requirement in fine)


def main():
    # A check that cannot fail is a defect.
    assert satisfies("1.2.4", ">= 1.2.3, < 2") and not satisfies("2.0.0", ">= 1.2.3, < 2")
    assert satisfies("0.3.9", "^0.3.4") and not satisfies("0.4.0", "^0.3.4") and satisfies("1.9.0", "1.2")
    assert satisfies("1.2.9", "~1.2.3") and not satisfies("1.3.0", "~1.2.3") and satisfies("0.0.3", "=0.0.3")
    assert not satisfies("1.0.0-rc.1", ">= 1.0.0") and version("1.0.0-rc.2") < version("1.0.0-rc.10")
    assert concerns({"versions": {"patched": [">= 1.5"]}}, "1.4.9") and concerns({}, "1.0.0")
    assert not concerns({"versions": {"patched": [">= 1.5"], "unaffected": ["< 1.2"]}}, "1.1.0")
    found = databases()
    if not found:
        print(
            "NOT CHECKED: no copy of the advisory database at hand. Get one: "
            "git clone https://github.com/rustsec/advisory-db && export PLIANT_ADVISORIES=$PWD/advisory-db"
        )
        sys.exit(1 if "--required" in sys.argv else 0)
    with open("Cargo.lock", "rb") as lock:
        packages = tomllib.load(lock)["package"]
    bad = False
    for database in found:
        for package in packages:
            for entry in advisories(database, package["name"]):
                if concerns(entry, package["version"]):
                    kind = entry["advisory"].get("informational", "vulnerability")
                    bad |= kind == "vulnerability"
                    print(f"{package['name']} {package['version']}: {entry['advisory']['id']} ({kind})")
    if bad:
        sys.exit(1)
    print(f"{len(packages)} packages without a known vulnerability.")


main()
