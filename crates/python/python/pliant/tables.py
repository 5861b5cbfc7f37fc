"""The tables of scenes as classes, with units, ranges and defaults. SI units throughout.

Written by `pliant schema --python` from the parameter structs; do not edit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from pliant._table import Table

if TYPE_CHECKING:
    from pliant.mesh import Mesh


@dataclass(frozen=True, kw_only=True)
class Run(Table):
    """`[run]`. Settings of the run.

    Parameters
    ----------
    device
        Device of the solver. Takes one of "cpu", "gpu", "auto"; "cpu" if not given.
    adapter
        The GPU, by a part of its name in `pliant devices`; if not given, the best one. Takes a text.
    design
        Design of the GPU kernels that bring forces from cells to nodes. If not given, the ways that measured best: `fast`, and `gather` on adapters that are software. Takes one of "gather", "blocks", "float-atomics", "fast".
    precision
        Number type of the solver; if not given, `double` on the CPU and `single` on a GPU, which has only this. Takes "single" or "double".
    solver
        Solver that advances the state in time. Takes one of "explicit", "quasi-static", "implicit", "static"; "explicit" if not given.
    step
        Time step [s], made a little shorter if it does not divide the duration. `auto` is 0.9 × the critical time step of the assembled model at rest. With the solvers `quasi-static` and `static`, `auto` follows `load-steps`; with `implicit` it is 0.01 s. Takes "auto" or a number, greater than 0; "auto" if not given.
    on_unstable
        Reaction of an explicit run when the critical time step of the deformed model falls below its step. The critical step is watched during the run. If not given, `substep`. Takes one of "substep", "stop", "report".
    mass_scaling
        Makes the nodes that limit an explicit step heavier. Takes { target-step = … } or { share = … }.
    load_steps
        Load steps of a quasi-static or static run with `step = "auto"`: their number if equal, or the times at which they end. Takes a whole number or { times = … }, at least 1 and at most 1000000; 10 if not given.
    tolerance
        Largest residual force over the largest internal force (or load, or inertial force) at which an equilibrium is found. If not given, 1e-8 with the solver `static` and 1e-6 with `implicit`. With `quasi-static` 1e-6 in double and 1e-4 in single precision if not given. Takes a number, greater than 0 and less than 1.
    iterations
        Most iterations of Newton's method in a step of `implicit` (20 if not given) or `static` (40). With 1 a step of `implicit` is one linear solution, and its residual is not checked: for real time. Takes a whole number, at least 1 and at most 10000.
    speed_tolerance
        Speed [m/s] of all nodes below which a Newton step of `implicit` in contact is the last one; this step is still made. If not given, a step must move no node by more than a thousandth of `barrier-distance`. Takes a number, greater than 0.
    accept_unconverged
        True to accept the last state of an `implicit` step, instead of halving it, when its `iterations` run out or its energy stops falling. This bounds the time of a step, for real time. In contact that state has no intersection. Summary and window count these steps. Takes true or false.
    integrator
        Time integrator of `implicit`; `backward-euler` if not given. Takes "backward-euler" or "bdf2".
    linear
        Linear solver of `implicit` and `static`. Takes "direct", "unsymmetric" or "conjugate-gradients" or { by = … }.
    control
        Quantity that a `static` run prescribes instead of the size of a load, so that it passes limit points. Takes { load = … }.
    allow_hourglass
        Part of the internal energy that may be in hourglass modes of `hex8` at the end of a run. With more, the run writes all outputs and ends with an error: the shape of the elements is not resolved. Takes a number, at least 0; 0.1 if not given.
    threads
        Threads; 0: one per core. The number never changes a result. Takes a whole number, at least 0 and at most 1024; 0 if not given.
    checkpoint
        Checkpoints to resume an interrupted run from (`pliant run --resume`); the last two are kept. Takes { every = … }.
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"device": "device", "adapter": "adapter", "design": "design", "precision": "precision", "solver": "solver", "step": "step", "on_unstable": "on-unstable", "mass_scaling": "mass-scaling", "load_steps": "load-steps", "tolerance": "tolerance", "iterations": "iterations", "speed_tolerance": "speed-tolerance", "accept_unconverged": "accept-unconverged", "integrator": "integrator", "linear": "linear", "control": "control", "allow_hourglass": "allow-hourglass", "threads": "threads", "checkpoint": "checkpoint"}

    device: str | None = None
    adapter: str | None = None
    design: str | None = None
    precision: Any | None = None
    solver: str | None = None
    step: Any | None = None
    on_unstable: str | None = None
    mass_scaling: Any | None = None
    load_steps: Any | None = None
    tolerance: float | None = None
    iterations: int | None = None
    speed_tolerance: float | None = None
    accept_unconverged: bool | None = None
    integrator: Any | None = None
    linear: Any | None = None
    control: Any | None = None
    allow_hourglass: float | None = None
    threads: int | None = None
    checkpoint: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Participant(Table):
    """`[participant.NAME]`. Bodies with a solver and a step of their own. Bodies that no participant names follow `[run]`: with the solvers `implicit` and `static` all together, else the solids together and the shells together. Participants advance at their own steps and meet at common instants, where outputs are written. A key that is left out has the value of `[run]`.

    Parameters
    ----------
    bodies
        The bodies: solids or shells, with the solvers `implicit` and `static` also both. Takes an array of texts.
    solver
        Same as in `[run]`. Takes one of "explicit", "quasi-static", "implicit", "static".
    step
        Time step [s], as in `[run]`. Common instants are as far apart as the longest step of all participants; shorter steps are made a little shorter where they don't divide it. Takes "auto" or a number, greater than 0.
    on_unstable
        Same as in `[run]`. Takes one of "substep", "stop", "report".
    mass_scaling
        Same as in `[run]`. Takes { target-step = … } or { share = … }.
    load_steps
        Same as in `[run]`. Takes a whole number or { times = … }, at least 1 and at most 1000000.
    tolerance
        Same as in `[run]`. Takes a number, greater than 0 and less than 1.
    iterations
        Same as in `[run]`. Takes a whole number, at least 1 and at most 10000.
    speed_tolerance
        Speed [m/s] below which a Newton step in contact is the last one, as in `[run]`. Takes a number, greater than 0.
    accept_unconverged
        Same as in `[run]`. Takes true or false.
    integrator
        Same as in `[run]`. Takes "backward-euler" or "bdf2".
    linear
        Same as in `[run]`. Takes "direct", "unsymmetric" or "conjugate-gradients" or { by = … }.
    control
        Same as in `[run]`. Takes { load = … }.
    precision
        Same as in `[run]`. Takes "single" or "double".
    device
        Same as in `[run]`. Takes one of "cpu", "gpu", "auto".
    adapter
        Same as in `[run]`. Takes a text.
    design
        Same as in `[run]`. Takes one of "gather", "blocks", "float-atomics", "fast".
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"bodies": "bodies", "solver": "solver", "step": "step", "on_unstable": "on-unstable", "mass_scaling": "mass-scaling", "load_steps": "load-steps", "tolerance": "tolerance", "iterations": "iterations", "speed_tolerance": "speed-tolerance", "accept_unconverged": "accept-unconverged", "integrator": "integrator", "linear": "linear", "control": "control", "precision": "precision", "device": "device", "adapter": "adapter", "design": "design"}

    bodies: Sequence[str]
    solver: str | None = None
    step: Any | None = None
    on_unstable: str | None = None
    mass_scaling: Any | None = None
    load_steps: Any | None = None
    tolerance: float | None = None
    iterations: int | None = None
    speed_tolerance: float | None = None
    accept_unconverged: bool | None = None
    integrator: Any | None = None
    linear: Any | None = None
    control: Any | None = None
    precision: Any | None = None
    device: str | None = None
    adapter: str | None = None
    design: str | None = None


@dataclass(frozen=True, kw_only=True)
class NeoHookean(Table):
    """`[law.NAME]` with ``type = "neo-hookean"``. Parameters of the split neo-Hookean law: Ψ = μ/2 (Ī₁ − 3) + U(J).

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "neo-hookean"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class CoupledNeoHookean(Table):
    """`[law.NAME]` with ``type = "coupled-neo-hookean"``. Parameters of the coupled neo-Hookean law: Ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (J − 1)², λ = κ − 2μ/3.

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "coupled-neo-hookean"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class LogarithmicNeoHookean(Table):
    """`[law.NAME]` with ``type = "logarithmic-neo-hookean"``. Parameters of the ln² neo-Hookean law: Ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 ln² J, λ = κ − 2μ/3.

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "logarithmic-neo-hookean"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class StVenantKirchhoff(Table):
    """`[law.NAME]` with ``type = "st-venant-kirchhoff"``. Parameters of the St Venant–Kirchhoff law: Ψ = λ/2 (tr E)² + μ E:E, λ = κ − 2μ/3. Collapses under compression.

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "st-venant-kirchhoff"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Corotational(Table):
    """`[law.NAME]` with ``type = "corotational"``. Parameters of the co-rotated linear law: Ψ = μ |U − I|² + λ/2 tr²(U − I), λ = κ − 2μ/3. For small strains.

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "corotational"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class MooneyRivlin(Table):
    """`[law.NAME]` with ``type = "mooney-rivlin"``. Parameters of the Mooney–Rivlin law: Ψ = c₁₀ (Ī₁ − 3) + c₀₁ (Ī₂ − 3) + U(J); μ = 2 (c₁₀ + c₀₁) > 0 at rest.

    Parameters
    ----------
    c10
        Coefficient c₁₀ of Ī₁ − 3 [Pa]. Takes a number.
    c01
        Coefficient c₀₁ of Ī₂ − 3 [Pa]. Takes a number.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν at rest; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "mooney-rivlin"
    _keys: ClassVar[dict[str, str]] = {"c10": "c10", "c01": "c01", "bulk_modulus": "bulk-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    c10: float
    c01: float
    bulk_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Polynomial(Table):
    """`[law.NAME]` with ``type = "polynomial"``. Parameters of the polynomial law: Ψ = Σ cᵢⱼ (Ī₁ − 3)ⁱ (Ī₂ − 3)ʲ + U(J), 1 ≤ i + j ≤ 2; μ = 2 (c₁₀ + c₀₁) > 0 at rest.

    Parameters
    ----------
    c10
        Coefficient c₁₀ of Ī₁ − 3 [Pa]. Takes a number.
    c01
        Coefficient c₀₁ of Ī₂ − 3 [Pa]. Takes a number.
    c20
        Coefficient c₂₀ of (Ī₁ − 3)² [Pa]. Takes a number; 0.0 if not given.
    c11
        Coefficient c₁₁ of (Ī₁ − 3)(Ī₂ − 3) [Pa]. Takes a number; 0.0 if not given.
    c02
        Coefficient c₀₂ of (Ī₂ − 3)² [Pa]. Takes a number; 0.0 if not given.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν at rest; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "polynomial"
    _keys: ClassVar[dict[str, str]] = {"c10": "c10", "c01": "c01", "c20": "c20", "c11": "c11", "c02": "c02", "bulk_modulus": "bulk-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    c10: float
    c01: float
    c20: float | None = None
    c11: float | None = None
    c02: float | None = None
    bulk_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Yeoh(Table):
    """`[law.NAME]` with ``type = "yeoh"``. Parameters of the Yeoh law: Ψ = c₁ (Ī₁ − 3) + c₂ (Ī₁ − 3)² + c₃ (Ī₁ − 3)³ + U(J); μ = 2 c₁ at rest.

    Parameters
    ----------
    c1
        Coefficient c₁ of Ī₁ − 3 [Pa]. Takes a number, greater than 0.
    c2
        Coefficient c₂ of (Ī₁ − 3)² [Pa]. Takes a number; 0.0 if not given.
    c3
        Coefficient c₃ of (Ī₁ − 3)³ [Pa]. Takes a number; 0.0 if not given.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν at rest; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "yeoh"
    _keys: ClassVar[dict[str, str]] = {"c1": "c1", "c2": "c2", "c3": "c3", "bulk_modulus": "bulk-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    c1: float
    c2: float | None = None
    c3: float | None = None
    bulk_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class ArrudaBoyce(Table):
    """`[law.NAME]` with ``type = "arruda-boyce"``. Parameters of the Arruda–Boyce law: Ψ = μ Σ Cᵢ/λₘ^(2i−2) (Ī₁ⁱ − 3ⁱ) + U(J), five terms.

    Parameters
    ----------
    shear_modulus
        Modulus μ of the series [Pa]; the shear modulus at rest is larger, μ (1 + 3/(5 λₘ²) + …). Takes a number, greater than 0.
    locking_stretch
        Stretch λₘ at which the chains are straight. Takes a number, greater than 1.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν at rest; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "arruda-boyce"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "locking_stretch": "locking-stretch", "bulk_modulus": "bulk-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    shear_modulus: float
    locking_stretch: float
    bulk_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Gent(Table):
    """`[law.NAME]` with ``type = "gent"``. Parameters of the Gent law: Ψ = −μ Jₘ/2 ln(1 − (Ī₁ − 3)/Jₘ) + U(J).

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    limit
        Limit Jₘ of Ī₁ − 3, where the tissue locks; under uniaxial stretch λ: λ² + 2/λ − 3. Takes a number, greater than 0.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "gent"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "limit": "limit", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    limit: float
    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Demiray(Table):
    """`[law.NAME]` with ``type = "demiray"``. Parameters of the Demiray law: Ψ = μ/(2b) (e^(b (Ī₁−3)) − 1) + U(J).

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    exponent
        Exponent b. Takes a number, greater than 0.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "demiray"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "exponent": "exponent", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    exponent: float
    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class VerondaWestmann(Table):
    """`[law.NAME]` with ``type = "veronda-westmann"``. Parameters of the Veronda–Westmann law: Ψ = c₁ (e^(c₂ (Ī₁−3)) − 1) − c₁c₂/2 (Ī₂ − 3) + U(J); μ = c₁ c₂ at rest.

    Parameters
    ----------
    c1
        Coefficient c₁ [Pa]. Takes a number, greater than 0.
    c2
        Exponent c₂. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν at rest; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "veronda-westmann"
    _keys: ClassVar[dict[str, str]] = {"c1": "c1", "c2": "c2", "bulk_modulus": "bulk-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    c1: float
    c2: float
    bulk_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Ogden(Table):
    """`[law.NAME]` with ``type = "ogden"``. Parameters of the Ogden law: Ψ = Σₚ 2μₚ/αₚ² (λ̄₁^αₚ + λ̄₂^αₚ + λ̄₃^αₚ − 3) + U(J); μ = Σ μₚ at rest.

    Parameters
    ----------
    terms
        One to six terms, each with `shear-modulus` [Pa] and `exponent`. Takes an array of 1 to 6 tables.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν at rest; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "ogden"
    _keys: ClassVar[dict[str, str]] = {"terms": "terms", "bulk_modulus": "bulk-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    terms: Any
    bulk_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class TransverselyIsotropic(Table):
    """`[law.NAME]` with ``type = "transversely-isotropic"``. Parameters of the transversely isotropic law: Ψ = μ/2 (Ī₁ − 3) + η/2 (Ī₄ − 1)² + U(J).

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre_modulus
        Fibre modulus η [Pa]. Takes a number, at least 0.
    convention
        `energy`: η belongs to the energy above. `taylor`: η as published with Taylor 2009, NiftySim or SOFA (half). Takes "energy" or "taylor"; "energy" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "transversely-isotropic"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre_modulus": "fibre-modulus", "convention": "convention", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    fibre_modulus: float
    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    convention: Any | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Orthotropic(Table):
    """`[law.NAME]` with ``type = "orthotropic"``. Parameters of the orthotropic law: Ψ = μ/2 (Ī₁ − 3) + ½ Σ eₖ (Īₖ − 1)² + U(J), k = 4 … 7. The families are `fibre` and `second-fibre` of the law or the body.

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    e4
        Modulus e₄ of the first family, on Ī₄ − 1 [Pa]. Takes a number, at least 0; 0.0 if not given.
    e5
        Modulus e₅ of the first family, on Ī₅ − 1 [Pa]. Takes a number, at least 0; 0.0 if not given.
    e6
        Modulus e₆ of the second family, on Ī₆ − 1 [Pa]. Takes a number, at least 0; 0.0 if not given.
    e7
        Modulus e₇ of the second family, on Ī₇ − 1 [Pa]. Takes a number, at least 0; 0.0 if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "orthotropic"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "e4": "e4", "e5": "e5", "e6": "e6", "e7": "e7", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    e4: float | None = None
    e5: float | None = None
    e6: float | None = None
    e7: float | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class HolzapfelGasserOgden(Table):
    """`[law.NAME]` with ``type = "holzapfel-gasser-ogden"``. Parameters of the Holzapfel–Gasser–Ogden law: Ψ = c/2 (Ī₁ − 3) + Σ k₁/(2k₂) (e^(k₂ ⟨E⟩²) − 1) + U(J), E = κ (Ī₁ − 3) + (1 − 3κ)(Ī₄ − 1). The families are `fibre` and `second-fibre` of the law or the body.

    Parameters
    ----------
    shear_modulus
        Shear modulus μ [Pa]. Takes a number, greater than 0.
    bulk_modulus
        Bulk modulus κ [Pa]. Takes a number, greater than 0.
    young_modulus
        Young's modulus E [Pa]. Takes a number, greater than 0.
    poisson_ratio
        Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for membranes and shells. Takes a number, greater than -1 and at most 0.5.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre_modulus
        Fibre modulus k₁ [Pa]. Takes a number, at least 0.
    fibre_exponent
        Fibre exponent k₂. Takes a number, greater than 0.
    dispersion
        Dispersion κ of the fibres: 0 aligned, 1/3 in all directions. Takes a number, at least 0 and at most 0.3333333333333333; 0.0 if not given.
    families
        Families of fibres; with 2, the law or the body has a `second-fibre`. Takes a whole number, at least 1 and at most 2; 1 if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "holzapfel-gasser-ogden"
    _keys: ClassVar[dict[str, str]] = {"shear_modulus": "shear-modulus", "bulk_modulus": "bulk-modulus", "young_modulus": "young-modulus", "poisson_ratio": "poisson-ratio", "volumetric": "volumetric", "fibre_modulus": "fibre-modulus", "fibre_exponent": "fibre-exponent", "dispersion": "dispersion", "families": "families", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    fibre_modulus: float
    fibre_exponent: float
    shear_modulus: float | None = None
    bulk_modulus: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    volumetric: str | None = None
    dispersion: float | None = None
    families: int | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class FungOrthotropic(Table):
    """`[law.NAME]` with ``type = "fung-orthotropic"``. Parameters of the Fung law: Ψ = c/2 (e^Q − 1) + U(J), Q = d·Dd + Σ sₘ (2Eₘ)², d = (E₁₁, E₂₂, E₃₃), m = 12, 23, 13.

    Parameters
    ----------
    modulus
        Modulus c [Pa]. Takes a number, greater than 0.
    normal
        Rows of the form D of the normal strains: symmetric, positive definite. Takes 3 arrays of 3 numbers.
    shear
        Coefficients s of the shears 12, 23, 13, each greater than 0. Takes 3 numbers.
    axes
        Material axes 1, 2, 3 at rest: unit vectors at right angles; by default x, y, z. Takes 3 arrays of 3 numbers.
    bulk_modulus
        Modulus κ of the volumetric energy U(J) [Pa]; the exponential adds to the bulk modulus. Takes a number, greater than 0.
    volumetric
        Form of the energy U(J) of a change of volume. Takes one of "quadratic", "quad-log", "ln-squared", "j-ln-j"; "quadratic" if not given.
    fibre
        Fibre direction at rest, for laws with fibres; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest, for laws with two; a body may give its own. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    prony
        Relaxation by Prony series; any number of terms on either part of the stress. Takes an array of tables; [] if not given.
    prony_update
        Update of the relaxation over a step. Takes "exact" or "backward-euler"; "exact" if not given.
    """

    _type: ClassVar[str | None] = "fung-orthotropic"
    _keys: ClassVar[dict[str, str]] = {"modulus": "modulus", "normal": "normal", "shear": "shear", "axes": "axes", "bulk_modulus": "bulk-modulus", "volumetric": "volumetric", "fibre": "fibre", "second_fibre": "second-fibre", "prony": "prony", "prony_update": "prony-update"}

    modulus: float
    normal: Any
    shear: Sequence[float]
    bulk_modulus: float
    axes: Any | None = None
    volumetric: str | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None
    prony: Any | None = None
    prony_update: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Body(Table):
    """`[body.NAME]`. A body.

    Parameters
    ----------
    model
        Model of the body; if not given, `solid`, or `membrane` with `on`. With the solvers `explicit` and `quasi-static` shells are a participant of their own (`[participant.NAME]`). Takes one of "solid", "shell", "membrane", "bar"; "solid" if not given.
    mesh
        Its mesh, from a file, a built-in shape, or a segmented image. The mesh of a shell or a membrane is of triangles (quads are cut into two); of a volume mesh it takes the boundary. The mesh of bars is of lines. Takes a table.
    on
        Instead of a mesh: the body on whose boundary this one is a wall, with the same nodes, as the capsule of an organ. Takes a text.
    faces
        The faces of that boundary that are the wall; if not given, all faces. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    rotations
        Behaviour of the rotations of a shell that is a wall with `on`. Takes "free" or "follow"; "free" if not given.
    element
        The element; if not given, `tet4` for tets, `hex8` for hexes and `dkt-curved` for shells; `model = "membrane"` has one only. For soft tissue prefer `tet4-anp` to `tet4`. Takes one of "tet4", "tet4-anp", "tet4-ianp", "tet4-ianp-niftysim", "hex8", "hex8-full", "dkt-curved", "dkt-opt", "dkt-cst", "membrane", "plate", "comas-2010".
    law
        The name of its law, or a law for each cell label, by number or by the name of the label: `{ 1 = "soft", tumour = "stiff" }`. Shells and bars take the moduli of an isotropic law at small strain; a shell whose `layers` all have their own elasticity needs none. Takes a text or a table of texts; {} if not given.
    density
        Mass per volume [kg/m³], or one for each cell label, as for `law`. Elements with averaged pressure average it separately on parts of different density. Takes a number or a table of numbers, greater than 0.
    thickness
        Thickness of a shell or a membrane [m]: one, or one for each triangle. Takes a number, { cell-data = … } or { by-label = … }, greater than 0.
    layers
        Layers of a shell from the side that its triangles face away from to the side that they face, instead of a `thickness`. Their angles count from `fibre`, projected on each triangle. Takes an array of tables.
    pre_tension
        Tension [N/m] of a shell in the shape of its mesh, equal in all directions: it holds a flat `membrane` across its plane. Not for the element `plate`. Takes a number, at least 0; 0.0 if not given.
    normals
        Source of the normals at rest of a shell, which make its surface curved. If not given, the mesh, if it has normals (built-in shapes have) and there is no `crease`; else the triangles. Takes "mesh" or "triangles".
    crease
        Angle [degrees] between triangles of a shell above which their edge is a crease, where the curved surface has a kink; 45 if not given. Not with the normals of a mesh. Takes a number, at least 0 and at most 180.
    branches
        True if more than two triangles of a shell may meet in an edge. Takes true or false; false if not given.
    fraction
        Name of a cell-data array of the mesh with the part of each cell that the body fills, above 0 and at most 1. The part scales the stiffness and mass of the cell, but never below a tenth. If not given, `fraction` of `immersed-hexes`. Takes a text.
    area
        Cross section of bars [m²]. Takes a number, greater than 0.
    slack
        Length of bars without force over their length in the mesh: above 1 they are slack at the start, below 1 they pull. Takes a number, at least 0.1 and at most 10; 1.0 if not given.
    tension_only
        True if bars take no compression, as threads. Takes true or false; false if not given.
    damping
        Mass-proportional damping [1/s]. Takes a number, at least 0; 0.0 if not given.
    stiffness_damping
        Stiffness-proportional damping β [s] with the solver `implicit`, and with `explicit` of all bodies but shells; the same for all bodies of a participant. It damps a vibration of angular frequency ω with the ratio βω/2. An explicit step shrinks with it, from the critical time step Δt to √(β² + Δt²) − β. Takes a number, at least 0; 0.0 if not given.
    hourglass
        Stiffness against hourglass patterns of `hex8`, as a multiple of the shear modulus at rest; above about 0.5 it stiffens bending. One for the whole body or for each cell label. If not given, 0.2 of the current shear modulus of each element, which is at least the one at rest. Takes a number or a table of numbers, at least 0 and at most 10.
    velocity
        Velocity [m/s] at the start, of all nodes that no constraint holds or moves; not for quasi-static runs. Takes 3 numbers.
    initial_displacement
        Displacement [m] of each node from rest at the start. The mesh is the shape at rest. For shells, whose nodes turn with the triangles around them, and for solids with the solvers `implicit` and `static`. Takes { point-data = … } or { csv = … }.
    fibre
        Fibre direction at rest; overrides the direction of the law. For a shell, the direction from which the angles of its `layers` count. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    second_fibre
        Direction of the second family of fibres at rest; overrides the direction of the law. Takes 3 numbers, { cell-data = … }, { along = … }, { toward = … }, { around = … }, { tangential = … } or { laplace = … }.
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"model": "model", "mesh": "mesh", "on": "on", "faces": "faces", "rotations": "rotations", "element": "element", "law": "law", "density": "density", "thickness": "thickness", "layers": "layers", "pre_tension": "pre-tension", "normals": "normals", "crease": "crease", "branches": "branches", "fraction": "fraction", "area": "area", "slack": "slack", "tension_only": "tension-only", "damping": "damping", "stiffness_damping": "stiffness-damping", "hourglass": "hourglass", "velocity": "velocity", "initial_displacement": "initial-displacement", "fibre": "fibre", "second_fibre": "second-fibre"}

    density: Any
    model: str | None = None
    mesh: Mesh | Mapping[str, Any] | None = None
    on: str | None = None
    faces: Any | None = None
    rotations: Any | None = None
    element: str | None = None
    law: Any | None = None
    thickness: Any | None = None
    layers: Any | None = None
    pre_tension: float | None = None
    normals: Any | None = None
    crease: float | None = None
    branches: bool | None = None
    fraction: str | None = None
    area: float | None = None
    slack: float | None = None
    tension_only: bool | None = None
    damping: float | None = None
    stiffness_damping: float | None = None
    hourglass: Any | None = None
    velocity: Sequence[float] | None = None
    initial_displacement: Any | None = None
    fibre: Any | None = None
    second_fibre: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Tie(Table):
    """`[tie.NAME]`. Ties the nodes of one body to another body, whose mesh need not match. The tied nodes follow nodes of the other body, which take their forces and masses. For vessels inside an organ, walls on a surface, parts that are glued. Bodies of two participants are tied by springs, as stiff as their steps allow.

    Parameters
    ----------
    between
        The body whose nodes follow, and the body that they follow: `between = ["vessels", "liver"]`. With `points`, take the finer or the softer one first. Takes 2 texts.
    method
        Method by which nodes follow. If not given, `mortar` where faces of one solid lie on faces of another solid. Elsewhere `points`: for walls, bars, a solid inside another one, and gaps wider than the default `tolerance`. Takes "mortar" or "points".
    nodes
        The nodes of the first body that follow; if not given, all inside or on the second. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    tolerance
        Largest distance of a tied node from the second body [m]; if not given, a tenth of its median edge. Takes a number, at least 0.
    rotations
        Behaviour of the rotations of tied nodes of a shell, with the solvers `implicit` and `static`. Takes "free" or "follow"; "free" if not given.
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"between": "between", "method": "method", "nodes": "nodes", "tolerance": "tolerance", "rotations": "rotations"}

    between: Any
    method: Any | None = None
    nodes: Any | None = None
    tolerance: float | None = None
    rotations: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Surface(Table):
    """`[surface.NAME]`. A finer surface carried by a body.

    Parameters
    ----------
    on
        The body that carries it. Takes a text.
    mesh
        The surface: triangles or quads of a file, or the boundary of a built-in shape or an image. With `as = "surface"`, the smooth surface of an image. Takes a table.
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"on": "on", "mesh": "mesh"}

    on: str
    mesh: Mesh | Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Fix(Table):
    """`[constraint.NAME]` with ``type = "fix"``. Nodes held where they are.

    Parameters
    ----------
    body
        The body. Takes a text.
    nodes
        Selected nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    components
        Components held; if not given, all: of shells also the rotations, which clamps them. Takes an array of texts ("x", "y", "z", "rx", "ry" or "rz").
    """

    _type: ClassVar[str | None] = "fix"
    _keys: ClassVar[dict[str, str]] = {"body": "body", "nodes": "nodes", "components": "components"}

    body: str
    nodes: Any
    components: Any | None = None


@dataclass(frozen=True, kw_only=True)
class Move(Table):
    """`[constraint.NAME]` with ``type = "move"``. Nodes moved as prescribed: exactly one of `by`, `velocity` and `rotate`; of shells `by`, `turn` or both. Curve: `smooth-step` if not given.

    Parameters
    ----------
    body
        The body. Takes a text.
    nodes
        Selected nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    by
        Displacement [m], reached along the curve: one for all nodes, or one for each node from a file. Takes 3 numbers, { point-data = … } or { csv = … }.
    velocity
        Velocity [m/s], multiplied by the curve. Takes 3 numbers.
    turn
        Rotation of nodes of shells about their own places [rad]: about the axis of this vector by its length, reached along the curve. Takes 3 numbers.
    rotate
        Rotation of nodes of a solid about an axis, reached along the curve; each node stays on its circle all the way. Takes { axis = …, centre = … }.
    components
        Components prescribed; if not given, all three of the displacement, and with `turn` the rotations. A rotation takes all three. Takes an array of texts ("x", "y", "z", "rx", "ry" or "rz").
    force_limit
        Largest force [N] with which they push, measured by their reaction. From half of this force on they give way together, and lag behind their motion. When the obstacle is gone, they catch up. With the solvers `implicit` and `static`. Takes a number, greater than 0.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "move"
    _keys: ClassVar[dict[str, str]] = {"body": "body", "nodes": "nodes", "by": "by", "velocity": "velocity", "turn": "turn", "rotate": "rotate", "components": "components", "force_limit": "force-limit", "curve": "curve", "from_": "from", "to": "to"}

    body: str
    nodes: Any
    by: Any | None = None
    velocity: Sequence[float] | None = None
    turn: Sequence[float] | None = None
    rotate: Any | None = None
    components: Any | None = None
    force_limit: float | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Spring(Table):
    """`[constraint.NAME]` with ``type = "spring"``. Springs without rest length that pull nodes to points: of shells, and of solids with the solvers `implicit` and `static`.

    Parameters
    ----------
    body
        The body. Takes a text.
    nodes
        Selected nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    stiffness
        Stiffness of the spring of each node [N/m]. Takes a number, greater than 0.
    to
        The point they are pulled to [m]; if not given, each node to its own place at rest. Takes 3 numbers.
    """

    _type: ClassVar[str | None] = "spring"
    _keys: ClassVar[dict[str, str]] = {"body": "body", "nodes": "nodes", "stiffness": "stiffness", "to": "to"}

    body: str
    nodes: Any
    stiffness: float
    to: Sequence[float] | None = None


@dataclass(frozen=True, kw_only=True)
class Mean(Table):
    """`[constraint.NAME]` with ``type = "mean"``. Nodes whose mean displacement is prescribed, while each node is free: a face under a plate that tilts. If the nodes have whole faces, the mean is weighted by the area of the boundary at each node; otherwise all nodes count equally. The reaction is the force of the plate. With every solver on the CPU except explicit shells.

    Parameters
    ----------
    body
        The body. Takes a text.
    nodes
        Selected nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    by
        Mean displacement [m], reached along the curve. Takes 3 numbers.
    components
        Components that are prescribed; if not given, all three. Takes an array of texts ("x", "y", "z", "rx", "ry" or "rz").
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "mean"
    _keys: ClassVar[dict[str, str]] = {"body": "body", "nodes": "nodes", "by": "by", "components": "components", "curve": "curve", "from_": "from", "to": "to"}

    body: str
    nodes: Any
    by: Sequence[float]
    components: Any | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Rigid(Table):
    """`[constraint.NAME]` with ``type = "rigid"``. A rigid part of a body, such as bone or an implant: its nodes keep their distances, and move and turn together, free in space. The rotations of shell nodes turn with the part. With every solver on the CPU except explicit shells.

    Parameters
    ----------
    body
        The body. Takes a text.
    nodes
        Selected nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    """

    _type: ClassVar[str | None] = "rigid"
    _keys: ClassVar[dict[str, str]] = {"body": "body", "nodes": "nodes"}

    body: str
    nodes: Any


@dataclass(frozen=True, kw_only=True)
class Volume(Table):
    """`[constraint.NAME]` with ``type = "volume"``. A closed surface whose volume is prescribed by a uniform pressure within, however large: a balloon, an eye, a full bladder. Columns `volume.NAME` [m³] and `pressure.NAME` [Pa] of tables record both. With every solver on the CPU except explicit shells.

    Parameters
    ----------
    body
        The body, a solid, a membrane or a shell. Takes a text.
    faces
        Faces of the surface; if not given, the whole boundary. They have to be closed, and may be the faces of a cavity. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    by
        Growth of the enclosed volume from rest [m³], along the curve; 0 keeps the volume, less than 0 empties it. Takes a number.
    pressure_limit
        Largest pressure or suction [Pa]. At this pressure the volume lags behind its curve; when less is needed, it catches up. With the solvers `implicit` and `static`. Takes a number, greater than 0.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "volume"
    _keys: ClassVar[dict[str, str]] = {"body": "body", "faces": "faces", "by": "by", "pressure_limit": "pressure-limit", "curve": "curve", "from_": "from", "to": "to"}

    body: str
    by: float
    faces: Any | None = None
    pressure_limit: float | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Force(Table):
    """`[load.NAME]` with ``type = "force"``. Forces on nodes: exactly one of `each` and `total`. Curve: `smooth-step` if not given.

    Parameters
    ----------
    on
        The body or the carried surface. Takes a text.
    nodes
        Selected nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    each
        Force on each node [N]: the same for all, or one for each node of a body from a file. Takes 3 numbers, { point-data = … } or { csv = … }.
    total
        Force [N] shared equally among the nodes. Takes 3 numbers.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "force"
    _keys: ClassVar[dict[str, str]] = {"on": "on", "nodes": "nodes", "each": "each", "total": "total", "curve": "curve", "from_": "from", "to": "to"}

    on: str
    nodes: Any
    each: Any | None = None
    total: Sequence[float] | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Moment(Table):
    """`[load.NAME]` with ``type = "moment"``. Moments on nodes of shells, about axes that stay in space: exactly one of `each` and `total`. Curve: `smooth-step` if not given.

    Parameters
    ----------
    on
        The body. Takes a text.
    nodes
        Selected nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    each
        Moment on each node [N m]. Takes 3 numbers.
    total
        Moment [N m] shared equally among the nodes. Takes 3 numbers.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "moment"
    _keys: ClassVar[dict[str, str]] = {"on": "on", "nodes": "nodes", "each": "each", "total": "total", "curve": "curve", "from_": "from", "to": "to"}

    on: str
    nodes: Any
    each: Sequence[float] | None = None
    total: Sequence[float] | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Edge(Table):
    """`[load.NAME]` with ``type = "edge"``. A force per length on edges of shells that only one triangle has and whose ends are both selected. Curve: `smooth-step` if not given.

    Parameters
    ----------
    on
        The body. Takes a text.
    nodes
        Selected nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    traction
        Force per length at rest [N/m]; its direction stays. Takes 3 numbers.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "edge"
    _keys: ClassVar[dict[str, str]] = {"on": "on", "nodes": "nodes", "traction": "traction", "curve": "curve", "from_": "from", "to": "to"}

    on: str
    nodes: Any
    traction: Sequence[float]
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Traction(Table):
    """`[load.NAME]` with ``type = "traction"``. A force per reference area on faces. Curve: `smooth-step` if not given.

    Parameters
    ----------
    on
        The body or the carried surface. Takes a text.
    faces
        Faces whose nodes are all selected. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    traction
        Force per area at rest [Pa]; its direction stays. Takes 3 numbers.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "traction"
    _keys: ClassVar[dict[str, str]] = {"on": "on", "faces": "faces", "traction": "traction", "curve": "curve", "from_": "from", "to": "to"}

    on: str
    faces: Any
    traction: Sequence[float]
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Pressure(Table):
    """`[load.NAME]` with ``type = "pressure"``. Pressure on faces, which follows the faces as they deform. Curve: `smooth-step` if not given.

    Parameters
    ----------
    on
        The body or the carried surface. Takes a text.
    faces
        Faces whose nodes are all selected. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    pressure
        Pressure [Pa]; positive pushes a solid inwards, and a shell to the side that its triangles face. A closed shell that faces outwards is blown up. Takes a number.
    spread
        Distribution of the pressure to the nodes of a shell. If not given, `curved` with `dkt-curved` and `lumped` with other elements. Other pairs are not possible. Takes "lumped" or "curved".
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "pressure"
    _keys: ClassVar[dict[str, str]] = {"on": "on", "faces": "faces", "pressure": "pressure", "spread": "spread", "curve": "curve", "from_": "from", "to": "to"}

    on: str
    faces: Any
    pressure: float
    spread: Any | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Gravity(Table):
    """`[load.NAME]` with ``type = "gravity"``. An acceleration, in addition to `gravity` of `[scene]`. Curve: `smooth-step` if not given.

    Parameters
    ----------
    on
        The body; if not given, all. Takes a text.
    nodes
        Nodes of the body; if not given, all nodes. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    acceleration
        Acceleration [m/s²]. Takes 3 numbers.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = "gravity"
    _keys: ClassVar[dict[str, str]] = {"on": "on", "nodes": "nodes", "acceleration": "acceleration", "curve": "curve", "from_": "from", "to": "to"}

    acceleration: Sequence[float]
    on: str | None = None
    nodes: Any | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Obstacle(Table):
    """`[obstacle.NAME]`. A rigid thing that bodies touch: an obstacle such as a bone, or a tool. `at` and `turn` set its pose; it moves by one of `by`, `rotate` and `poses`, or not at all. Curve: `smooth-step` if not given. `[contact.NAME]` names the bodies that touch it.

    Parameters
    ----------
    shape
        Its shape, around the origin of its own frame. Takes { sphere = … }, { capsule = … }, { cylinder = … }, { box = … }, { cone = … }, "half-space", { revolved = … }, { jaws = … }, { mesh = … } or { image = … }.
    at
        Position of the origin of its frame [m]. Takes 3 numbers; [0.0,0.0,0.0] if not given.
    turn
        Rotation of its frame [rad]: about the axis of this vector, by its length. Takes 3 numbers; [0.0,0.0,0.0] if not given.
    inside
        True if bodies are inside, as a brain in its skull. Takes true or false; false if not given.
    opening
        Opening of the jaws over time, for a tool with jaws; closed if not given. Takes a table.
    ideal_grip
        The angle [rad] between jaws at or below which they hold everything that touches their inner faces, as if tied. They let go when they open wider. If not given, they hold by the contact's friction. Takes a number, at least 0.
    force_limit
        Largest force [N] with which it pushes. From half of this force on it gives way, and lags behind its trajectory. When the obstacle is gone, it catches up. Takes a number, greater than 0.
    grows
        Growth over time. Takes { by = … }.
    by
        Displacement [m], reached along the curve. Takes 3 numbers.
    rotate
        Rotation about an axis, reached along the curve. Takes { axis = …, centre = … }.
    poses
        A CSV file of poses. A row for each time [s] has a position [m] and a unit quaternion, in columns t, x, y, z, qw, qx, qy, qz. Between rows it moves on straight lines and shortest arcs; before the first and after the last row it rests. Takes a text.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"shape": "shape", "at": "at", "turn": "turn", "inside": "inside", "opening": "opening", "ideal_grip": "ideal-grip", "force_limit": "force-limit", "grows": "grows", "by": "by", "rotate": "rotate", "poses": "poses", "curve": "curve", "from_": "from", "to": "to"}

    shape: Any
    at: Sequence[float] | None = None
    turn: Sequence[float] | None = None
    inside: bool | None = None
    opening: Any | None = None
    ideal_grip: float | None = None
    force_limit: float | None = None
    grows: Any | None = None
    by: Sequence[float] | None = None
    rotate: Any | None = None
    poses: str | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Tool(Table):
    """`[tool.NAME]`. A rigid thing that bodies touch: an obstacle such as a bone, or a tool. `at` and `turn` set its pose; it moves by one of `by`, `rotate` and `poses`, or not at all. Curve: `smooth-step` if not given. `[contact.NAME]` names the bodies that touch it.

    Parameters
    ----------
    shape
        Its shape, around the origin of its own frame. Takes { sphere = … }, { capsule = … }, { cylinder = … }, { box = … }, { cone = … }, "half-space", { revolved = … }, { jaws = … }, { mesh = … } or { image = … }.
    at
        Position of the origin of its frame [m]. Takes 3 numbers; [0.0,0.0,0.0] if not given.
    turn
        Rotation of its frame [rad]: about the axis of this vector, by its length. Takes 3 numbers; [0.0,0.0,0.0] if not given.
    inside
        True if bodies are inside, as a brain in its skull. Takes true or false; false if not given.
    opening
        Opening of the jaws over time, for a tool with jaws; closed if not given. Takes a table.
    ideal_grip
        The angle [rad] between jaws at or below which they hold everything that touches their inner faces, as if tied. They let go when they open wider. If not given, they hold by the contact's friction. Takes a number, at least 0.
    force_limit
        Largest force [N] with which it pushes. From half of this force on it gives way, and lags behind its trajectory. When the obstacle is gone, it catches up. Takes a number, greater than 0.
    grows
        Growth over time. Takes { by = … }.
    by
        Displacement [m], reached along the curve. Takes 3 numbers.
    rotate
        Rotation about an axis, reached along the curve. Takes { axis = …, centre = … }.
    poses
        A CSV file of poses. A row for each time [s] has a position [m] and a unit quaternion, in columns t, x, y, z, qw, qx, qy, qz. Between rows it moves on straight lines and shortest arcs; before the first and after the last row it rests. Takes a text.
    curve
        The form of the growth. Takes "ramp", "smooth-step", "polynomial-10-15-6" or "hold", { wave = … } or { table = … }.
    from_
        Time [s] at which it starts. Takes a number, at least 0; 0.0 if not given.
    to
        Time [s] at which it is complete; if not given, the end of the scene. Takes a number.
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"shape": "shape", "at": "at", "turn": "turn", "inside": "inside", "opening": "opening", "ideal_grip": "ideal-grip", "force_limit": "force-limit", "grows": "grows", "by": "by", "rotate": "rotate", "poses": "poses", "curve": "curve", "from_": "from", "to": "to"}

    shape: Any
    at: Sequence[float] | None = None
    turn: Sequence[float] | None = None
    inside: bool | None = None
    opening: Any | None = None
    ideal_grip: float | None = None
    force_limit: float | None = None
    grows: Any | None = None
    by: Sequence[float] | None = None
    rotate: Any | None = None
    poses: str | None = None
    curve: Any | None = None
    from_: float | None = None
    to: float | None = None


@dataclass(frozen=True, kw_only=True)
class Contact(Table):
    """`[contact.NAME]`. Contact of a body with an obstacle or a tool, with another body, or with itself. With the solver `explicit`, for bodies without bending, impulses keep surfaces apart; only solids can touch each other. With the solvers `implicit` and `static`, for solids and shells, a barrier keeps surfaces apart. Only barriers exclude intersections: no accepted state has an intersection. `csv` outputs have the force on the second body as `contact.NAME`.

    Parameters
    ----------
    between
        The body, and the thing that it touches: `between = ["liver", "probe"]`. The same body twice means self-contact. `"all"`: all solids, obstacles and tools; with the solvers `implicit` and `static` also shells and membranes that are not `on` a solid. Each pair has an entry of its own, `contact.NAME.liver-probe`. Takes 2 texts.
    faces
        Faces of the first body that touch; if not given, its whole boundary. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    other_faces
        Faces of the second, if it is another body; if not given, its whole boundary. Takes "all" or "boundary", { box = … }, { sphere = … }, { half-space = … }, { plane = … }, { normal = … }, { nearest = … }, { set = … }, { label = … }, { label-boundary = … }, { ids = … }, { union = … }, { intersection = … } or { difference = … }.
    friction
        Coulomb's coefficient of friction [1]. Takes a number, at least 0; 0.0 if not given.
    thickness
        Distance [m] that the surfaces keep. If not given with the solver `explicit`, 0.5 % of the mean edge for bodies and self-contact, and 0 from a rigid thing. If not given with the solvers `implicit` and `static`, half of the thickness of each shell that takes part. Nodes of explicit bodies that are nearer at the start keep their distance. Takes a number, at least 0.
    barrier_distance
        The gap [m], in addition to `thickness`, below which surfaces push each other away. A thousandth of the diagonal of all bodies if not given. With the solvers `implicit` and `static`. Takes a number, greater than 0.
    barrier_stiffness
        Stiffness κ [Pa] of the barrier. At the gap y times its distance, its pressure is κ (2 (y − 1) ln y + (y − 1)²/y). A tenth of Young's modulus of the softest body of the contact if not given. Takes a number, greater than 0.
    subdivision
        Number of times that each triangle of a shell is divided into four on its curved surface, which touches in its place: 0 (flat triangles), 1 or 2. With the solvers `implicit` and `static`. Takes a whole number, at least 0 and at most 2.
    creep_speed
        Largest speed [m/s] at which bodies creep that friction should hold. With the solvers `implicit` and `static`; 0.001 if not given. Takes a number, greater than 0.
    check_intersections
        True to search states for edges that go through triangles, independently of the contact search. With the solvers `implicit` and `static` the search looks at each state; an intersection would be a fault of the program, and ends the run. With the solver `explicit` the search looks at the last state and the states that outputs write. It counts the intersections of bodies that are deeper than 1e-4 of the mean edge, in a warning and in `intersections` of `--json`. Holds for all contacts of the solver. Takes true or false; false if not given.
    separate
        True to push bodies that overlap at the start apart before the run, with the smallest displacements of their nodes. The shape at rest stays, so that the run starts deformed. Without this key overlapping bodies are an error. Takes true or false; false if not given.
    gap
        Gap [m] between the shapes at rest, beyond the distance that surfaces keep. Where bodies overlap or are nearer, their nodes at rest move apart by the smallest displacements, so that the run starts without stress. For organs that touch in one segmentation and are meshed one by one. Takes a number, greater than 0.
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"between": "between", "faces": "faces", "other_faces": "other-faces", "friction": "friction", "thickness": "thickness", "barrier_distance": "barrier-distance", "barrier_stiffness": "barrier-stiffness", "subdivision": "subdivision", "creep_speed": "creep-speed", "check_intersections": "check-intersections", "separate": "separate", "gap": "gap"}

    between: Any
    faces: Any | None = None
    other_faces: Any | None = None
    friction: float | None = None
    thickness: float | None = None
    barrier_distance: float | None = None
    barrier_stiffness: float | None = None
    subdivision: int | None = None
    creep_speed: float | None = None
    check_intersections: bool | None = None
    separate: bool | None = None
    gap: float | None = None


@dataclass(frozen=True, kw_only=True)
class Vtu(Table):
    """`[output.NAME]` with ``type = "vtu"``. A series of VTU files for ParaView, with its `.pvd`.

    Parameters
    ----------
    on
        The body or the carried surface, which has fields of cells as means at its points; if not given, all bodies together. Takes a text.
    every
        Time between frames [s]; the first and the last instant are always written. Takes a number, greater than 0.
    data
        The fields. Tensors have nine components xx, xy, xz, yx, yy, yz, zx, zy, zz in this order; `[view]` colours by one of them with `component`, and probes of a `csv` output write each into a column. Takes an array of texts ("displacement", "velocity", "rotation", "reaction", "reaction-moment", "deformation-gradient", "cauchy-stress", "pk2-stress", "von-mises", "green-strain", "fibre", "fibre-stretch", "pressure", "J", "cell-J", "energy-density", "element-step", "membrane-force", "bending-moment", "stress-top", "stress-middle", "stress-bottom", "membrane-energy", "bending-energy", "drilling-energy", "thickness", "current-thickness", "axial-stretch", "axial-force", "surface-strain", "contact-force", "contact-pressure", "gap", "slip", "constraint", "load" or "weight"); ["displacement","von-mises"] if not given.
    at
        Place at which fields of cells are written. Takes "cells" or "points"; "cells" if not given.
    curved
        Parts that each edge of a shell is cut into, to show its curved surface instead of flat triangles. Takes a whole number, at least 1 and at most 100.
    """

    _type: ClassVar[str | None] = "vtu"
    _keys: ClassVar[dict[str, str]] = {"on": "on", "every": "every", "data": "data", "at": "at", "curved": "curved"}

    every: float
    on: str | None = None
    data: Any | None = None
    at: Any | None = None
    curved: int | None = None


@dataclass(frozen=True, kw_only=True)
class Csv(Table):
    """`[output.NAME]` with ``type = "csv"``. A table over time: reactions, energies, probes.

    Parameters
    ----------
    every
        Time between rows [s]; the first and the last instant are always written. Takes a number, greater than 0.
    reactions
        Constraints whose reaction [N] is written; if not given, all. Columns `reaction.NAME.x`, `.y`, `.z`: the sum of the forces by which the constraint holds or moves its nodes. Takes an array of texts.
    moments_about
        A point [m], fixed in space, about which the moments of these reactions are written [N m], in columns `moment.NAME.x`, `.y`, `.z`. A moment is the sum of (place − point) × force over the nodes at their current places. For shells the moments on the nodes are added. Takes 3 numbers.
    energy
        True to write energies [J]. Takes true or false; true if not given.
    probes
        Points of bodies or surfaces whose fields are written. Takes a table of tables.
    """

    _type: ClassVar[str | None] = "csv"
    _keys: ClassVar[dict[str, str]] = {"every": "every", "reactions": "reactions", "moments_about": "moments-about", "energy": "energy", "probes": "probes"}

    every: float
    reactions: Sequence[str] | None = None
    moments_about: Sequence[float] | None = None
    energy: bool | None = None
    probes: Any | None = None


@dataclass(frozen=True, kw_only=True)
class View(Table):
    """`[view]`. View for pictures and films of the scene (`pliant render`, `pliant run --picture`) and for the window at the start (`pliant view`). It does not change the run.

    Parameters
    ----------
    on
        The body or the carried surface that is shown; if not given, all bodies together. Takes a text.
    colour
        Quantity that the colours show; `label`: the labels of the elements, each in a colour of its own; `none`: the colour of tissue. If not given, `von-mises`, and `displacement` on surfaces that shells carry. Takes one of "none", "label", "displacement", "velocity", "rotation", "reaction", "reaction-moment", "deformation-gradient", "cauchy-stress", "pk2-stress", "von-mises", "green-strain", "fibre", "fibre-stretch", "pressure", "J", "cell-J", "energy-density", "element-step", "membrane-force", "bending-moment", "stress-top", "stress-middle", "stress-bottom", "membrane-energy", "bending-energy", "drilling-energy", "thickness", "current-thickness", "axial-stretch", "axial-force", "surface-strain", "contact-force", "contact-pressure", "gap", "slip", "constraint", "load", "weight".
    hide
        Parts to hide, so that parts inside or behind are seen, as `[2, "tumour", "5-8", "grasper"]`. Labels of elements are given by number, name or range, and bodies, obstacles and tools by name. A name that a label and a body share means the label. Takes an array of whole numbers or texts; [] if not given.
    look
        Parts that look different from the rest, by names as in `hide`: `look.liver = { opacity = 0.3, colour = "liver" }`. The opacity goes from 0 to 1; the colour is `view` (as the rest), `label`, `tissue`, `liver`, `brain`, `colon`, `artery`, `vein`, `tumour`, `bone` or `steel`. Takes a table of tables; {} if not given.
    component
        A component of a vector (`x`, `y`, `z`) or a tensor (`xx`, `xy`, …), instead of the size of a vector; a tensor needs one. Takes one of "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz".
    map
        The map of colours; all but `turbo` look even to eyes that see no red or green. Takes one of "viridis", "cividis", "magma", "inferno", "plasma", "turbo", "blue-red"; "viridis" if not given.
    range
        Values of the first and the last colour, in SI units; if not given, from the values of all frames without the outermost 0.5 %. Takes 2 numbers.
    edges
        True to draw the edges of the elements. Takes true or false; false if not given.
    wireframe
        True to draw only the edges of the elements on the surface. Takes true or false; false if not given.
    ghost
        True to draw the shape at rest, as a ghost. Takes true or false; false if not given.
    fibres
        True to draw fibres on the surface and in a section, as short lines that follow the deformation. Takes true or false; false if not given.
    contacts
        True to draw the forces of contacts, through the bodies: a dot at each node in contact, and an arrow along the force on it. The note shows the force of the longest arrow. Takes true or false; false if not given.
    marks
        True to mark constraints and loads, through the bodies. Squares mark held nodes, dots moved nodes, and bars nodes under plates. Arrows point along the forces of loads, and one along the weight of all. At most 300 of each kind are drawn. Takes true or false; false if not given.
    critical
        True to mark the element with the smallest `element-step`, through the body. Shells are then shown flat. Takes true or false; false if not given.
    mark_maximum
        True to mark the largest value that the colours show, by a ring at its place and the number. The ring is dashed if something hides the place. Takes true or false; true if not given.
    occlusion
        True to darken folds and contacts, where less light from all sides arrives. Takes true or false; true if not given.
    texture
        Texture of the surface. It is fixed in the body at rest, and moves with the body. Takes "none" or "skin"; "none" if not given.
    clip
        A cutting plane: everything on the side of its normal is taken away, so that the inside is seen. Takes { point = …, normal = … }.
    at
        The instant of a single picture [s]; if not given, the end of the run. Takes a number, greater than 0.
    camera
        Camera of the view. Takes a table.
    background
        Background of the picture. Takes one of "light", "white", "dark"; "light" if not given.
    size
        Width and height of pictures [pixels]. Takes 2 whole numbers; [1280,800] if not given.
    curved
        Parts that each edge of a shell is cut into, to show its curved surface; 1: flat triangles. Takes a whole number, at least 1 and at most 100; 4 if not given.
    """

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {"on": "on", "colour": "colour", "hide": "hide", "look": "look", "component": "component", "map": "map", "range": "range", "edges": "edges", "wireframe": "wireframe", "ghost": "ghost", "fibres": "fibres", "contacts": "contacts", "marks": "marks", "critical": "critical", "mark_maximum": "mark-maximum", "occlusion": "occlusion", "texture": "texture", "clip": "clip", "at": "at", "camera": "camera", "background": "background", "size": "size", "curved": "curved"}

    on: str | None = None
    colour: str | None = None
    hide: Any | None = None
    look: Any | None = None
    component: str | None = None
    map: str | None = None
    range: Sequence[float] | None = None
    edges: bool | None = None
    wireframe: bool | None = None
    ghost: bool | None = None
    fibres: bool | None = None
    contacts: bool | None = None
    marks: bool | None = None
    critical: bool | None = None
    mark_maximum: bool | None = None
    occlusion: bool | None = None
    texture: Any | None = None
    clip: Any | None = None
    at: float | None = None
    camera: Any | None = None
    background: str | None = None
    size: Any | None = None
    curved: int | None = None


__all__ = [
    "ArrudaBoyce",
    "Body",
    "Contact",
    "Corotational",
    "CoupledNeoHookean",
    "Csv",
    "Demiray",
    "Edge",
    "Fix",
    "Force",
    "FungOrthotropic",
    "Gent",
    "Gravity",
    "HolzapfelGasserOgden",
    "LogarithmicNeoHookean",
    "Mean",
    "Moment",
    "MooneyRivlin",
    "Move",
    "NeoHookean",
    "Obstacle",
    "Ogden",
    "Orthotropic",
    "Participant",
    "Polynomial",
    "Pressure",
    "Rigid",
    "Run",
    "Spring",
    "StVenantKirchhoff",
    "Surface",
    "Table",
    "Tie",
    "Tool",
    "Traction",
    "TransverselyIsotropic",
    "VerondaWestmann",
    "View",
    "Volume",
    "Vtu",
    "Yeoh",
]
