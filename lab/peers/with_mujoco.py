"""MuJoCo's flex: a vertex is a body on three slides, tets are St Venant–Kirchhoff, in double precision. Contacts are switched off.

MuJoCo takes no elastic flex on a body that is led, so the moved face is on a body of a million kilograms, which stays where it is put.
"""

from __future__ import annotations

import mujoco
import numpy as np

from cube import LONG_STEP, POISSON, SQUEEZE, YOUNG, Array, Cube, Slowed, serve

SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>'


def text(numbers: Array) -> str:
    """Numbers as XML has them."""
    return " ".join(f"{number:.10g}" for number in numbers.ravel())


def model_of(cube: Cube, integrator: str, dt: float) -> mujoco.MjModel:
    """The cube as MJCF."""
    bodies = ['<body name="moved"><inertial pos="0 0 0" mass="1e6" diaginertia="1 1 1"/>' + SLIDES + "</body>"]
    names = ["world" if held else "moved" for held in cube.held]
    for node in np.flatnonzero(cube.free):
        names[node] = f"node{node}"
        mass = f'<inertial pos="0 0 0" mass="{cube.masses[node]:.10g}" diaginertia="1e-9 1e-9 1e-9"/>'
        bodies.append(f'<body name="node{node}" pos="{text(cube.points[node])}">{mass}{SLIDES}</body>')
    places = np.where(cube.free[:, None], 0.0, cube.points)
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco>
  <option timestep="{dt}" integrator="{integrator}" gravity="0 0 0"><flag contact="disable"/></option>
  <size memory="2G"/>
  <worldbody>{"".join(bodies)}</worldbody>
  <deformable>
    <flex name="cube" dim="3" body="{" ".join(names)}" vertex="{text(places)}" element="{" ".join(map(str, cube.tets.ravel()))}">
      <contact selfcollide="none" contype="0" conaffinity="0"/>
      <elasticity young="{YOUNG}" poisson="{POISSON}" damping="0"/>
    </flex>
  </deformable>
</mujoco>"""
    )


class Flex(Slowed):
    """A model with its data: the moved body first, then the free nodes."""

    def __init__(self, cube: Cube, integrator: str, dt: float) -> None:
        self.cube, self.dt = cube, dt
        self.model = model_of(cube, integrator, dt)
        self.data = mujoco.MjData(self.model)

    def start(self) -> None:
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:3] = SQUEEZE
        self.data.qpos[3:] = (self.cube.start - self.cube.points)[self.cube.free].ravel()

    def slow(self, factor: float) -> None:
        self.data.qvel[:] *= factor

    def step(self, count: int) -> None:
        mujoco.mj_step(self.model, self.data, count)

    def places(self) -> Array:
        places = self.cube.start.copy()
        places[self.cube.free] = self.cube.points[self.cube.free] + self.data.qpos[3:].reshape(-1, 3)
        return places

    def force(self) -> float:
        return -float(self.data.qfrc_passive[0])


class Explicit(Flex):
    """Semi-implicit Euler."""

    def __init__(self, cube: Cube) -> None:
        super().__init__(cube, "Euler", cube.step)


class Implicit(Flex):
    """The integrator that MuJoCo recommends for flexes."""

    def __init__(self, cube: Cube) -> None:
        super().__init__(cube, "discrete", LONG_STEP)


if __name__ == "__main__":
    serve({"euler": Explicit, "discrete": Implicit})
