"""A picture in a notebook, without a screen."""

import sys

import pliant


def main(scene: str = "scenes/stretched-cube") -> pliant.Picture:
    """A picture of a scene after some steps: in a notebook it shows itself."""
    sim = pliant.load(scene).build().simulate()
    sim.run(until=0.1 * sim.model.scene.until)
    picture = sim.picture(field="von-mises", size=(640, 480))
    print(picture)
    return picture


if __name__ == "__main__":
    main(*sys.argv[1:2])
