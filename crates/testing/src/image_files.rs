//! Writers of every format, for tests: a header by the published layout, then the voxels.

use std::fs;
use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::{DeflateEncoder, GzEncoder, ZlibEncoder};
use nalgebra::{Matrix3, Vector3};

/// A volume of 16-bit numbers in RAS [mm].
#[derive(Clone)]
pub struct Volume {
    /// Voxels along each axis.
    pub dims: [usize; 3],
    /// Centre of the first voxel [mm].
    pub origin: Vector3<f64>,
    /// Steps from voxel to voxel along each axis, as columns [mm].
    pub axes: Matrix3<f64>,
    /// Value of each voxel, the first axis fastest.
    pub values: Vec<i16>,
}

impl Volume {
    /// Small, oblique and left-handed, each voxel with its own number.
    pub fn oblique() -> Self {
        let rotation = nalgebra::Rotation3::from_euler_angles(0.3, -0.4, 1.1);
        let mirrored = Matrix3::from_diagonal(&Vector3::new(0.9, 1.25, -2.5));
        let dims = [5, 4, 3];
        Self {
            dims,
            origin: Vector3::new(-31.5, 12.25, 101.0),
            axes: rotation.matrix() * mirrored,
            values: (0..60).map(|i| i * 37 - 900).collect(),
        }
    }

    /// 40³ voxels of 1 mm about the origin, each with the label of its place [mm].
    pub fn of_labels(label: impl Fn([f64; 3]) -> i16) -> Self {
        const SIDE: usize = 40;
        let at = |i: usize| i as f64 - (SIDE as f64 - 1.0) / 2.0;
        let place = |n: usize| [at(n % SIDE), at(n / SIDE % SIDE), at(n / SIDE / SIDE)];
        Self {
            dims: [SIDE; 3],
            origin: Vector3::repeat(at(0)),
            axes: Matrix3::identity(),
            values: (0..SIDE.pow(3)).map(|n| label(place(n))).collect(),
        }
    }

    /// A ball of label 5 and radius 15 mm around a ball of label 8 and radius 7 mm. There are also a loose
    /// voxel of label 5, a hole, and a single voxel of label 9.
    pub fn ball_with_a_core() -> Self {
        Self::of_labels(|[x, y, z]| {
            let r = (x * x + y * y + z * z).sqrt();
            match [x, y, z] {
                [-18.5, -18.5, -18.5] => 5,
                [18.5, 18.5, 18.5] => 9,
                [0.5, 0.5, 11.5] => 0,
                _ if r < 7.0 => 8,
                _ if r < 15.0 => 5,
                _ => 0,
            }
        })
    }

    /// A ball on the left with a rod of 4 mm that sticks out to x = 18 mm.
    pub fn ball_with_a_rod(label: i16) -> Self {
        let ball = |[x, y, z]: [f64; 3]| (x + 8.0).powi(2) + y * y + z * z < 100.0;
        let rod = |[x, y, z]: [f64; 3]| (-8.0..18.0).contains(&x) && y.abs() < 2.0 && z.abs() < 2.0;
        Self::of_labels(|point| if ball(point) || rod(point) { label } else { 0 })
    }

    /// Returns the volume as a NIfTI-1 file.
    pub fn nifti(&self) -> Vec<u8> {
        nifti1(self, Form::Sform, false)
    }

    /// Returns the volume as a packed NIfTI-1 file.
    pub fn packed(&self) -> Vec<u8> {
        gzip(&self.nifti())
    }

    fn bytes(&self, big: bool) -> Vec<u8> {
        self.values.iter().flat_map(|x| if big { x.to_be_bytes() } else { x.to_le_bytes() }).collect()
    }

    fn spacing(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.axes.column(axis).norm())
    }

    /// Unit vectors of the axes in LPS.
    fn directions_lps(&self) -> [[f64; 3]; 3] {
        [0, 1, 2].map(|axis| {
            let unit = self.axes.column(axis).normalize();
            [-unit.x, -unit.y, unit.z]
        })
    }

    fn origin_lps(&self) -> [f64; 3] {
        [-self.origin.x, -self.origin.y, self.origin.z]
    }

    /// The centre of the first voxel of a slice in LPS.
    fn slice_lps(&self, k: usize) -> [f64; 3] {
        let position = self.origin + self.axes.column(2) * k as f64;
        [-position.x, -position.y, position.z]
    }
}

/// Numbers put into a header.
struct Bytes {
    bytes: Vec<u8>,
    big: bool,
}

impl Bytes {
    fn put<const N: usize>(&mut self, at: usize, mut little: [u8; N]) {
        if self.big {
            little.reverse();
        }
        self.bytes[at..at + N].copy_from_slice(&little);
    }
}

/// Place of the orientation in a NIfTI header.
#[derive(Clone, Copy, PartialEq)]
pub enum Form {
    /// In the affine matrix.
    Sform,
    /// In the quaternion.
    Qform,
    /// Nowhere.
    Neither,
}

/// A NIfTI-1 file.
pub fn nifti1(volume: &Volume, form: Form, big: bool) -> Vec<u8> {
    let mut header = Bytes { bytes: vec![0; 352], big };
    header.put(0, 348_i32.to_le_bytes());
    for (at, n) in [3, volume.dims[0], volume.dims[1], volume.dims[2], 1, 1, 1, 1].into_iter().enumerate() {
        header.put(40 + 2 * at, (n as i16).to_le_bytes());
    }
    header.put(70, 4_i16.to_le_bytes());
    header.put(72, 16_i16.to_le_bytes());
    let (rotation, qfac) = quaternion(volume);
    let spacing = volume.spacing();
    for (at, h) in [qfac, spacing[0], spacing[1], spacing[2]].into_iter().enumerate() {
        header.put(76 + 4 * at, (h as f32).to_le_bytes());
    }
    header.put(108, 352_f32.to_le_bytes());
    header.bytes[123] = 2;
    if form != Form::Neither {
        header.put(252, 1_i16.to_le_bytes());
        for (at, x) in rotation.into_iter().chain(volume.origin.iter().copied()).enumerate() {
            header.put(256 + 4 * at, (x as f32).to_le_bytes());
        }
    }
    if form == Form::Sform {
        header.put(254, 2_i16.to_le_bytes());
        for row in 0..3 {
            let numbers =
                [volume.axes[(row, 0)], volume.axes[(row, 1)], volume.axes[(row, 2)], volume.origin[row]];
            for (at, x) in numbers.into_iter().enumerate() {
                header.put(280 + 16 * row + 4 * at, (x as f32).to_le_bytes());
            }
        }
    }
    header.bytes[344..348].copy_from_slice(b"n+1\0");
    header.bytes.extend(volume.bytes(big));
    header.bytes
}

/// A NIfTI-2 file.
pub fn nifti2(volume: &Volume, big: bool) -> Vec<u8> {
    let mut header = Bytes { bytes: vec![0; 544], big };
    header.put(0, 540_i32.to_le_bytes());
    header.bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
    header.put(12, 4_i16.to_le_bytes());
    header.put(14, 16_i16.to_le_bytes());
    for (at, n) in [3, volume.dims[0], volume.dims[1], volume.dims[2], 1, 1, 1, 1].into_iter().enumerate() {
        header.put(16 + 8 * at, (n as i64).to_le_bytes());
    }
    header.put(168, 544_i64.to_le_bytes());
    header.put(348, 1_i32.to_le_bytes());
    header.put(500, 2_i32.to_le_bytes());
    for row in 0..3 {
        let numbers =
            [volume.axes[(row, 0)], volume.axes[(row, 1)], volume.axes[(row, 2)], volume.origin[row]];
        for (at, x) in numbers.into_iter().enumerate() {
            header.put(400 + 32 * row + 8 * at, x.to_le_bytes());
        }
    }
    header.bytes.extend(volume.bytes(big));
    header.bytes
}

/// (b, c, d) of the rotation, and qfac: −1 for left-handed axes, whose third column is mirrored.
fn quaternion(volume: &Volume) -> ([f64; 3], f64) {
    let mut axes = volume.axes;
    let qfac = volume.axes.determinant().signum();
    for axis in 0..3 {
        let unit = axes.column(axis).normalize() * if axis == 2 { qfac } else { 1.0 };
        axes.set_column(axis, &unit);
    }
    let q = nalgebra::UnitQuaternion::from_matrix(&axes);
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    ([sign * q.i, sign * q.j, sign * q.k], qfac)
}

/// An NRRD file with its data.
pub fn nrrd(volume: &Volume, encoding: &str, big: bool) -> Vec<u8> {
    let mut file = nrrd_header(volume, encoding, big).into_bytes();
    file.push(b'\n');
    file.extend(match encoding {
        "gzip" => gzip(&volume.bytes(big)),
        "ascii" => volume.values.iter().map(|x| format!("{x} ")).collect::<String>().into_bytes(),
        _ => volume.bytes(big),
    });
    file
}

/// The header of an NRRD file.
pub fn nrrd_header(volume: &Volume, encoding: &str, big: bool) -> String {
    let [nx, ny, nz] = volume.dims;
    let vector = |[x, y, z]: [f64; 3]| format!("({x:.17},{y:.17},{z:.17})");
    let steps = [0, 1, 2].map(|axis| {
        let step = volume.axes.column(axis);
        vector([-step.x, -step.y, step.z])
    });
    format!(
        "NRRD0004\n# a comment\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: {nx} {ny} {nz}\n\
         space directions: {}\nkinds: domain domain domain\nendian: {}\nencoding: {encoding}\nkey:=value\n\
         space origin: {}\n",
        steps.join(" "),
        if big { "big" } else { "little" },
        vector(volume.origin_lps())
    )
}

/// A MetaImage file; its data are in `data_file`, or `LOCAL`.
pub fn metaimage(volume: &Volume, compressed: bool, big: bool, data_file: &str) -> Vec<u8> {
    let [nx, ny, nz] = volume.dims;
    let numbers = |values: &[f64]| values.iter().map(|x| format!("{x:.17}")).collect::<Vec<_>>().join(" ");
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = {}\nCompressedData = {}\n\
         TransformMatrix = {}\nOffset = {}\nCenterOfRotation = 0 0 0\nElementSpacing = {}\nDimSize = {nx} {ny} {nz}\n\
         ElementType = MET_SHORT\nElementDataFile = {data_file}\n",
        if big { "True" } else { "False" },
        if compressed { "True" } else { "False" },
        numbers(&volume.directions_lps().concat()),
        numbers(&volume.origin_lps()),
        numbers(&volume.spacing())
    );
    let mut file = header.into_bytes();
    if data_file == "LOCAL" {
        file.extend(metaimage_data(volume, compressed, big));
    }
    file
}

/// The data of a MetaImage file.
pub fn metaimage_data(volume: &Volume, compressed: bool, big: bool) -> Vec<u8> {
    let bytes = volume.bytes(big);
    if compressed {
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
        packed.write_all(&bytes).unwrap();
        packed.finish().unwrap()
    } else {
        bytes
    }
}

/// GIPL has no orientation: only spacing and origin are written.
pub fn gipl(volume: &Volume) -> Vec<u8> {
    let mut header = Bytes { bytes: vec![0; 256], big: true };
    for (at, n) in [volume.dims[0], volume.dims[1], volume.dims[2], 1].into_iter().enumerate() {
        header.put(2 * at, (n as u16).to_le_bytes());
    }
    header.put(8, 15_u16.to_le_bytes());
    for (axis, h) in volume.spacing().into_iter().enumerate() {
        header.put(10 + 4 * axis, (h as f32).to_le_bytes());
        header.put(204 + 8 * axis, volume.origin_lps()[axis].to_le_bytes());
    }
    header.put(252, 0xEFFF_E9B0_u32.to_le_bytes());
    header.bytes.extend(volume.bytes(true));
    header.bytes
}

/// Encodings of DICOM.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Syntax {
    /// Little-endian, value representations left out.
    Implicit,
    /// Little-endian, with value representations.
    Explicit,
    /// Little-endian, with value representations, compressed.
    Deflated,
    /// Big-endian, with value representations.
    BigEndian,
}

impl Syntax {
    fn uid(self) -> &'static str {
        match self {
            Self::Implicit => "1.2.840.10008.1.2",
            Self::Explicit => "1.2.840.10008.1.2.1",
            Self::Deflated => "1.2.840.10008.1.2.1.99",
            Self::BigEndian => "1.2.840.10008.1.2.2",
        }
    }
}

/// Elements of DICOM in an encoding.
struct Elements {
    bytes: Vec<u8>,
    syntax: Syntax,
}

impl Elements {
    fn new(syntax: Syntax) -> Self {
        Self { bytes: Vec::new(), syntax }
    }

    fn short(&mut self, number: u16) {
        let is_big = self.syntax == Syntax::BigEndian;
        self.bytes.extend(if is_big { number.to_be_bytes() } else { number.to_le_bytes() });
    }

    fn long(&mut self, number: u32) {
        let is_big = self.syntax == Syntax::BigEndian;
        self.bytes.extend(if is_big { number.to_be_bytes() } else { number.to_le_bytes() });
    }

    fn tag(&mut self, tag: u32) {
        self.short((tag >> 16) as u16);
        self.short(tag as u16);
    }

    fn put(&mut self, tag: u32, vr: &[u8; 2], value: &[u8]) {
        self.tag(tag);
        let mut value = value.to_vec();
        if value.len() % 2 == 1 {
            value.push(if vr == b"UI" { 0 } else { b' ' });
        }
        // Sequences are written with undefined length; their delimiters are in the value.
        let length = if vr == b"SQ" { u32::MAX } else { value.len() as u32 };
        if self.syntax == Syntax::Implicit {
            self.long(length);
        } else {
            self.bytes.extend(vr);
            if matches!(vr, b"OW" | b"SQ") {
                self.bytes.extend([0, 0]);
                self.long(length);
            } else {
                self.short(length as u16);
            }
        }
        self.bytes.extend(value);
    }

    fn count(&mut self, tag: u32, number: usize) {
        let mut value = Self::new(self.syntax);
        value.short(number as u16);
        self.put(tag, b"US", &value.bytes);
    }

    fn decimals(&mut self, tag: u32, values: &[f64]) {
        let words: Vec<String> = values.iter().map(|x| format!("{x:.14}")).collect();
        self.put(tag, b"DS", words.join("\\").as_bytes());
    }

    fn sequence(&mut self, tag: u32, items: &[Self]) {
        let mut content = Self::new(self.syntax);
        for item in items {
            content.tag(0xFFFE_E000);
            content.long(item.bytes.len() as u32);
            content.bytes.extend(&item.bytes);
        }
        content.tag(0xFFFE_E0DD);
        content.long(0);
        self.put(tag, b"SQ", &content.bytes);
    }

    /// A file of these elements.
    fn file(self) -> Vec<u8> {
        let mut file = Self { bytes: vec![0; 128], syntax: Syntax::Explicit };
        file.bytes.extend(b"DICM");
        file.put(0x0002_0010, b"UI", self.syntax.uid().as_bytes());
        file.bytes.extend(match self.syntax {
            Syntax::Deflated => {
                let mut packed = DeflateEncoder::new(Vec::new(), Compression::fast());
                packed.write_all(&self.bytes).unwrap();
                packed.finish().unwrap()
            }
            _ => self.bytes,
        });
        file.bytes
    }
}

/// The slice `k` of a volume.
pub fn dicom(volume: &Volume, k: usize, syntax: Syntax, series: &str) -> Vec<u8> {
    let [row, column, _] = volume.directions_lps();
    let [along, down, _] = volume.spacing();
    let mut set = Elements::new(syntax);
    set.put(0x0008_103E, b"LO", b"a test ");
    // A sequence with its own position, different from the slice's.
    set.put(0x0008_1140, b"SQ", &nested(syntax));
    set.put(0x0020_000E, b"UI", series.as_bytes());
    set.decimals(0x0020_0032, &volume.slice_lps(k));
    set.decimals(0x0020_0037, &[row, column].concat());
    set.count(0x0028_0002, 1);
    set.put(0x0028_0004, b"CS", b"MONOCHROME2");
    set.count(0x0028_0010, volume.dims[1]);
    set.count(0x0028_0011, volume.dims[0]);
    set.decimals(0x0028_0030, &[down, along]);
    set.count(0x0028_0100, 16);
    set.count(0x0028_0101, 16);
    set.count(0x0028_0102, 15);
    set.count(0x0028_0103, 1);
    let plane = volume.dims[0] * volume.dims[1];
    let slice = Volume { values: volume.values[k * plane..(k + 1) * plane].to_vec(), ..volume.clone() };
    set.put(0x7FE0_0010, b"OW", &slice.bytes(syntax == Syntax::BigEndian));
    set.file()
}

/// The encoding of the inside in a segmentation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segments {
    /// A bit a voxel.
    Bits,
    /// A byte a pixel, 200 at most; half of it and more is inside.
    Fractions,
    /// A number a pixel.
    Labels,
}

/// A segmentation of the labels of a volume by PS3.3 C.8.20, with the names of its segments. Frames without
/// any voxel are left out.
pub fn segmentation(volume: &Volume, kind: Segments, names: &[&str], syntax: Syntax) -> Vec<u8> {
    let (frames, pixels) = frames(volume, kind, names.len(), syntax);
    let (class, word, bits) = match kind {
        Segments::Bits => ("1.2.840.10008.5.1.4.1.1.66.4", "BINARY", 1),
        Segments::Fractions => ("1.2.840.10008.5.1.4.1.1.66.4", "FRACTIONAL", 8),
        Segments::Labels => ("1.2.840.10008.5.1.4.1.1.66.7", "LABELMAP", 8),
    };
    let named = (1..).zip(names).map(|(label, name)| {
        let mut segment = Elements::new(syntax);
        segment.count(0x0062_0004, label);
        segment.put(0x0062_0005, b"LO", name.as_bytes());
        segment
    });
    let mut set = Elements::new(syntax);
    set.put(0x0008_0016, b"UI", class.as_bytes());
    set.put(0x0020_000E, b"UI", b"1.9");
    set.count(0x0028_0002, 1);
    set.put(0x0028_0004, b"CS", b"MONOCHROME2");
    set.put(0x0028_0008, b"IS", frames.len().to_string().as_bytes());
    set.count(0x0028_0010, volume.dims[1]);
    set.count(0x0028_0011, volume.dims[0]);
    set.count(0x0028_0100, bits);
    set.count(0x0028_0101, bits);
    set.count(0x0028_0102, bits - 1);
    set.count(0x0028_0103, 0);
    set.put(0x0062_0001, b"CS", word.as_bytes());
    set.sequence(0x0062_0002, &named.collect::<Vec<_>>());
    if kind == Segments::Fractions {
        set.count(0x0062_000E, 200);
    }
    set.sequence(0x5200_9229, &[shared_by_frames(volume, syntax)]);
    set.sequence(0x5200_9230, &frames);
    set.put(0x7FE0_0010, b"OW", &pixels);
    set.file()
}

/// Frames of `segments` segments, and the pixels of all frames.
fn frames(volume: &Volume, kind: Segments, segments: usize, syntax: Syntax) -> (Vec<Elements>, Vec<u8>) {
    let plane = volume.dims[0] * volume.dims[1];
    let segments = if kind == Segments::Labels { 0..=0 } else { 1..=segments };
    let (mut frames, mut pixels) = (Vec::new(), Vec::new());
    for segment in segments {
        let is_in = |value: i16| value != 0 && (segment == 0 || value == segment as i16);
        for (k, values) in volume.values.chunks_exact(plane).enumerate() {
            if !values.iter().any(|&value| is_in(value)) {
                continue;
            }
            let mut place = Elements::new(syntax);
            place.decimals(0x0020_0032, &volume.slice_lps(k));
            let mut which = Elements::new(syntax);
            which.count(0x0062_000B, segment);
            let mut frame = Elements::new(syntax);
            frame.sequence(0x0020_9113, &[place]);
            frame.sequence(0x0062_000A, &[which]);
            frames.push(frame);
            pixels.extend(values.iter().map(|&value| match kind {
                Segments::Labels => value as u8,
                _ => u8::from(is_in(value)),
            }));
        }
    }
    let pixels = match kind {
        Segments::Bits => {
            pixels.chunks(8).map(|bits| bits.iter().rev().fold(0, |byte, bit| byte << 1 | bit)).collect()
        }
        Segments::Fractions => pixels.iter().map(|inside| if *inside == 1 { 100 } else { 99 }).collect(),
        Segments::Labels => pixels,
    };
    (frames, pixels)
}

/// Directions and spacing of all frames.
fn shared_by_frames(volume: &Volume, syntax: Syntax) -> Elements {
    let ([row, column, _], [along, down, between]) = (volume.directions_lps(), volume.spacing());
    let mut directions = Elements::new(syntax);
    directions.decimals(0x0020_0037, &[row, column].concat());
    let mut measures = Elements::new(syntax);
    measures.decimals(0x0018_0050, &[between]);
    measures.decimals(0x0018_0088, &[between]);
    measures.decimals(0x0028_0030, &[down, along]);
    let mut shared = Elements::new(syntax);
    shared.sequence(0x0020_9116, &[directions]);
    shared.sequence(0x0028_9110, &[measures]);
    shared
}

/// A structure set: contours, no pixels.
pub fn structure_set() -> Vec<u8> {
    let mut set = Elements::new(Syntax::Explicit);
    set.put(0x0008_0016, b"UI", b"1.2.840.10008.5.1.4.1.1.481.3");
    set.put(0x3006_0002, b"SH", b"organs");
    set.file()
}

/// An item of undefined length with ImagePositionPatient in it, ended by its delimiters.
fn nested(syntax: Syntax) -> Vec<u8> {
    let mut item = Elements::new(syntax);
    item.tag(0xFFFE_E000);
    item.long(u32::MAX);
    item.put(0x0020_0032, b"DS", b"1\\2\\3 ");
    for delimiter in [0xFFFE_E00D, 0xFFFE_E0DD] {
        item.tag(delimiter);
        item.long(0);
    }
    item.bytes
}

/// A block of 24 × 12 × 12 voxels of 1 mm as 3D Slicer writes it. The left half is liver, the right half
/// spleen, and a tumour lies in the middle on a separate layer.
pub fn layered_segmentation() -> Vec<u8> {
    let mut bytes =
        b"NRRD0004\ntype: unsigned char\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 32 20 20\n\
        space directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: list domain domain domain\nencoding: raw\n\
        space origin: (0,0,0)\n\
        Segment0_Name:=liver\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n\
        Segment1_Name:=spleen\nSegment1_LabelValue:=2\nSegment1_Layer:=0\n\
        Segment2_Name:=tumour\nSegment2_LabelValue:=1\nSegment2_Layer:=1\n\n"
            .to_vec();
    for (k, j, i) in (0..20 * 20 * 32).map(|n| (n / 640, n / 32 % 20, n % 32)) {
        let inside = [(i, 4..28), (j, 4..16), (k, 4..16)].into_iter().all(|(at, range)| range.contains(&at));
        let core = [(i, 12..20), (j, 6..14), (k, 6..14)].into_iter().all(|(at, range)| range.contains(&at));
        bytes.extend([if inside { 1 + u8::from(i >= 16) } else { 0 }, u8::from(core)]);
    }
    bytes
}

/// Bytes as gzip compresses them.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(bytes).unwrap();
    packed.finish().unwrap()
}

/// The slices of a volume as files of a folder, in an order that has nothing to do with their places.
pub fn dicom_folder(folder: &Path, volume: &Volume, syntax: Syntax) {
    for k in 0..volume.dims[2] {
        let name = format!("{:02}.dcm", (k * 7 + 3) % 23);
        fs::write(folder.join(name), dicom(volume, k, syntax, "1.2.3.4")).unwrap();
    }
}
