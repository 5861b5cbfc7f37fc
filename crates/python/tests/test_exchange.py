"""Meshes and images to and from other packages, and images that never touch a disk."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import Image, Mesh


def ball(labels: type = np.uint8) -> Image:
    """A ball of label 2 with a core of label 5, voxels of 2 mm, turned and shifted."""
    i, j, k = np.mgrid[0:20, 0:18, 0:22]
    square = (i - 9.5) ** 2 + (j - 8.5) ** 2 + (k - 10.5) ** 2
    values = np.where(square < 64, 2, 0)
    values[square < 9] = 5
    affine = np.diag([-2e-3, 2e-3, 2e-3, 1.0])
    affine[:3, 3] = (0.05, -0.01, 0.02)
    return Image(values.astype(labels), affine)


def same(a: Mesh, b: Mesh) -> bool:
    return np.array_equal(a.points, b.points) and all(np.array_equal(a.cells[kind], b.cells[kind]) for kind in a.cells)


@pytest.mark.parametrize("kind", [bool, np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64, np.float16, np.float32, np.float64])
def test_images_of_any_numbers_are_meshed_alike(kind: type) -> None:
    whole = ball()
    label = 1 if kind is bool else 2
    image = Image((whole.array == 2).astype(kind) if kind is bool else whole.array.astype(kind), whole.affine)
    wanted = Image(np.where(whole.array == 2, label, 0 if kind is bool else whole.array), whole.affine)
    assert same(Mesh.of_image(image, label, edge=6e-3), Mesh.of_image(wanted, label, edge=6e-3))


def test_images_of_scenes_stay_in_memory_and_travel(tmp_path: object) -> None:
    scene = pliant.Scene(until=0.01, gravity=(0, 0, -9.81))
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 10e3, "poisson-ratio": 0.3}
    mesh = {"image": ball(), "labels": [2, 5], "edge": 6e-3}
    scene.body["ball"] = {"mesh": mesh, "law": "tissue", "density": 1000.0}
    model = scene.build(cache=False)
    assert set(np.unique(model.bodies["ball"].mesh.cell_data["label"])) == {2.0, 5.0}
    again = pickle.loads(pickle.dumps(scene)).build(cache=False)
    assert np.array_equal(again.rest, model.rest)
    path = f"{tmp_path}/scene.toml"
    scene.save(path)
    saved = pliant.load(path).build(cache=False)
    assert np.allclose(saved.rest, model.rest, atol=1e-9)
    other = scene.replace({"body.ball.mesh.edge": 8e-3}).build(like=model)
    assert len(other.rest) < len(model.rest)
    with pytest.raises(pliant.SceneError, match="label"):
        scene.replace({"body.ball.mesh.labels": [7]}).build()


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Image(np.zeros((2, 2)), np.eye(4)), r"\(i, j, k\)"),
        (lambda: Image(np.zeros((2, 0, 2)), np.eye(4)), "shape"),
        (lambda: Image(np.zeros((2, 2, 2), dtype=complex), np.eye(4)), "complex"),
        (lambda: Image(np.zeros((2, 2, 2)), np.eye(3)), r"\(4, 4\)"),
        (lambda: Image(np.zeros((2, 2, 2)), np.full((4, 4), np.nan)), "finite"),
        (lambda: Image(np.zeros((2, 2, 2)), np.ones((4, 4))), "last row"),
        (lambda: Mesh.of_image(Image(np.ones((4, 4, 4)), np.diag([1.0, 1.0, 0.0, 1.0])), 1, edge=1.0), "plane|steps"),
        (lambda: Mesh.of_image(Image(np.full((4, 4, 4), np.nan), np.diag([1e-3] * 3 + [1.0])), 1, edge=1e-3), "is NaN"),
    ],
)
def test_images_that_are_none(make: object, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        make()  # type: ignore[operator]


def test_images_of_nibabel_and_simpleitk_lie_where_theirs_do() -> None:
    image = ball(np.int16)
    nib = pytest.importorskip("nibabel")
    millimetres = np.diag([1e3, 1e3, 1e3, 1.0]) @ image.affine
    found = Image.from_nibabel(nib.Nifti1Image(image.array, millimetres))
    assert np.array_equal(found.array, image.array) and np.allclose(found.affine, image.affine, atol=1e-9)
    sitk = pytest.importorskip("SimpleITK")
    volume = sitk.GetImageFromArray(np.transpose(image.array))
    lps = np.diag([-1.0, -1.0, 1.0, 1.0]) @ millimetres
    volume.SetSpacing([2.0, 2.0, 2.0])
    volume.SetDirection((lps[:3, :3] / 2.0).ravel().tolist())
    volume.SetOrigin(lps[:3, 3].tolist())
    found = Image.from_sitk(volume)
    assert np.array_equal(found.array, image.array) and np.allclose(found.affine, image.affine, atol=1e-9)
    for (i, j, k), voxel in (((0, 0, 0), (0, 0, 0)), ((3, 5, 7), (3, 5, 7))):
        point = np.array(volume.TransformIndexToPhysicalPoint(voxel)) * (-1e-3, -1e-3, 1e-3)
        assert np.allclose(point, (image.affine @ (i, j, k, 1.0))[:3], atol=1e-9)


def test_meshes_of_meshio_and_pyvista_come_back_the_same() -> None:
    mesh = Mesh.block([0.1, 0.05, 0.05], edge=0.025)
    mesh = Mesh(mesh.points, mesh.cells, point_data={"height": mesh.points[:, 2]}, cell_data={"label": np.arange(len(mesh.cells["tetra"]))})
    pytest.importorskip("meshio")
    back = Mesh.from_meshio(mesh.to_meshio())
    assert same(back, mesh) and np.array_equal(back.point_data["height"], mesh.point_data["height"])
    pytest.importorskip("pyvista")
    grid = mesh.to_pyvista()
    assert grid.n_cells == len(mesh.cells["tetra"]) and np.isclose(grid.volume, 0.1 * 0.05 * 0.05)
    assert np.array_equal(grid.cell_data["label"], mesh.cell_data["label"])
    back = Mesh.from_pyvista(grid)
    assert same(back, mesh) and np.array_equal(back.point_data["height"], mesh.point_data["height"])
    surface = Mesh.from_pyvista(grid.extract_surface(algorithm=None) if "algorithm" in grid.extract_surface.__doc__ else grid.extract_surface())
    assert set(surface.cells) == {"triangle"}


def test_models_lend_meshes_of_the_same_image_only() -> None:
    scene = pliant.Scene(until=0.01)
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 10e3, "poisson-ratio": 0.3}
    scene.body["ball"] = {"mesh": {"image": ball(), "labels": [2, 5], "edge": 6e-3}, "law": "tissue", "density": 1000.0}
    scene["body.ball.mesh"] = {"image": ball(), "labels": [2, 5], "edge": 6e-3}
    model = scene.build()
    assert np.array_equal(scene.replace({"law.tissue.young-modulus": 8e3}).build(like=model).rest, model.rest)
    smaller = Image(np.where(ball().array == 5, 5, 0), ball().affine)
    other = scene.copy()
    other["body.ball.mesh"] = {"image": smaller, "labels": [5], "edge": 6e-3}
    assert other.build(like=model).mass.sum() < 0.5 * model.mass.sum()
    with pytest.raises(ValueError, match="read-only"):
        smaller.array[0, 0, 0] = 5
    with pytest.raises(ValueError, match="whole numbers"):
        Image(np.full((2, 2, 2), 2**31 + 5), np.eye(4)).write("nowhere.nii")


def test_masks_from_memory_are_saved_beside_the_scene(tmp_path: object) -> None:
    whole = ball()
    masks = [Image((whole.array == label).astype(np.uint8), whole.affine) for label in (2, 5)]
    scene = pliant.Scene(until=0.01)
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 10e3, "poisson-ratio": 0.3}
    scene.body["ball"] = {"mesh": {"masks": masks, "edge": 6e-3}, "law": "tissue", "density": 1000.0}
    scene.save(f"{tmp_path}/scene.toml")
    assert np.allclose(pliant.load(f"{tmp_path}/scene.toml").build().rest, scene.build().rest, atol=1e-9)


def column() -> tuple[np.ndarray, dict[str, list[list[int]]]]:
    """A cube of two wedges under one of a hexahedron, with a pyramid on top."""
    points = np.array([[x, y, z] for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)] + [[0.5, 0.5, 3]], float)
    cells = {"wedge": [[0, 1, 3, 4, 5, 7], [0, 3, 2, 4, 7, 6]], "hexahedron": [[4, 5, 7, 6, 8, 9, 11, 10]], "pyramid": [[8, 9, 11, 10, 12]]}
    return points, cells


def volume(mesh: Mesh) -> float:
    a, b, c, d = np.moveaxis(mesh.points[mesh.cells["tetra"]], 1, 0)
    volumes = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6
    assert (volumes > 0).all()
    return float(volumes.sum())


def test_wedges_and_pyramids_become_tetrahedra() -> None:
    points, cells = column()
    mesh = Mesh(points, cells, cell_data={"label": [1, 1, 2, 3]})
    assert set(mesh.cells) == {"tetra"} and abs(volume(mesh) - 7 / 3) < 1e-12
    assert {label: int((mesh.cell_data["label"] == label).sum()) for label in (1, 2, 3)} == {1: 6, 2: 6, 3: 2}
    meshio = pytest.importorskip("meshio")
    blocks = [(kind, np.array(corners)) for kind, corners in cells.items()]
    labels = [np.array([1.0, 1.0]), np.array([2.0]), np.array([3.0])]
    back = Mesh.from_meshio(meshio.Mesh(points, blocks, cell_data={"label": labels}))
    assert same(mesh, back) and np.array_equal(mesh.cell_data["label"], back.cell_data["label"])
    with pytest.raises(ValueError, match="tetra10"):
        Mesh.from_meshio(meshio.Mesh(np.zeros((10, 3)), [("tetra10", np.arange(10)[None])]))
    pyvista = pytest.importorskip("pyvista")
    kinds = {"wedge": 13, "hexahedron": 12, "pyramid": 14}
    grid = pyvista.UnstructuredGrid({kinds[kind]: np.array(corners) for kind, corners in cells.items()}, points)
    assert abs(volume(Mesh.from_pyvista(grid)) - 7 / 3) < 1e-12
    voxels = Mesh.from_pyvista(pyvista.ImageData(dimensions=(3, 2, 2)))
    assert len(voxels.cells["hexahedron"]) == 2
    quadratic = pyvista.UnstructuredGrid({24: np.arange(10)[None]}, np.random.default_rng(1).random((10, 3)))
    with pytest.raises(ValueError, match="VTK type 24"):
        Mesh.from_pyvista(quadratic)


def everything() -> Mesh:
    """Tetrahedra with labels, names, fibres and sets, and triangles that lack some of them."""
    block = Mesh.block([0.1, 0.05, 0.05], edge=0.025)
    tets, (count,) = block.cells["tetra"], block.cells["tetra"].shape[:1]
    labels = np.concatenate([np.arange(count) % 3, np.full(2, np.nan)])
    fibres = np.concatenate([np.tile([1.0, 0.0, 0.0], (count, 1)), np.full((2, 3), np.nan)])
    return Mesh(
        block.points,
        {"tetra": tets, "triangle": tets[:2, :3]},
        point_data={"height": block.points[:, 2], "strain": np.tile(np.eye(3).ravel(), (len(block.points), 1))},
        cell_data={"label": labels, "fibre": fibres},
        point_sets={"left": [0, 2, 3], "none": []},
        cell_sets={"skin": [count, count + 1], "both": [1, count]},
        label_names={1: "liver", 2: "Größe der Galle"},
    )


def alike(a: Mesh, b: Mesh) -> None:
    """Asserts that two meshes have the same of everything."""
    assert list(a.cells) == list(b.cells) and same(a, b)
    for of in ("point_data", "cell_data", "point_sets", "cell_sets"):
        left, right = getattr(a, of), getattr(b, of)
        assert set(left) == set(right), of
        assert all(np.array_equal(left[name], right[name], equal_nan=left[name].dtype.kind == "f") for name in left), of
    assert a.label_names == b.label_names


def told_of_cells(mesh: Mesh) -> dict[tuple[str | int, ...], list[float]]:
    """Label and fibre of each cell, by its kind and nodes: Gmsh's files order cells by their sets."""
    cells = [(kind, *nodes.tolist()) for kind, corners in mesh.cells.items() for nodes in corners]
    values = np.column_stack([mesh.cell_data["label"], mesh.cell_data["fibre"].reshape(len(cells), 3)])
    return dict(zip(cells, np.nan_to_num(values, nan=-1.0).tolist(), strict=True))


def test_nothing_of_a_mesh_is_lost_on_the_way(tmp_path: Path) -> None:
    meshio, pyvista = pytest.importorskip("meshio"), pytest.importorskip("pyvista")
    mesh = everything()
    alike(pickle.loads(pickle.dumps(mesh)), mesh)
    alike(Mesh.from_meshio(mesh.to_meshio()), mesh)
    alike(Mesh.from_pyvista(mesh.to_pyvista()), mesh)
    mesh.write(tmp_path / "mesh.vtu")
    for back in (
        Mesh.read(tmp_path / "mesh.vtu"),
        Mesh.from_meshio(meshio.read(tmp_path / "mesh.vtu")),
        Mesh.from_pyvista(pyvista.read(tmp_path / "mesh.vtu")),
    ):
        alike(back, mesh)
    mesh.write(tmp_path / "mesh.msh")
    mine, theirs = Mesh.read(tmp_path / "mesh.msh"), Mesh.from_meshio(meshio.read(tmp_path / "mesh.msh"))
    assert np.array_equal(mine.points, theirs.points) and told_of_cells(mine) == told_of_cells(theirs)
    assert np.array_equal(mine.cells["tetra"], mesh.cells["tetra"])
    # meshio keeps one dimension of a name; "both" has cells of two.
    whole = ("left", "skin")
    assert all(np.array_equal(mine.point_sets[name], theirs.point_sets[name]) for name in whole)
    assert set(theirs.point_sets["both"].tolist()) < set(mine.point_sets["both"].tolist())
    assert Mesh.from_pyvista(mesh.to_pyvista(), scale=1e-3).points.max() == pytest.approx(1e-4)


def test_wedges_keep_labels_and_sets_of_cells() -> None:
    meshio = pytest.importorskip("meshio")
    points, cells = column()
    blocks = [(kind, np.array(corners)) for kind, corners in cells.items()]
    sets = {"top": [np.empty(0, int), np.array([0]), np.array([0])]}
    mesh = Mesh.from_meshio(meshio.Mesh(points, blocks, cell_sets=sets, point_sets={"foot": np.arange(4)}))
    assert len(mesh.cell_sets["top"]) == 8 and {*range(4)} == {*mesh.point_sets["foot"].tolist()}
    assert {*mesh.point_sets["top"].tolist()} == {*range(4, 13)}


def test_labels_of_images_are_rounded_as_the_mesher_does() -> None:
    values = np.zeros((12, 12, 12))
    values[2:6, 2:10, 2:10], values[6:10, 2:10, 2:10] = 5, 6.99999
    image = Image(values, np.diag([2e-3] * 3 + [1.0]))
    assert {label: part.voxels for label, part in image.labels().items()} == {5: 256, 7: 256}
    assert set(np.unique(Mesh.of_image(image, [5, 7], edge=4e-3).cell_data["label"])) == {5.0, 7.0}
    with pytest.raises(pliant.MeshError, match=r"6\.9"):
        Image(np.where(values > 6, 6.9, values), image.affine).labels()


@pytest.mark.parametrize("labels", [np.int64(5), np.uint8(5), np.array([5, 7]), range(5, 8, 2), {5, 7}, (5, 7), [np.int32(5)]])
def test_labels_are_any_whole_numbers(labels: object) -> None:
    values = np.zeros((12, 12, 12), np.uint8)
    values[2:6, 2:10, 2:10], values[6:10, 2:10, 2:10] = 5, 7
    mesh = Mesh.of_image(Image(values, np.diag([2e-3] * 3 + [1.0])), labels, edge=4e-3)
    assert set(np.unique(mesh.cell_data["label"])) == {
        float(label) for label in np.atleast_1d(list(np.ravel(labels)) if not isinstance(labels, set) else list(labels))
    }


@pytest.mark.parametrize(("unit", "metres"), [("meter", 1.0), ("mm", 1e-3), ("micron", 1e-6), ("unknown", 1e-3)])
def test_images_of_nibabel_have_the_unit_of_their_header(tmp_path: Path, unit: str, metres: float) -> None:
    nib = pytest.importorskip("nibabel")
    image = nib.Nifti1Image(np.ones((4, 4, 4), np.uint8), np.diag([2e-3 / metres] * 3 + [1.0]))
    image.header.set_xyzt_units(unit)
    nib.save(image, tmp_path / "image.nii")
    for found in (Image.from_nibabel(image), Image.read(tmp_path / "image.nii")):
        assert found.labels()[1].volume == pytest.approx(64 * 8e-9, rel=1e-5)
