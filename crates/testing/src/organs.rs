//! Label images of the analytic organs by their definition, and the true surfaces to measure meshes against.

use pliant_geometry::{CellKind, Grid, Mesh, SurfaceLocator, Vector3, boundary};
use pliant_imaging::LabelImage;
use pliant_meshing::{ImplicitField, Organ, Phantom, Stuffing, brain_label};

/// 128³ voxels of 205/128 mm, centres at (i + ½) h − 102.5 mm.
fn labelled(label: impl Fn(&Vector3) -> i32 + Sync) -> LabelImage {
    use rayon::prelude::*;
    let h = 0.205 / 128.0;
    let grid = Grid::along_axes([128; 3], Vector3::repeat(0.5 * h - 0.1025), [h; 3]).expect("a cubic grid");
    let at = |at: usize| label(&grid.position(&grid.triple(at).map(|i| i as f64).into()));
    LabelImage { labels: (0..grid.len()).into_par_iter().map(at).collect(), grid }
}

/// The liver, label 1.
pub fn liver() -> LabelImage {
    let liver = Phantom::new(Organ::Liver, 1.0).expect("a positive scale");
    labelled(|point| i32::from(liver.value(point) > 0.0))
}

/// The brain with ventricles and tumour, labels 1 to 3.
pub fn brain() -> LabelImage {
    labelled(|point| brain_label(point, 1.0) as i32)
}

/// The brain, label 1.
pub fn whole_brain() -> LabelImage {
    labelled(|point| i32::from(brain_label(point, 1.0) > 0))
}

/// A ball of a radius [m], label 1.
pub fn ball(radius: f64) -> LabelImage {
    labelled(|point| i32::from(point.norm() < radius))
}

/// A ball of a core (1) and four quarters round it (2 to 5): they meet in lines and corners.
pub fn parted_ball(radius: f64) -> LabelImage {
    let quarter = |p: &Vector3| 2 + i32::from(p.x > 0.0) + 2 * i32::from(p.y > 0.0);
    labelled(|point| match point.norm() {
        r if r > radius => 0,
        r if r < 0.4 * radius => 1,
        _ => quarter(point),
    })
}

/// The true surface of an organ: points on it about 1.5 mm apart, on a fine mesh of its field.
pub struct Truth {
    points: Vec<Vector3>,
    locator: SurfaceLocator,
}

impl Truth {
    /// The surface of a field.
    pub fn new(field: &impl ImplicitField) -> Self {
        let fine = Stuffing::new(0.002).mesh(field).expect("the organ is meshed").mesh;
        let surface = boundary(&fine);
        let points = surface.nodes().iter().map(|&node| fine.points[node as usize]).collect();
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        Self { points, locator: SurfaceLocator::new(&surface, &faces, &fine.points) }
    }
}

/// The surface of `liver` or `brain`.
pub fn truth(organ: &str) -> Truth {
    let organ = if organ.starts_with("liver") { Organ::Liver } else { Organ::Brain };
    Truth::new(&Phantom::new(organ, 1.0).expect("a positive scale"))
}

/// Largest distances from the mesh's surface to the truth and from the truth to the mesh, and the root mean
/// square of the first [m]. Each face is sampled at 15 places.
pub fn distances(mesh: &Mesh, truth: &Truth) -> [f64; 3] {
    let surface = boundary(mesh);
    let (mut forth, mut squares, mut weight) = (0.0_f64, 0.0, 0.0);
    for face in &surface.faces {
        let corners: Vec<Vector3> = face.nodes().iter().map(|&node| mesh.points[node as usize]).collect();
        for (i, j) in (0..5).flat_map(|i| (0..5 - i).map(move |j| (i, j))) {
            let [a, b] = [i as f64 / 4.0, j as f64 / 4.0];
            let point = corners[0] * (1.0 - a - b) + corners[1] * a + corners[2] * b;
            let distance =
                (truth.locator.closest(&point).expect("the truth has faces").position - point).norm();
            forth = forth.max(distance);
            squares += distance * distance * face.area(&mesh.points);
            weight += face.area(&mesh.points);
        }
    }
    let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
    let locator = SurfaceLocator::new(&surface, &faces, &mesh.points);
    let to_mesh =
        |point: &Vector3| (locator.closest(point).expect("the mesh has faces").position - point).norm();
    let back = truth.points.iter().map(to_mesh).fold(0.0, f64::max);
    [forth, back, (squares / weight).sqrt()]
}

/// Root mean square distance of the surface of a label from the true one [m], at the corners and middles of
/// its faces.
pub fn interface_rms(mesh: &Mesh, label: i32, organ: Organ) -> f64 {
    let block = mesh.block(CellKind::Tet).expect("the mesh has tets");
    let mut part = Mesh { points: mesh.points.clone(), ..Mesh::default() };
    let of_label = |at: &usize| block.data["label"].item(*at)[0] == f64::from(label);
    part.block_mut(CellKind::Tet).nodes =
        (0..block.len()).filter(of_label).flat_map(|at| block.cell(at).to_vec()).collect();
    let phantom = Phantom::new(organ, 1.0).expect("a positive scale");
    let stuffing = Stuffing::new(0.001);
    // The ventricles do not meet: the fine mesh keeps one ventricle, and only its side of the middle counts.
    let fine = stuffing.mesh(&phantom).expect("the organ is meshed").mesh;
    let surface = boundary(&fine);
    let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
    let locator = SurfaceLocator::new(&surface, &faces, &fine.points);
    let one_sided = label == 2;
    let (low, high) = fine.bounds().expect("the fine mesh has points");
    let (mut squares, mut count) = (0.0, 0.0);
    for face in boundary(&part).faces {
        let corners: Vec<Vector3> = face.nodes().iter().map(|&node| mesh.points[node as usize]).collect();
        let middle = corners.iter().sum::<Vector3>() / 3.0;
        if one_sided && (middle.x > 0.0) != (0.5 * (low.x + high.x) > 0.0) {
            continue;
        }
        for point in corners.into_iter().chain([middle]) {
            squares += (locator.closest(&point).expect("there are faces").position - point).norm_squared();
            count += 1.0;
        }
    }
    (squares / count).sqrt()
}
