"""Shells under growing pressure."""

import sys

import pliant


def main(scene: str = "scenes/colon") -> list[float]:
    """The largest membrane force [N/m] of a colon at three pressures."""
    sim = pliant.load(scene).build().simulate()
    most = []
    for pressure in (100.0, 200.0, 300.0):  # Pa
        sim.set({"load.gas.pressure": pressure})
        sim.step(25)
        forces = sim.field("membrane-force", on="colon", at="cells")  # (cells, 3, 3) N/m
        most.append(float(abs(forces).max()))
        print(pressure, sim.reaction("grasper"), forces.shape)
    return most


if __name__ == "__main__":
    main(*sys.argv[1:2])
