"""Newton's soft bodies: its explicit finite elements (`SolverSemiImplicit`) and its implicit solver (`SolverVBD`), in single precision.

The model has particles and tets only, without triangles, particle grid and contacts: that is the least work.
"""

from __future__ import annotations

from functools import partial

import newton
import numpy as np
import warp as wp

from cube import LAME, LONG_STEP, SHEAR, Array, Cube, Slowed, serve


def soft_body(cube: Cube, shear: float, lame: float, *, coloured: bool) -> newton.Model:
    """The cube; particles of the held and of the moved face have no mass, which keeps them where they are."""
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    masses = np.where(cube.free, cube.masses, 0.0)
    builder.add_particles(pos=[wp.vec3(*p) for p in cube.points], vel=[wp.vec3()] * len(masses), mass=masses.tolist())
    for tet in cube.tets:
        i, j, k, m = map(int, tet)
        builder.add_tetrahedron(i, j, k, m, k_mu=shear, k_lambda=lame, k_damp=0.0)
    if coloured:
        builder.color()
    model = builder.finalize(device="cpu")
    model.particle_grid = None
    return model


class Soft(Slowed):
    """A model with two states that take turns. A graph replays two steps, so that Python costs nothing."""

    def __init__(self, cube: Cube, model: newton.Model, solver: newton.solvers.SolverBase, dt: float) -> None:
        self.cube, self.solver, self.dt = cube, solver, dt
        self.states = (model.state(), model.state())
        self.control = model.control()
        self.start()
        self.two()
        with wp.ScopedCapture(device="cpu") as capture:
            self.two()
        self.graph = capture.graph

    def two(self) -> None:
        """Two steps by single launches: from the first state to the second and back."""
        for one, other in (self.states, self.states[::-1]):
            one.clear_forces()
            self.solver.step(one, other, self.control, None, self.dt)

    def start(self) -> None:
        for state in self.states:
            state.particle_q.assign(self.cube.start.astype(np.float32))
            state.particle_qd.zero_()

    def slow(self, factor: float) -> None:
        speeds = self.states[0].particle_qd
        speeds.assign(speeds.numpy() * np.float32(factor))

    def step(self, count: int) -> None:
        for _ in range(count // 2):
            wp.capture_launch(self.graph)

    def places(self) -> Array:
        return self.states[0].particle_q.numpy().astype(np.float64)

    def force(self) -> float | None:
        return None


class Explicit(Soft):
    """Its moduli are set so that small strains have ours: μ = 3/4 `k_mu`, λ = `k_lambda` − 5/8 `k_mu`."""

    def __init__(self, cube: Cube) -> None:
        model = soft_body(cube, 4 / 3 * SHEAR, LAME + 5 / 6 * SHEAR, coloured=False)
        super().__init__(cube, model, newton.solvers.SolverSemiImplicit(model), cube.step)

    def force(self) -> float | None:
        return -float(self.states[1].particle_f.numpy()[self.cube.moved, 0].sum())


class Implicit(Soft):
    """Vertex block descent with some iterations a step, 10 unless told otherwise; it takes Lamé's own parameters."""

    def __init__(self, cube: Cube, iterations: int = 10) -> None:
        model = soft_body(cube, SHEAR, LAME, coloured=True)
        super().__init__(cube, model, newton.solvers.SolverVBD(model, iterations=iterations, particle_enable_self_contact=False), LONG_STEP)


if __name__ == "__main__":
    serve({"semi-implicit": Explicit, "vbd": Implicit, "vbd-40": partial(Implicit, iterations=40)})
