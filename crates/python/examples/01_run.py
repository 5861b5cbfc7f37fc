"""Load a scene, run it with its outputs, look at the table."""

import sys
import tempfile

import pliant


def main(scene: str = "scenes/liver", until: float = 0.5) -> pliant.Result:
    """Runs a scene; the result."""
    with tempfile.TemporaryDirectory() as out:
        result = pliant.load(scene, set={"scene.until": until}).run(f"{out}/liver", threads=0)
        print(result.status, result.reactions["pull"], "N")
        print(result.history.to_pandas().iloc[-1])
    return result


if __name__ == "__main__":
    main(*sys.argv[1:2])
