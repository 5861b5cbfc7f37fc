"""A scene as text and as data: check it, save it, run it with files."""

import tempfile

import numpy as np

import pliant

TEXT = """
[scene]
until = 0.05
gravity = [0, 0, -9.81]
[law.tissue]
type = "neo-hookean"
young-modulus = 3e3
poisson-ratio = 0.45
[body.block]
mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.05 }
law = "tissue"
density = 1000
[constraint.base]
type = "fix"
body = "block"
nodes = { set = "z-min" }
"""


def main() -> pliant.Result:
    """The result of a run with a table of energies."""
    scene = pliant.Scene.from_toml(TEXT)
    print([str(warning) for warning in scene.check()])
    scene.run_table["precision"] = "double"
    scene.output["history"] = {"type": "csv", "every": 0.005}
    print(sorted(scene.tie), sorted(scene.obstacle), sorted(scene.participant))
    try:
        scene.replace({"body.block.density": -1.0}).check()
    except pliant.SceneError as error:
        mistake: pliant.Diagnostic = error.diagnostics[0]
        print(mistake.key, mistake.message)
    with tempfile.TemporaryDirectory() as folder:
        scene.save(f"{folder}/scene.toml")
        model = pliant.load(folder).build()
        print(model.constraints, model.limit, model.notes, model.device)  # critical time step [s]

        def report(progress: pliant.Progress) -> None:
            print(f"{progress.time:.3f} of {progress.until} s after {progress.wall:.1f} s")

        return model.run(f"{folder}/out", each=report)


def picture(sim: pliant.Simulation, path: str) -> np.ndarray:
    """The pixels of a picture that is also saved."""
    drawn = sim.picture()
    drawn.save(path)
    return drawn.to_numpy()


if __name__ == "__main__":
    main()
