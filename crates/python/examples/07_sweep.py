"""Many runs, here or on more machines; interrupted, the same line again goes on."""

import tempfile

import numpy as np

import pliant


def main(on: object = "local") -> pliant.Sweep:
    """The force that holds a hanging block, for some stiffnesses: on="dask", on="ray" or a client give the same rows."""
    scene = pliant.Scene(until=0.2, gravity=(0, 0, -9.81))
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 3e3, "poisson-ratio": 0.45}
    mesh = {"block": {"size": [0.1, 0.1, 0.1]}, "edge": 0.05}
    scene.body["block"] = {"mesh": mesh, "law": "tissue", "density": 1000.0, "damping": 20.0}
    scene.constraint["base"] = {"type": "fix", "body": "block", "nodes": {"set": "z-max"}}
    with tempfile.TemporaryDirectory() as out:
        table = pliant.sweep(scene, {"law.tissue.young-modulus": np.linspace(2e3, 6e3, 5)}, on=on, out=out, progress=False)
    for row in table:
        print(row["law.tissue.young-modulus"], row["status"], row["reaction.base.z"])
    return table


if __name__ == "__main__":
    main()
