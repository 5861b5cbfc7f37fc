"""Makes the mesh files of this folder with programs that are not ours: Gmsh, VTK (through pyvista), meshio and nibabel.

    pip install numpy meshio==5.3.5 nibabel==5.4.2 pyvista==0.49.1 vtk==9.7.2 gmsh==4.15.2
    python generate.py

The tests know what is in the files from the functions below, not from reading them with our code.
"""

import meshio
import nibabel as nib
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

# --- the mixed mesh -----------------------------------------------------------------------------------------
# A unit cube (hex) with tets on its top; triangles, a quad, lines and a vertex on its sides.
POINTS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [0.5, 0.25, 2.125]]
)
CELLS = [
    ("hexahedron", np.array([[0, 1, 2, 3, 4, 5, 6, 7]])),
    ("tetra", np.array([[4, 5, 6, 8], [4, 6, 7, 8]])),
    ("triangle", np.array([[4, 5, 8], [5, 6, 8]])),
    ("quad", np.array([[0, 3, 2, 1]])),
    ("line", np.array([[0, 1], [1, 2]])),
    ("vertex", np.array([[8]])),
]
VTK_TYPES = {"hexahedron": 12, "tetra": 10, "triangle": 5, "quad": 9, "line": 3, "vertex": 1}
N_CELLS = sum(len(c) for _, c in CELLS)
TEMPERATURE = 0.5 * np.arange(9)  # points, scalar
VELOCITY = POINTS * 2.0 + 1.0  # points, vector
NUMBER = np.arange(9) * 1000  # points, integers
LABEL = 10 + np.arange(N_CELLS)  # cells, integers
STRESS = np.arange(9 * N_CELLS).reshape(-1, 9) * 0.125  # cells, tensor


def vtk_grid():
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for x in POINTS:
        points.InsertNextPoint(x)
    grid.SetPoints(points)
    for kind, cells in CELLS:
        for cell in cells:
            grid.InsertNextCell(VTK_TYPES[kind], len(cell), [int(i) for i in cell])

    def add(data, name, array):
        array = numpy_to_vtk(np.ascontiguousarray(array), deep=1)
        array.SetName(name)
        data.AddArray(array)

    add(grid.GetPointData(), "temperature", TEMPERATURE)
    add(grid.GetPointData(), "velocity", VELOCITY.astype(np.float32))
    add(grid.GetPointData(), "number", NUMBER.astype(np.int64))
    add(grid.GetCellData(), "label", LABEL.astype(np.int32))
    add(grid.GetCellData(), "stress", STRESS)
    time = numpy_to_vtk(np.array([0.25]), deep=1)
    time.SetName("TimeValue")
    grid.GetFieldData().AddArray(time)
    return grid


def write_vtu(name, mode, encode=False, compressor=None, header=64, order="little"):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputData(vtk_grid())
    writer.SetFileName(name)
    {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary, "appended": writer.SetDataModeToAppended}[mode]()
    writer.SetEncodeAppendedData(encode)
    if compressor is None:
        writer.SetCompressorTypeToNone()
    else:
        writer.SetCompressorType({"zlib": 1, "lz4": 2, "lzma": 3}[compressor])
    if compressor:
        writer.SetBlockSize(96)  # several blocks even in a small file
    writer.SetHeaderType(header)
    (writer.SetByteOrderToBigEndian if order == "big" else writer.SetByteOrderToLittleEndian)()
    assert writer.Write()


write_vtu("ascii.vtu", "ascii")
write_vtu("inline.vtu", "binary", header=32)
write_vtu("inline-64-big.vtu", "binary", header=64, order="big")
write_vtu("inline-zlib.vtu", "binary", compressor="zlib", header=32)
write_vtu("appended-raw.vtu", "appended")
write_vtu("appended-raw-zlib.vtu", "appended", compressor="zlib")
write_vtu("appended-raw-32-big.vtu", "appended", header=32, order="big")
write_vtu("appended-base64.vtu", "appended", encode=True, header=32)
write_vtu("appended-base64-zlib-big.vtu", "appended", encode=True, compressor="zlib", order="big")
write_vtu("appended-lz4.vtu", "appended", compressor="lz4")


def write_legacy(name, binary, version):
    writer = vtk.vtkUnstructuredGridWriter()
    writer.SetInputData(vtk_grid())
    writer.SetFileName(name)
    writer.SetFileVersion(version)
    (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
    assert writer.Write()


write_legacy("v42.vtk", False, 42)
write_legacy("v42-binary.vtk", True, 42)
write_legacy("v51.vtk", False, 51)
write_legacy("v51-binary.vtk", True, 51)


def poly_data():
    """A vertex, two lines as one poly-line, a triangle, a quad, a pentagon and a strip of two triangles."""
    poly = vtk.vtkPolyData()
    points = vtk.vtkPoints()
    for x in [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0), (0, 2, 0), (1, 2, 0), (0.5, 3, 0)]:
        points.InsertNextPoint(x)
    poly.SetPoints(points)

    def cells(*lists):
        array = vtk.vtkCellArray()
        for ids in lists:
            array.InsertNextCell(len(ids))
            for i in ids:
                array.InsertCellPoint(i)
        return array

    poly.SetVerts(cells([8]))
    poly.SetLines(cells([0, 1, 4]))
    poly.SetPolys(cells([0, 1, 2], [1, 4, 5, 2], [3, 2, 7, 8, 6]))
    poly.SetStrips(cells([3, 2, 6, 7]))
    ids = numpy_to_vtk(np.arange(6.0), deep=1)
    ids.SetName("id")
    poly.GetCellData().AddArray(ids)
    colours = numpy_to_vtk(np.arange(27, dtype=np.uint8).reshape(9, 3), deep=1)
    colours.SetName("colour of point")
    poly.GetPointData().AddArray(colours)
    return poly


for name, binary, version in [("poly-v42.vtk", False, 42), ("poly-v51-binary.vtk", True, 51)]:
    writer = vtk.vtkPolyDataWriter()
    writer.SetInputData(poly_data())
    writer.SetFileName(name)
    writer.SetFileVersion(version)
    (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
    assert writer.Write()
writer = vtk.vtkXMLPolyDataWriter()
writer.SetInputData(poly_data())
writer.SetFileName("poly.vtp")
assert writer.Write()

# --- meshio: the mixed mesh as VTU and legacy VTK, as others write them
# ----------------------------------------
mixed = meshio.Mesh(
    POINTS,
    CELLS,
    point_data={"temperature": TEMPERATURE, "velocity": VELOCITY, "number": NUMBER},
    cell_data={
        "label": np.split(LABEL, np.cumsum([len(c) for _, c in CELLS])[:-1]),
        "stress": np.split(STRESS, np.cumsum([len(c) for _, c in CELLS])[:-1]),
    },
)
meshio.vtu.write("meshio.vtu", mixed, binary=True, compression=None)
meshio.vtu.write("meshio-zlib.vtu", mixed, binary=True, compression="zlib")
meshio.vtk.write("meshio-v42.vtk", mixed, fmt_version="4.2", binary=True)
meshio.vtk.write("meshio-v51.vtk", mixed, fmt_version="5.1", binary=True)

# --- Gmsh: a box with named groups, and data on nodes and elements
# ---------------------------------------------
import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
gmsh.model.occ.addBox(1, 0, 0, 1, 1, 1)
gmsh.model.occ.fragment([(3, 1)], [(3, 2)])
gmsh.model.occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeMin", 2)
left, right = sorted(tag for _, tag in gmsh.model.getEntities(3))
gmsh.model.addPhysicalGroup(3, [left], 5, "left lobe")
gmsh.model.addPhysicalGroup(3, [right], 6, "right lobe")
gmsh.model.addPhysicalGroup(3, [left, right], 7, "all")
gmsh.model.addPhysicalGroup(2, [1], 8, "wall")
gmsh.model.addPhysicalGroup(0, [1, 2], 9, "pins")
gmsh.model.mesh.generate(3)
nodes, coordinates, _ = gmsh.model.mesh.getNodes()
coordinates = coordinates.reshape(-1, 3)
view = gmsh.view.add("speed")
gmsh.view.addHomogeneousModelData(view, 0, gmsh.model.getCurrent(), "NodeData", nodes, (coordinates[:, 0] + 10 * coordinates[:, 1]).tolist(), 0.5, 1)
_, elements, _ = gmsh.model.mesh.getElements(3)
cell_view = gmsh.view.add("flow")
gmsh.view.addHomogeneousModelData(cell_view, 0, gmsh.model.getCurrent(), "ElementData", elements[0], np.repeat(np.asarray(elements[0], float), 3).tolist(), 0.5, 3)
for version, name in [(1, "gmsh1"), (2.2, "gmsh22"), (4.1, "gmsh41")]:
    for binary in [0, 1]:
        if version == 1 and binary:
            continue
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.option.setNumber("PostProcessing.SaveMesh", 0)
        path = f"{name}{'-binary' if binary else ''}.msh"
        gmsh.write(path)
        if version != 1:
            gmsh.view.write(view, path, True)
            gmsh.view.write(cell_view, path, True)
# What Gmsh says about the same mesh, for the tests: counts, and sums that any error would change.
types, tags, node_tags = gmsh.model.mesh.getElements(3)
volumes = gmsh.model.mesh.getElementQualities(tags[0], "volume")
print("gmsh: nodes", len(nodes), "tets", len(tags[0]), "volume", volumes.sum())
for dimension, group in gmsh.model.getPhysicalGroups():
    entities = gmsh.model.getEntitiesForPhysicalGroup(dimension, group)
    count = sum(len(t) for e in entities for t in gmsh.model.mesh.getElements(dimension, e)[1])
    print("  group", dimension, group, gmsh.model.getPhysicalName(dimension, group), count)
# Quadratic: only the points of the group are linear.
gmsh.model.mesh.setOrder(2)
gmsh.option.setNumber("Mesh.Binary", 0)
gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
gmsh.write("quadratic.msh")
# Partitioned and recombined (hexes), with the unknown sections that come with them.
gmsh.clear()
gmsh.model.add("bar")
gmsh.model.geo.addPoint(0, 0, 0, 1)
gmsh.model.geo.extrude([(0, 1)], 1, 0, 0, numElements=[2], recombine=True)
gmsh.model.geo.extrude([(1, 1)], 0, 1, 0, numElements=[1], recombine=True)
gmsh.model.geo.extrude([(2, 5)], 0, 0, 1, numElements=[1], recombine=True)
gmsh.model.geo.synchronize()
gmsh.model.addPhysicalGroup(3, [1], 3, "bar")
gmsh.model.mesh.generate(3)
gmsh.model.mesh.partition(2)
gmsh.write("partitioned.msh")
gmsh.option.setNumber("Mesh.Binary", 1)
gmsh.write("partitioned-binary.msh")
gmsh.finalize()

# --- surfaces
# ------------------------------------------------------------------------------------------------ A
# tetrahedron with outward triangles; and a cube of quads.
TET = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
tet = meshio.Mesh(TET, [("triangle", FACES)])
meshio.write("meshio.stl", tet, binary=False)
meshio.stl.write("meshio-binary.stl", tet, binary=True)
meshio.write("meshio.off", tet)
meshio.write("meshio.obj", tet)
shell = meshio.Mesh(
    POINTS[:8],
    [("triangle", np.array([[0, 2, 1]])), ("quad", np.array([[4, 5, 6, 7], [0, 1, 5, 4]]))],
    point_data={"temperature": TEMPERATURE[:8]},
    cell_data={"part": [np.array([3]), np.array([4, 5])]},
)
meshio.ply.write("meshio.ply", shell, binary=False)
meshio.ply.write("meshio-binary.ply", shell, binary=True)

poly = vtk.vtkPolyData()
points = vtk.vtkPoints()
for x in TET:
    points.InsertNextPoint(x)
poly.SetPoints(points)
array = vtk.vtkCellArray()
for face in FACES:
    array.InsertNextCell(3, [int(i) for i in face])
poly.SetPolys(array)
for name, kind in [("vtk.stl", "stl"), ("vtk-binary.stl", "stl"), ("vtk-big.ply", "ply"), ("vtk.obj", "obj")]:
    writer = {"stl": vtk.vtkSTLWriter, "ply": vtk.vtkPLYWriter, "obj": vtk.vtkOBJWriter}[kind]()
    writer.SetInputData(poly)
    writer.SetFileName(name)
    if kind == "stl":
        (writer.SetFileTypeToBinary if "binary" in name else writer.SetFileTypeToASCII)()
    if kind == "ply":
        writer.SetFileTypeToBinary()
        writer.SetDataByteOrderToBigEndian()
    assert writer.Write()

# --- GIfTI and FreeSurfer -----------------------------------------------------------------------------------
for name, encoding in [("ascii", 1), ("base64", 2), ("gzip", 3)]:
    arrays = [
        nib.gifti.GiftiDataArray(np.asarray(values, kind), intent=intent, datatype=code, encoding=encoding)
        for values, kind, intent, code in [
            (TET, np.float32, "NIFTI_INTENT_POINTSET", "NIFTI_TYPE_FLOAT32"),
            (FACES, np.int32, "NIFTI_INTENT_TRIANGLE", "NIFTI_TYPE_INT32"),
        ]
    ]
    nib.save(nib.gifti.GiftiImage(darrays=arrays), f"nibabel-{name}.gii")
footer = {
    "head": np.array([2, 0, 20]), "valid": "1  # volume info valid", "filename": "orig.mgz", "volume": np.array([256, 256, 256]),
    "voxelsize": np.ones(3), "xras": np.array([-1.0, 0, 0]), "yras": np.array([0.0, 0, -1]), "zras": np.array([0.0, 1, 0]),
    "cras": np.array([1.5, -2.0, 3.0]),
}
nib.freesurfer.write_geometry("nibabel.pial", TET, FACES, create_stamp="made for a test", volume_info=footer)
