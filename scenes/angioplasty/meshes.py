#!/usr/bin/env python3
"""Writes deposit.msh and balloon.msh: a quarter of one half of a stenosis, and of a balloon in it that is folded into eight pleats.

deposit: tetrahedra from the lumen, 1.4 mm wide and 0.75 mm at the throat z = 0, to the wall at 1.5 mm, up to z = 10 mm.
balloon: triangles at r = a + b cos 8 phi, so that it is 2 pi 1.4 mm round when it is unfolded, up to z = 10 mm.
"""

import math

LENGTH = 10e-3


def heights(near, far):
    """Layers: short ones up to 5 mm, then twice as long in the end."""
    ratio = 2 ** (1 / far)
    parts = [ratio**k for k in range(far)]
    all_z = [5e-3 * k / near for k in range(near)]
    return all_z + [5e-3 + 5e-3 * sum(parts[:k]) / sum(parts) for k in range(far + 1)]


def polar(r, angle):
    """Exactly on the planes of symmetry."""
    c, s = math.cos(angle), math.sin(angle)
    return (0.0 if abs(c) < 1e-12 else r * c, 0.0 if abs(s) < 1e-12 else r * s)


def write(path, points, groups):
    """Gmsh 2.2: each group has a name and cells, of three nodes or of four."""
    with open(path, "w") as out:
        out.write(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{len(groups)}\n")
        for number, (name, cells) in enumerate(groups):
            out.write(f'{len(cells[0]) - 1} {number + 1} "{name}"\n')
        out.write(f"$EndPhysicalNames\n$Nodes\n{len(points)}\n")
        for k, (x, y, z) in enumerate(points):
            out.write(f"{k + 1} {x:.7g} {y:.7g} {z:.7g}\n")
        out.write(f"$EndNodes\n$Elements\n{sum(len(cells) for _, cells in groups)}\n")
        count = 0
        for number, (_, cells) in enumerate(groups):
            for cell in cells:
                count += 1
                kind = {3: 2, 4: 4}[len(cell)]
                out.write(f"{count} {kind} 1 {number + 1} {' '.join(str(node + 1) for node in cell)}\n")
        out.write("$EndElements\n")


def deposit(around=8, through=4, zs=heights(14, 5)):
    lumen = lambda z: 1.4e-3 - 0.65e-3 * (1 + math.cos(math.pi * min(z, 4e-3) / 4e-3)) / 2
    node = lambda i, j, k: i + (around + 1) * (j + (through + 1) * k)
    points, tets = [], []
    for z in zs:
        for j in range(through + 1):
            r = lumen(z) + (1.5e-3 - lumen(z)) * j / through
            points += [(*polar(r, math.pi / 2 * i / around), z) for i in range(around + 1)]
    # Six tetrahedra about a diagonal of each hexahedron, mirrored in turn so that neighbours match.
    for k in range(len(zs) - 1):
        for j in range(through):
            for i in range(around):
                corner = lambda a, b, c: node(i + a, j + b, k + c)
                flip = lambda a: a ^ (i & 1)
                for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
                    at = [0, 0, 0]
                    path = [tuple(at)]
                    for axis in order:
                        at[axis] = 1
                        path.append(tuple(at))
                    tet = [corner(flip(a), b, c) for a, b, c in path]
                    p = [points[n] for n in tet]
                    u, v, w = ([p[m][c] - p[0][c] for c in range(3)] for m in (1, 2, 3))
                    volume = (
                        u[0] * (v[1] * w[2] - v[2] * w[1])
                        + u[1] * (v[2] * w[0] - v[0] * w[2])
                        + u[2] * (v[0] * w[1] - v[1] * w[0])
                    )
                    tets.append(tet if volume > 0 else [tet[0], tet[2], tet[1], tet[3]])
    layers = {j: {node(i, j, k) for i in range(around + 1) for k in range(len(zs))} for j in (0, through)}
    sides = {j: [] for j in layers}
    for a, b, c, d in tets:
        for face in ((a, c, b), (a, b, d), (b, c, d), (a, d, c)):
            for j, nodes in layers.items():
                if nodes.issuperset(face):
                    sides[j].append(face)
    write("deposit.msh", points, [("deposit", tets), ("inner", sides[0]), ("outer", sides[through])])
    return len(points), len(tets)


def balloon(lobes=2, along=24, per_lobe=12, outer=0.66e-3, unfolded=1.4e-3):
    # The star's amplitude is what makes it as long round as asked for, within the lumen.
    shape = lambda phi, b: outer - b + b * math.cos(8 * phi)
    fine = 4000

    def length(b):
        pts = [polar(shape(math.pi / 2 * k / fine, b), math.pi / 2 * k / fine) for k in range(fine + 1)]
        return [0.0] + [math.dist(pts[k], pts[k + 1]) for k in range(fine)]

    low, high = 0.0, 0.5 * outer
    for _ in range(60):
        b = 0.5 * (low + high)
        low, high = (b, high) if sum(length(b)) < math.pi / 2 * unfolded else (low, b)
    steps = length(b)
    total, count = sum(steps), lobes * per_lobe
    angles, gone, at = [], 0.0, 0
    for n in range(count + 1):
        while at < fine and gone + steps[at + 1] <= total * n / count + 1e-15:
            gone += steps[at + 1]
            at += 1
        angles.append(math.pi / 2 * (n / count if n in (0, count) else at / fine))
    # Symmetric lobes.
    angles = [0.5 * (a + math.pi / 2 - c) for a, c in zip(angles, reversed(angles))]
    zs = [LENGTH * k / along for k in range(along + 1)]
    points = [(*polar(shape(a, b), a), z) for z in zs for a in angles]
    node = lambda i, k: i + (count + 1) * k
    triangles = []
    for k in range(along):
        for i in range(count):
            c = [node(i, k), node(i + 1, k), node(i + 1, k + 1), node(i, k + 1)]
            if (i + k) % 2:
                triangles += [[c[0], c[1], c[2]], [c[0], c[2], c[3]]]
            else:
                triangles += [[c[0], c[1], c[3]], [c[1], c[2], c[3]]]
    write("balloon.msh", points, [("balloon", triangles)])
    return len(points), len(triangles), outer - 2 * b, total * 2 / math.pi


if __name__ == "__main__":
    print("deposit: nodes, tetrahedra:", *deposit())
    print("balloon: nodes, triangles, inner radius [m], radius unfolded [m]:", *balloon())
