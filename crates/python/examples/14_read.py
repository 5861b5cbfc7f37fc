"""Read a simulation: energies, samples, jaws of a tool, what a wall encloses; keep its state in a file."""

import os
import tempfile

import pliant


def main(scene: str = "scenes/retraction") -> float:
    """The angle [rad] between the jaws of a grasper that closes."""
    sim = pliant.load(scene).build().simulate()
    grasper = sim.model.tools[0]
    begin = sim.tool(grasper).opening
    sim.open(grasper, 0.8 * begin, within=0.02)
    sim.step(50)
    tool: pliant.Tool = sim.tool(grasper)
    print(tool.opening, tool.torque)
    energies: pliant.Energies = sim.energies  # J
    print(energies.kinetic, energies.internal, energies.damping, energies.external, energies.hourglass, energies.balance)
    print(sim.sample(), sim.ended, sim.device)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "state")
        sim.state().save(path)
        sim.restore(pliant.State.load(path))
    return tool.opening / begin


def balloon() -> tuple[float, float]:
    """Volume [m³] and pressure [Pa] of a balloon that is filled with 40 ml."""
    scene = pliant.Scene(until=1.0)
    scene.law["rubber"] = {"type": "neo-hookean", "young-modulus": 1e6, "poisson-ratio": 0.49}
    sphere = pliant.Mesh.sphere(0.03, edge=0.012)  # m
    scene.body["balloon"] = {"model": "membrane", "mesh": sphere, "law": "rubber", "thickness": 0.001, "density": 1000.0}
    scene.constraint["neck"] = {"type": "fix", "body": "balloon", "nodes": {"nearest": {"point": [0, 0, -0.03], "count": 7}}}
    scene.constraint["air"] = {"type": "volume", "body": "balloon", "by": 4e-5}
    scene.run_table.update({"solver": "quasi-static", "load-steps": 4})
    sim = scene.build().simulate()
    sim.run()
    return sim.enclosed("air")


if __name__ == "__main__":
    main()
