#!/usr/bin/env python3
"""Kernels are compiled once, in the crate that has them: bounds the machine code in the library of `sim`, which uses nearly all of them.

A solver that becomes generic over what its caller gives is compiled again by each caller. Asks cargo for the library that
`cargo build --release --locked` makes, and adds up its functions by name with `nm`.
"""

import collections
import json
import re
import shutil
import subprocess
import sys

# Of 1,304 kB, 406 kB were kernels of `explicit` and 122 kB their packs, before solvers were compiled in `explicit` alone.
MOST_KB = {"all": 700, "pliant_explicit": 80, "pulp": 10}


def main():
    if shutil.which("nm") is None:
        print("no nm: the size of the library of sim is not checked")
        return 0
    build = ["cargo", "build", "--release", "--locked", "--message-format=json"]
    messages = subprocess.run(build, check=True, capture_output=True, text=True).stdout.splitlines()
    made = [json.loads(line) for line in messages if line.startswith("{")]
    library = next(
        name
        for one in made
        if one["reason"] == "compiler-artifact" and one["target"]["name"] == "pliant_sim"
        for name in one["filenames"]
        if name.endswith(".rlib")
    )
    listed = subprocess.run(["nm", "-C", "-S", library], check=True, capture_output=True, text=True).stdout
    bytes_of = collections.Counter()
    for size, name in re.findall(r"^[0-9a-f]+ ([0-9a-f]+) [tTwW] (.*)$", listed, re.M):
        bytes_of["all"] += int(size, 16)
        for crate in set(re.findall(r"\b(\w+)::", name)) & MOST_KB.keys():
            bytes_of[crate] += int(size, 16)
    for crate, most in MOST_KB.items():
        print(f"machine code in the library of sim, {crate}: {bytes_of[crate] / 1000:.0f} kB of at most {most}")
    too_large = [crate for crate, most in MOST_KB.items() if bytes_of[crate] > 1000 * most]
    return bool(too_large) or bytes_of["all"] == 0


if __name__ == "__main__":
    sys.exit(main())
