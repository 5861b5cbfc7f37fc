"""A body from arrays, no file."""

import itertools

import numpy as np

import pliant
from pliant import tables as t


def block(n: int, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """Points [m] and tets of a cube of n³ cells, six tets each."""
    points = edge * np.array(list(itertools.product(range(n + 1), repeat=3)), dtype=float)
    corner = np.array([((i * (n + 1)) + j) * (n + 1) + k for i, j, k in itertools.product(range(n), repeat=3)])
    step = np.array([(n + 1) ** 2, n + 1, 1])
    tets = []
    for order in itertools.permutations(range(3)):
        path = np.cumsum([0, *step[list(order)]])
        tet = corner[:, None] + path
        even = np.linalg.det(np.eye(3)[list(order)]) > 0
        tets.append(tet if even else tet[:, [0, 2, 1, 3]])
    return points, np.concatenate(tets)


def main() -> pliant.History:
    """A block under its weight; what was recorded."""
    points, tets = block(4, 0.025)
    base = np.flatnonzero(points[:, 2] < 1e-9)
    mesh = pliant.Mesh(points, {"tetra": tets}, point_sets={"base": base})  # (n, 3) m, (k, 4)
    scene = pliant.Scene(until=0.3, gravity=(0, 0, -9.81))
    scene.law["tissue"] = t.NeoHookean(young_modulus=3e3, poisson_ratio=0.45)
    scene.body["block"] = t.Body(mesh=mesh, element="tet4-anp", law="tissue", density=1000, damping=5)
    scene.constraint["base"] = t.Fix(body="block", nodes={"set": "base"})
    history = scene.build().simulate().run(record=["displacement"], every=0.02)
    print(history, history["displacement"].shape)  # (frames, n, 3)
    return history


if __name__ == "__main__":
    main()
