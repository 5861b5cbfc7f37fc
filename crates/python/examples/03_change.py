"""Change a number while it runs; go back and go on with another one."""

import sys

import numpy as np

import pliant


def main(scene: str = "scenes/liver", until: float = 0.3) -> tuple[float, float]:
    """The pull [N] with a stiffer and with the usual tissue, from the same state."""
    sim = pliant.load(scene).build().simulate()
    sim.run(until=0.5 * until)
    before = sim.state()  # displacements, velocities, what relaxing tissue remembers; not the numbers
    usual = float(sim.model.scene["law.parenchyma.shear-modulus"])

    sim.set({"law.parenchyma.shear-modulus": 1.5 * usual})
    sim.run(until=until)
    stiff = float(np.linalg.norm(sim.reaction("pull")))

    sim.restore(before)
    sim.set({"law.parenchyma.shear-modulus": usual})
    sim.run(until=until)
    soft = float(np.linalg.norm(sim.reaction("pull")))
    print(f"{stiff:.3f} N with 1.5 times the stiffness, {soft:.3f} N as it is")
    return stiff, soft


if __name__ == "__main__":
    main(*sys.argv[1:2])
