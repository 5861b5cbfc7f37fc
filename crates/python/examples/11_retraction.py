"""Tissue retraction as an environment of gymnasium: a hand lifts a flap of tissue to a height."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

import pliant


class Retraction(gymnasium.Env[np.ndarray, np.ndarray]):
    """The action moves the hand by up to 1 mm along x, y and z; what is seen is where it is, the lifted point, and its force."""

    def __init__(self) -> None:
        scene = pliant.Scene.of_mesh(pliant.Mesh.block([0.08, 0.04, 0.01], edge=0.01))
        self._sim = scene.build().simulate()
        self._start = self._sim.state()
        self._hand: pliant.Grip | None = None
        self._steps = 0
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (3,), np.float32)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (9,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Back to rest, with the hand at the free end."""
        super().reset(seed=seed)
        if self._hand is not None:
            self._hand.release()
        self._sim.restore(self._start)
        self._hand = self._sim.grip(at=(0.08, 0.02, 0.01), stiffness=200.0)
        self._home, self._steps = self._hand.point, 0
        return self._seen(), {}

    def _seen(self) -> np.ndarray:
        assert self._hand is not None
        return np.concatenate([self._hand.place, self._hand.point, self._hand.force]).astype(np.float32)

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """A fiftieth of a second."""
        assert self._hand is not None
        self._hand.place = self._hand.place + 1e-3 * np.clip(action, -1.0, 1.0)
        self._sim.step(max(1, round(0.02 / self._sim.step_size)))
        self._steps += 1
        height = float(self._hand.point[2] - self._home[2])
        effort = float(np.linalg.norm(self._hand.force))
        return self._seen(), 100.0 * min(height, 0.01) - 0.1 * effort, height > 0.01, self._steps >= 50, {"height": height}


def main() -> float:
    """Lifts straight up; the height [m] that was reached."""
    env, height = Retraction(), 0.0
    env.reset(seed=0)
    for _ in range(50):
        _, _, done, cut, info = env.step(np.array([0.0, 0.0, 1.0], dtype=np.float32))
        height = info["height"]
        if done or cut:
            break
    print(f"lifted by {1e3 * height:.1f} mm")
    return height


if __name__ == "__main__":
    main()
