"""Every kind of file that is written, read by the packages that others read it with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pliant
from conftest import cube
from pliant import Image, Mesh

meshio, pyvista, trimesh = pytest.importorskip("meshio"), pytest.importorskip("pyvista"), pytest.importorskip("trimesh")


def run_pliant(*words: object) -> None:
    """Calls the command line."""
    assert pliant._native.main(["pliant", *map(str, words)]) == 0


def labelled() -> Image:
    """A ball of label 2 with a core of label 5, in voxels of 2 mm."""
    i, j, k = np.mgrid[0:20, 0:18, 0:22]
    square = (i - 9.5) ** 2 + (j - 8.5) ** 2 + (k - 10.5) ** 2
    values = np.where(square < 9, 5, np.where(square < 64, 2, 0))
    return Image(values.astype(np.uint8), np.diag([2e-3, 2e-3, 2e-3, 1.0]))


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Meshes of an image by the command line, in all formats."""
    folder = tmp_path_factory.mktemp("meshes")
    labelled().write(folder / "ball.nii")
    (folder / "names.txt").write_text("2 liver\n5 left tumour\n")
    image = [folder / "ball.nii", "--names", folder / "names.txt"]
    for file in ("tets.vtu", "tets.msh"):
        run_pliant("mesh", *image, "--label", "2", "--label", "5", "--edge", "6mm", "-o", folder / file)
    run_pliant("mesh", *image, "--label", "2-5", "--as", "hexes", "--edge", "4mm", "-o", folder / "hexes.vtu")
    for ending in ("vtu", "msh", "stl", "ply", "obj"):
        run_pliant("mesh", *image, "--label", "2", "--as", "surface", "--edge", "6mm", "-o", folder / f"surface.{ending}")
    return folder


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory, meshes: Path) -> Path:
    """Series of a run of solids with labels, of a shell and of a grasper, compressed and with tables."""
    scene = cube()
    scene.body["ball"] = {"mesh": {"file": str(meshes / "tets.vtu"), "at": [0.5, 0, 0]}, "law": "tissue", "density": 1000.0}
    sheet = {"plate": {"size": [0.1, 0.1]}, "edge": 0.05, "at": [0, 0.5, 0]}
    scene.body["sheet"] = {"mesh": sheet, "model": "shell", "law": "skin", "thickness": 1e-3, "density": 1000.0, "damping": 5.0}
    scene.law["skin"] = {"type": "st-venant-kirchhoff", "young-modulus": 1e5, "poisson-ratio": 0.3}
    scene.tool["probe"] = {"shape": {"sphere": {"radius": 0.01}}, "at": [0.05, 0.05, 0.2]}
    scene.contact["touch"] = {"between": ["cube", "probe"]}
    scene.output["all"] = {"type": "vtu", "every": 0.005}
    scene.output["cells"] = {"type": "vtu", "on": "ball", "every": 0.005, "data": ["von-mises", "displacement"], "at": "cells"}
    scene.output["curved"] = {"type": "vtu", "on": "sheet", "every": 0.005, "curved": 2}
    folder: Path = tmp_path_factory.mktemp("run") / "out"
    scene.run(folder, until=0.01)
    return folder


def test_frames_of_runs(outputs: Path) -> None:
    frames = sorted(outputs.glob("*/*.vtu"))
    assert {frame.parent.name for frame in frames} == {"all", "cells", "curved"}
    for frame in frames:
        mesh, by_meshio, by_vtk = Mesh.read(frame), meshio.read(frame), pyvista.read(frame)
        assert np.allclose(by_meshio.points, mesh.points) and np.allclose(by_vtk.points, mesh.points)
        assert sum(len(block.data) for block in by_meshio.cells) == by_vtk.n_cells == sum(map(len, mesh.cells.values()))
        for name, values in mesh.point_data.items():
            assert np.allclose(by_meshio.point_data[name].ravel(), values.ravel(), equal_nan=True), name
            assert np.allclose(by_vtk.point_data[name].ravel(), values.ravel(), equal_nan=True), name
        assert {*mesh.cell_data} <= {*by_meshio.cell_data} and {*mesh.cell_data} <= {*by_vtk.cell_data.keys()}
    reader = pyvista.get_reader(outputs / "all.pvd")
    assert len(reader.time_values) == 3 and reader.time_values[-1] == pytest.approx(0.01, rel=0.2)
    assert reader.read()[0].n_points == Mesh.read(frames[0]).points.shape[0]


def names_of(array: object) -> dict[int, str]:
    texts = np.asarray(array, dtype=np.uint8).tobytes().decode().split("\0")
    return {int(number): name for number, _, name in (text.partition(" ") for text in texts if text)}


def test_names_of_labels_and_bodies(meshes: Path, outputs: Path) -> None:
    for path in (meshes / "tets.vtu", meshes / "hexes.vtu", outputs / "cells" / "000000.vtu"):
        for data in (meshio.read(path).field_data, pyvista.read(path).field_data):
            assert names_of(data["label-names"]) == {2: "liver", 5: "left tumour"}, path
    for data in (meshio.read(outputs / "all" / "000000.vtu").field_data, pyvista.read(outputs / "all" / "000000.vtu").field_data):
        assert {"cube", "ball", "sheet"} <= {*names_of(data["body-names"]).values()}


def test_meshes(meshes: Path) -> None:
    for file in ("tets.vtu", "tets.msh", "hexes.vtu", "surface.vtu", "surface.msh", "surface.stl", "surface.ply", "surface.obj"):
        mesh, by_meshio, by_vtk = Mesh.read(meshes / file), meshio.read(meshes / file), pyvista.read(meshes / file)
        cells = sum(map(len, mesh.cells.values()))
        assert sum(len(block.data) for block in by_meshio.cells) == by_vtk.n_cells == cells, file
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        assert np.allclose([by_meshio.points.min(axis=0), by_meshio.points.max(axis=0)], [low, high], atol=1e-7), file
        assert np.allclose([by_vtk.points.min(axis=0), by_vtk.points.max(axis=0)], [low, high], atol=1e-7), file
    for file in ("surface.stl", "surface.ply", "surface.obj"):
        surface = trimesh.load(meshes / file)
        volume = pyvista.read(meshes / "surface.vtu").extract_surface(algorithm=None).volume
        assert surface.is_watertight and surface.volume == pytest.approx(volume, rel=1e-5), file


def test_images(tmp_path: Path) -> None:
    nibabel, sitk = pytest.importorskip("nibabel"), pytest.importorskip("SimpleITK")
    image = labelled()
    image.write(tmp_path / "ball.nii")
    by_nibabel, by_itk = nibabel.load(tmp_path / "ball.nii"), sitk.ReadImage(str(tmp_path / "ball.nii"))
    assert np.array_equal(np.asarray(by_nibabel.dataobj), image.array)
    assert by_nibabel.header.get_xyzt_units()[0] == "mm"
    assert np.array_equal(sitk.GetArrayFromImage(by_itk).T, image.array)
    for back in (Image.from_nibabel(by_nibabel), Image.from_sitk(by_itk)):
        assert np.array_equal(back.array, image.array) and np.allclose(back.affine, image.affine, atol=1e-9)


def test_tables(outputs: Path) -> None:
    pandas = pytest.importorskip("pandas")
    tables = [pandas.read_csv(path, comment="#") for path in outputs.glob("*.csv")]
    assert all(np.isfinite(table.to_numpy(dtype=float)).all() for table in tables)
