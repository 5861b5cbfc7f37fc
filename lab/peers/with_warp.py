"""Warp: the same step as two kernels of our own, as a user of Warp would write them. Forces are added by atomics, which measured faster
on a CPU than a gather by the nodes. A graph replays the launches, so that Python costs nothing.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from cube import BULK, SHEAR, Array, Cube, Slowed, serve


@wp.kernel
def cell_forces(
    x: wp.array[wp.vec3],
    tets: wp.array[wp.vec4i],
    poses: wp.array[wp.mat33],
    volumes: wp.array[float],
    shear: float,
    bulk: float,
    forces: wp.array[wp.vec3],
):
    """Split neo-Hookean law: P = μ J^(−2/3) (F − tr(FᵀF)/3 F⁻ᵀ) + κ (J − 1) J F⁻ᵀ."""
    cell = wp.tid()
    nodes = tets[cell]
    pose = poses[cell]
    x0 = x[nodes[0]]
    f = wp.matrix_from_cols(x[nodes[1]] - x0, x[nodes[2]] - x0, x[nodes[3]] - x0) * pose
    a = wp.vec3(f[0, 0], f[1, 0], f[2, 0])
    b = wp.vec3(f[0, 1], f[1, 1], f[2, 1])
    c = wp.vec3(f[0, 2], f[1, 2], f[2, 2])
    bc = wp.cross(b, c)
    j = wp.dot(a, bc)
    part = shear * wp.pow(j, -2.0 / 3.0)
    cofactors = wp.matrix_from_cols(bc, wp.cross(c, a), wp.cross(a, b))
    stress = f * part + cofactors * (bulk * (j - 1.0) - part * wp.ddot(f, f) / (3.0 * j))
    h = stress * wp.transpose(pose) * (-volumes[cell])
    f1 = wp.vec3(h[0, 0], h[1, 0], h[2, 0])
    f2 = wp.vec3(h[0, 1], h[1, 1], h[2, 1])
    f3 = wp.vec3(h[0, 2], h[1, 2], h[2, 2])
    wp.atomic_add(forces, nodes[0], -(f1 + f2 + f3))
    wp.atomic_add(forces, nodes[1], f1)
    wp.atomic_add(forces, nodes[2], f2)
    wp.atomic_add(forces, nodes[3], f3)


@wp.kernel
def advance(forces: wp.array[wp.vec3], inverse_masses: wp.array[float], dt: float, x: wp.array[wp.vec3], v: wp.array[wp.vec3]):
    """Central differences; nodes of no inverse mass stay."""
    node = wp.tid()
    speed = v[node] + forces[node] * (inverse_masses[node] * dt)
    v[node] = speed
    x[node] = x[node] + speed * dt
    forces[node] = wp.vec3()


class Kernels(Slowed):
    """The cube in arrays of Warp, in single precision."""

    def __init__(self, cube: Cube) -> None:
        self.cube, self.dt = cube, cube.step
        nodes, cells = len(cube.points), len(cube.tets)
        with wp.ScopedDevice("cpu"):
            self.x = wp.array(cube.points, dtype=wp.vec3)
            self.v = wp.zeros(nodes, dtype=wp.vec3)
            self.forces = wp.zeros(nodes, dtype=wp.vec3)
            tets = wp.array(cube.tets, dtype=wp.vec4i)
            poses = wp.array(cube.poses.astype(np.float32), dtype=wp.mat33)
            volumes = wp.array(cube.volumes.astype(np.float32))
            inverse_masses = wp.array(np.where(cube.free, 1 / cube.masses, 0).astype(np.float32))
            self.cells = (cells, [self.x, tets, poses, volumes, SHEAR, BULK, self.forces])
            self.nodes = (nodes, [self.forces, inverse_masses, self.dt, self.x, self.v])
            self.launch()
            with wp.ScopedCapture() as capture:
                self.launch()
            self.graph = capture.graph

    def launch(self) -> None:
        """A step by single launches."""
        wp.launch(cell_forces, *self.cells)
        wp.launch(advance, *self.nodes)

    def start(self) -> None:
        self.x.assign(self.cube.start.astype(np.float32))
        self.v.zero_()

    def slow(self, factor: float) -> None:
        self.v.assign(self.v.numpy() * np.float32(factor))

    def step(self, count: int) -> None:
        for _ in range(count):
            wp.capture_launch(self.graph)

    def places(self) -> Array:
        return self.x.numpy().astype(np.float64)

    def force(self) -> float:
        with wp.ScopedDevice("cpu"):
            wp.launch(cell_forces, *self.cells)
        force = -float(self.forces.numpy()[self.cube.moved, 0].sum())
        self.forces.zero_()
        return force


if __name__ == "__main__":
    serve({"kernels": Kernels})
