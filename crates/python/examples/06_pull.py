"""Pull with a hand and read the force."""

import numpy as np

import pliant


def main() -> np.ndarray:
    """Forces [N] while a block of soft tissue is pulled by 1 cm."""
    sim = pliant.Scene.of_mesh(pliant.Mesh.block([0.12, 0.05, 0.05], edge=0.0125)).build().simulate()
    hand, forces = sim.grip(at=(0.12, 0.025, 0.05), stiffness=200.0), []  # N/m, the surface around this place
    for place in np.linspace(hand.point, hand.point + (0, 0, 0.01), 50):
        hand.place = place
        sim.step(20)
        forces.append(np.linalg.norm(hand.force))  # N
    print(f"{forces[-1]:.3f} N")
    return np.array(forces)


if __name__ == "__main__":
    main()
