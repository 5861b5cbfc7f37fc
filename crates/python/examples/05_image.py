"""Mesh an image array."""

import numpy as np

import pliant


def organ() -> pliant.Image:
    """A label image of 3 mm voxels: an ellipsoid with the label 5. With nibabel: Image.from_nibabel(nib.load("seg.nii.gz"))."""
    i, j, k = np.mgrid[0:48, 0:36, 0:30]
    inside = ((i - 23.5) / 20) ** 2 + ((j - 17.5) / 14) ** 2 + ((k - 14.5) / 11) ** 2 < 1
    return pliant.Image(np.where(inside, 5, 0).astype(np.uint8), np.diag([3e-3, 3e-3, 3e-3, 1.0]))


def main() -> pliant.Mesh:
    """The mesh of what has the label."""
    liver = pliant.Mesh.of_image(organ(), labels=5, edge=0.012)
    print(liver)  # liver.to_pyvista().plot() shows it
    return liver


if __name__ == "__main__":
    main()
