//! DICOM segmentations (PS3.3 C.8.20): frames of one segment each, with a bit or a fraction per pixel, or
//! frames of labels. They become a label image whose labels are the segment numbers. Frames without voxels
//! may be missing: slices beyond the first and the last frame are assumed empty. Leaves out: compressed
//! frames, segmentations of several orientations.

use pliant_geometry::Vector3;

use super::{Elements, Frames, Grid, Image, Numbers, Order, PIXELS, Placed, ReadOptions, Scalar, ToWorld};
use super::{Fault, ImageProblem, LabelNames, checked_size};

/// Limit of missing slices, plus 16 for each existing one.
const MOST_MISSING: u64 = 512;

/// The encoding of the inside in the frames.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// A bit a pixel.
    Bits,
    /// A fraction a pixel, of this largest value; half of it is inside.
    Fractions(u16),
    /// The number of the segment itself.
    Labels(Scalar),
}

/// Reads a segmentation.
pub(super) fn read(elements: &Elements<'_>, options: &ReadOptions) -> Result<Image, Fault> {
    elements.require_uncompressed()?;
    let frames = Frames::of(elements)?;
    let [columns, rows] = frames.size(options)?;
    let kind = kind(elements)?;
    let pixels = (columns * rows) as usize;
    let bytes = elements.get(PIXELS).ok_or(ImageProblem::MissingField { field: "PixelData" })?;
    let needed = match kind {
        Kind::Bits => (pixels as u64 * frames.count as u64).div_ceil(8),
        Kind::Fractions(_) => pixels as u64 * frames.count as u64,
        Kind::Labels(scalar) => pixels as u64 * frames.count as u64 * scalar.size() as u64,
    };
    if (bytes.len() as u64) < needed {
        let found = bytes.len() as u64;
        return Err(ImageProblem::Truncated { reading: "the pixels", expected: needed, found }.into());
    }
    let names = names(elements);
    let places = (0..frames.count).map(|frame| frames.place(frame)).collect::<Result<Vec<_>, _>>()?;
    let stack = Stack::of(&places)?;
    let dims = checked_size([columns, rows, stack.count], "Rows", options)?;
    let world = ToWorld::LPS_MILLIMETRES;
    let [along, down] = places[0].steps;
    let grid = Grid::new(dims, world.vector(stack.first), world.axes([along, down, stack.step]))?;
    let mut labels = vec![0_u16; grid.len()];
    let mut shared = 0_u64;
    for (frame, &slice) in stack.slices.iter().enumerate() {
        let slice = &mut labels[slice * pixels..(slice + 1) * pixels];
        let from = frame * pixels;
        let mut put = |number: u16, inside: &dyn Fn(usize) -> bool| {
            for (_, label) in slice.iter_mut().enumerate().filter(|(at, _)| inside(from + at)) {
                shared += u64::from(*label != 0 && *label != number);
                *label = (*label).max(number);
            }
        };
        match kind {
            Kind::Bits => put(segment(&frames, frame)?, &|at| bytes[at / 8] >> (at % 8) & 1 == 1),
            Kind::Fractions(most) => {
                put(segment(&frames, frame)?, &|at| 2 * u16::from(bytes[at]) >= most);
            }
            Kind::Labels(scalar) => {
                let range = from * scalar.size()..(from + pixels) * scalar.size();
                let numbers = elements.pixels(&bytes[range], scalar);
                for (label, number) in slice.iter_mut().zip(numbers.chunks_exact(scalar.size())) {
                    *label = number.iter().rev().fold(0, |sum, &byte| sum << 8 | u16::from(byte));
                }
            }
        }
    }
    let mut notes = vec![
        "the frames end where the segments end: the scan may cut off parts beyond the first or last slice"
            .to_owned(),
    ];
    if shared > 0 {
        notes
            .push(format!("segments overlap in {shared} voxels, which belong to the highest segment number"));
    }
    let bytes = labels.into_iter().flat_map(u16::to_le_bytes).collect();
    let numbers = Numbers { scalar: Scalar::U16, order: Order::Little, bytes };
    Ok(Image { grid, format: "DICOM segmentation".to_owned(), notes, names, numbers, scale: [1.0, 0.0] })
}

fn kind(elements: &Elements<'_>) -> Result<Kind, ImageProblem> {
    let kind = elements.text(0x0062_0001).unwrap_or_else(|| "BINARY".to_owned());
    let bits = elements.short(0x0028_0100, "BitsAllocated")?;
    match (kind.as_str(), bits) {
        ("BINARY", 1) => Ok(Kind::Bits),
        ("FRACTIONAL", 8) => {
            let most =
                elements.get(0x0062_000E).map(|_| elements.short(0x0062_000E, "MaximumFractionalValue"));
            Ok(Kind::Fractions(most.transpose()?.unwrap_or(255).max(1)))
        }
        ("LABELMAP", 8) => Ok(Kind::Labels(Scalar::U8)),
        ("LABELMAP", 16) => Ok(Kind::Labels(Scalar::U16)),
        _ => Err(ImageProblem::Unsupported {
            what: format!("a segmentation of type {kind} with {bits} bits a pixel"),
            remedy: "export it as a binary segmentation, or as NIfTI or NRRD",
        }),
    }
}

/// The labels of the segments by their numbers.
fn names(elements: &Elements<'_>) -> LabelNames {
    let mut names = LabelNames::default();
    for item in elements.items(0x0062_0002) {
        if let (Ok(number), Some(name)) = (item.short(0x0062_0004, "SegmentNumber"), item.text(0x0062_0005)) {
            names.insert(number.into(), &name);
        }
    }
    names
}

/// The segment that a frame belongs to.
fn segment(frames: &Frames<'_>, frame: usize) -> Result<u16, ImageProblem> {
    const FIELD: &str = "ReferencedSegmentNumber";
    let group = frames.group(frame, 0x0062_000A).ok_or(ImageProblem::MissingField { field: FIELD })?;
    match group.short(0x0062_000B, FIELD)? {
        0 => Err(ImageProblem::bad(FIELD, 0, "segment numbers start at 1; export the segmentation again")),
        number => Ok(number),
    }
}

/// The frames as slices of a volume, with an empty slice at either end.
struct Stack {
    /// LPS [mm].
    first: Vector3,
    /// From slice to slice, LPS [mm].
    step: Vector3,
    count: u64,
    /// The slice of each frame.
    slices: Vec<usize>,
}

impl Stack {
    fn of(places: &[Placed]) -> Result<Self, ImageProblem> {
        let [along, down] = places[0].steps;
        let normal = along.cross(&down).normalize();
        let turned = |place: &Placed| {
            place
                .steps
                .iter()
                .zip([along, down])
                .any(|(step, first)| (step - first).norm() > 1e-3 * first.norm())
        };
        if let Some(frame) = places.iter().position(turned) {
            return Err(ImageProblem::SliceDiffers {
                file: format!("frame {}", frame + 1),
                what: "another orientation or pixel spacing:",
                found: format!("{:?} mm", places[frame].steps.map(|step| step.norm())),
                expected: format!("{:?} mm", [along.norm(), down.norm()]),
            });
        }
        let heights: Vec<f64> = places.iter().map(|place| place.position.dot(&normal)).collect();
        let mut sorted: Vec<(f64, usize)> = heights.iter().copied().zip(0..).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let ((low, first), (high, last)) = (sorted[0], sorted[sorted.len() - 1]);
        let stated = places[0].spacing;
        // Frames of several segments lie at one height, to the round-off of decimal strings.
        let same = 1e-3 * stated.or(places[0].thickness).unwrap_or(1.0);
        let gaps: Vec<f64> =
            sorted.windows(2).map(|pair| pair[1].0 - pair[0].0).filter(|&gap| gap > same).collect();
        let Some(least) = gaps.iter().copied().reduce(f64::min) else {
            let spacing = stated.or(places[0].thickness);
            let spacing = spacing.ok_or(ImageProblem::MissingField { field: "SliceThickness" })?;
            let (step, slices) = (normal * spacing, vec![1; places.len()]);
            return Ok(Self { first: places[first].position - step, step, count: 3, slices });
        };
        let whole = |spacing: f64, gap: f64| (gap / spacing - (gap / spacing).round()).abs() < 0.05;
        let even = |&spacing: &f64| gaps.iter().all(|&gap| gap > 0.9 * spacing && whole(spacing, gap));
        let spacing = stated.filter(even).or(Some(least).filter(even)).ok_or_else(|| {
            let odd = gaps.iter().copied().find(|&gap| !whole(least, gap)).unwrap_or(least);
            ImageProblem::SliceDiffers {
                file: "a frame".to_owned(),
                what: "a distance to the next frame of",
                found: format!("{odd:.3} mm"),
                expected: format!("{least:.3} mm or a whole multiple, like the others"),
            }
        })?;
        let steps = ((high - low) / spacing).round();
        let most = MOST_MISSING + 16 * (gaps.len() as u64 + 1);
        if steps + 1.0 > most as f64 {
            let value = format!("spread over {steps} slices of {spacing:.3} mm");
            let expected = "frames this far apart cannot belong to one organ; export the segmentation again";
            return Err(ImageProblem::bad("frames", value, expected));
        }
        let step = (places[last].position - places[first].position) / steps;
        let slices = heights.iter().map(|height| ((height - low) / spacing).round() as usize + 1).collect();
        Ok(Self { first: places[first].position - step, step, count: steps as u64 + 3, slices })
    }
}
