"""Real-time simulation of soft organs.

A `Scene` describes the bodies and the run, as plain data. It is built into a `Model`, which is constant and shared, and a
`Simulation` runs the model. SI units throughout: m, kg, s, Pa, N.

>>> import pliant
>>> scene = pliant.Scene.of_mesh(pliant.Mesh.block([0.1, 0.05, 0.05], edge=0.025))
>>> scene["scene.gravity"] = (0.0, 0.0, -9.81)
>>> sim = scene.build().simulate()
>>> sim.step(50)
50
"""

from pliant import errors, tables
from pliant._native import __version__, devices
from pliant.errors import (
    BlockedError,
    BusyError,
    ClosedError,
    ClusterError,
    ConvergenceError,
    DeviceError,
    Diagnostic,
    Error,
    InternalError,
    MeshError,
    OutputError,
    PliantWarning,
    ResumeError,
    SceneError,
    SimulationError,
    UnstableError,
)
from pliant.image import Image
from pliant.mesh import Mesh
from pliant.model import Body, Model
from pliant.pictures import Picture
from pliant.result import History, Progress, Result
from pliant.scene import Scene, load
from pliant.simulation import Energies, Grip, Simulation, State, Tool
from pliant.sweeps import Sweep, merge, sweep

__all__ = [
    "BlockedError",
    "Body",
    "BusyError",
    "ClosedError",
    "ClusterError",
    "ConvergenceError",
    "DeviceError",
    "Diagnostic",
    "Energies",
    "Error",
    "Grip",
    "History",
    "Image",
    "InternalError",
    "Mesh",
    "MeshError",
    "Model",
    "OutputError",
    "Picture",
    "PliantWarning",
    "Progress",
    "Result",
    "ResumeError",
    "Scene",
    "SceneError",
    "Simulation",
    "SimulationError",
    "State",
    "Sweep",
    "Tool",
    "UnstableError",
    "__version__",
    "devices",
    "errors",
    "load",
    "merge",
    "sweep",
    "tables",
]
