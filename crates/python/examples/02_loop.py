"""A loop with a live view of the displacements."""

import sys

import numpy as np

import pliant


def main(scene: str = "scenes/liver", until: float = 0.5) -> float:
    """Steps a scene; the largest displacement [m] at the end."""
    sim = pliant.load(scene).build().simulate()
    u = sim.displacement  # always the newest instant, no copy
    while sim.time < until:
        sim.step(50)
        print(f"{sim.time:.4f} s: {1e3 * np.linalg.norm(u, axis=1).max():.3f} mm")
    return float(np.linalg.norm(u, axis=1).max())


if __name__ == "__main__":
    main(*sys.argv[1:2])
