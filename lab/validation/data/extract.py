"""Extracts what the tests read from the project's reference data: python3 extract.py SOURCE, where SOURCE is the
folder shared/reference/solid. Needs numpy. The extracted files are kept beside this script."""
import json
import shutil
import sys
from pathlib import Path

import numpy

source, here = Path(sys.argv[1]), Path(__file__).parent
read = lambda name: json.loads((source / name).read_text())


def write(name, value):
    (here / name).write_text(json.dumps(value) + "\n")


shear = read("shear_curves.json")
every = 5  # of the 101 shears: steps of 0.05
thin = lambda curves: {k: {s: v[::every] for s, v in c.items() if s in ("S11", "S22", "S33", "S12")} for k, c in curves.items()}
write("shear_curves.json", {
    "parameters": shear["parameters"],
    "gamma": shear["cases"]["A_fig_6_3"]["gamma"][::every],
    "A": {kind: thin(shear["cases"]["A_fig_6_3"][kind]) for kind in ("energy", "taylor", "isotropic")},
    "B": {"energy": thin(shear["cases"]["B_null_test"]["energy"])},
})

relaxation = read("relaxation.json")
for model in relaxation["models"].values():
    del model["samples_m"], model["F_over_Fhalfsec"]
write("relaxation.json", relaxation)

for name in (
    "material_points.json", "homogeneous_uniaxial.json", "timestep.json", "meshes/cube_tet4.msh",
    "meshes/cantilever_half_tet4.msh", "meshes/cube_eighth_tet4.msh",
):
    shutil.copyfile(source / name, here / Path(name).name)

solutions = numpy.load(source / "cube_tet4_solutions.npz")
write("cube_tet4_solutions.json", {
    law: {"displacement": solutions[law].round(12).tolist(), "reaction": solutions[law + "_F"].tolist()}
    for law in ("NH_T4", "TIy_T4")
})
write("cube_tet4_anp_solutions.json", {
    law: {"displacement": solutions[law].round(9).tolist(), "reaction": solutions[law + "_F"].tolist()}
    for law in ("NH_ANP_BonetBurton", "TIy_ANP_BonetBurton")
})

solutions = numpy.load(source / "cube_hex8_10_solutions.npz")
write("cube_hex8_10_solutions.json", {
    "points": solutions["points"].round(12).tolist(),
    **{
        key: {"displacement": solutions[key].round(9).tolist(), "reaction": solutions[key + "_F"].tolist()}
        for key in ("NH_hg0.05", "NH_hg0.1", "NH_meandil")
    },
})

shutil.copyfile(source / "meshes/ellipsoid_tet4_h14mm.msh", here / "ellipsoid_tet4_h14mm.msh")
solutions = numpy.load(source / "ellipsoid_tet4_h14mm_solutions.npz")
ellipsoid = read("ellipsoid.json")
write("ellipsoid.json", {
    "points": ellipsoid["points"],
    "displacement": ellipsoid["u"],
    "T4": solutions["T4"].round(12).tolist(),
    "ANP": solutions["ANP_BonetBurton"].round(9).tolist(),
})

# From the reference set `coupling`, if its folder is given as second argument.
if len(sys.argv) > 2:
    source = Path(sys.argv[2])
    here = here / "coupling"
    here.mkdir(exist_ok=True)
    blocks = numpy.load(source / "coated_block_t4.npz")
    cases = {"none": "none_-0.05", "pressed": "A_-0.1", "pulled": "A_0.1"}
    write("coated_block_t4.json", {
        "points": blocks["X"].round(12).tolist(),
        "tets": blocks["tets"].tolist(),
        "top": blocks["top_triangles"].tolist(),
        "fixed": blocks["fixed_dof"].tolist(),
        **{
            name: {"force": blocks["f_" + key.split("_")[1]].round(12).tolist(), "displacement": blocks["u_" + key].round(11).tolist()}
            for name, key in cases.items()
        },
    })
    block = read("coated_block_uniaxial.json")
    laws = ("stvk", "corotational", "neo-hookean")
    block["rows"] = [
        {"coating": row["coating"], "eps": row["eps"], **{law: row["width_fixed_" + law]["F_total"] for law in laws}}
        for row in block["rows"]
    ]
    write("coated_block_uniaxial.json", block)
    block = read("coated_block_patch.json")
    block["rows"] = {name: rows for name, rows in block["rows"].items() if name.endswith("n8")}
    write("coated_block_patch.json", block)
    organ = read("ellipsoid_capsule.json")
    organ["rows"] = {name: rows["h0.0042"] for name, rows in organ["rows"].items() if "h0.0042" in rows}
    write("ellipsoid_capsule.json", organ)
    for name in ("tubes.json", "angioplasty.json"):
        shutil.copyfile(source / name, here / name)
