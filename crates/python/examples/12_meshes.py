"""Meshes: shapes, cells in a surface, fewer triangles, curved shells, and other packages."""

import numpy as np

import pliant
from pliant import Mesh


def main() -> dict[str, int]:
    """How many cells each of them has."""
    sphere = Mesh.sphere(0.03, edge=0.006)  # m
    kidney = Mesh(sphere.points * (1.0, 1.6, 0.7), sphere.cells)
    found = {
        "tube": Mesh.tube(inner_radius=0.008, outer_radius=0.01, length=0.05, edge=0.003),
        "cylinder": Mesh.cylinder(0.01, 0.05, edge=0.004),
        "plate": Mesh.plate([0.1, 0.05], edge=0.01),
        "tets in a surface": kidney.of_surface(0.008),
        "fewer triangles": kidney.decimate(400),
        "curved shells": kidney.shells(60),
    }
    halves = (kidney.points[:, 0] > 0).astype(float)
    marked = Mesh(kidney.points, kidney.cells, point_data={"half": halves}, cell_data={"area": np.ones(len(kidney.cells["triangle"]))})
    print(marked.point_data["half"].mean(), marked.cell_data["area"].sum())
    counts = {name: sum(len(corners) for corners in mesh.cells.values()) for name, mesh in found.items()}
    for name, count in counts.items():
        print(f"{count:6} cells: {name}")
    print(pliant.__version__, pliant.devices())
    return counts


def other_packages(mesh: Mesh) -> Mesh:
    """There and back by meshio and PyVista, both of which are to be installed: ``pip install 'pliant[mesh]'``."""
    there = Mesh.from_meshio(mesh.to_meshio())
    return Mesh.from_pyvista(there.to_pyvista())


if __name__ == "__main__":
    main()
