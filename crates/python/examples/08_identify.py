"""Identify a modulus from a measured force, with scipy; runs go side by side."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.optimize import least_squares

import pliant


def scene() -> pliant.Scene:
    """A block that is pulled by 5 mm."""
    scene = pliant.Scene(until=0.2)
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 3e3, "poisson-ratio": 0.45}
    mesh = {"block": {"size": [0.05, 0.05, 0.1]}, "edge": 0.025}
    scene.body["block"] = {"mesh": mesh, "element": "tet4-anp", "law": "tissue", "density": 1000.0, "damping": 50.0}
    scene.constraint["base"] = {"type": "fix", "body": "block", "nodes": {"set": "z-min"}}
    hand = {"type": "move", "body": "block", "nodes": {"set": "z-max"}, "by": [0, 0, 0.005], "curve": "smooth-step", "to": 0.15}
    scene.constraint["hand"] = hand
    return scene


def main(truth: float = 4.2e3) -> float:
    """The modulus [Pa] that was found from a force curve of `truth`."""
    measured = scene().replace({"law.tissue.young-modulus": truth}).build().run(threads=1).history
    measured_t, measured_f = measured["time"], measured["reaction.hand.z"]
    model = scene().build()

    def misfit(x: np.ndarray) -> np.ndarray:
        changed = scene().replace({"law.tissue.young-modulus": float(x[0])}).build(like=model)
        history = changed.run(threads=1).history
        return np.interp(measured_t, history["time"], history["reaction.hand.z"]) - measured_f

    with ThreadPoolExecutor(2) as pool:
        fit = least_squares(misfit, [3e3], x_scale=[1e3], diff_step=1e-3, xtol=1e-8, workers=pool.map)
    print(f"{fit.x[0]:.1f} Pa, {truth} Pa were measured")
    return float(fit.x[0])


if __name__ == "__main__":
    main()
