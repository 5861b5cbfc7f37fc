//! The cases: cubes of 0.1 m, each of one element, law, precision and place (threads of the CPU, or a design
//! on a GPU).
//!
//! The edges 10, 16, 25 and 38 are from thesis Fig. 6.7 (1,331 to 59,319 nodes); the larger ones extend to
//! 10⁶ cells. All laws are compared on 21³ × 6 tets (55,566) and 30³ hexes (27,000).

use std::thread;

use pliant_gpu::Design;
use pliant_mechanics::model::{Averaging, Material};
use pliant_mechanics::prony::{Prony, PronyUpdate};
use pliant_mechanics::tissue::{elastic, liver, liver_relaxation, soft_tissue};
use pliant_meshing::VolumeCell;

use crate::specimen::block;
use crate::{HOURGLASS, Hexes, Specimen, Tets};

/// Edge of all cubes [m].
pub(crate) const EDGE: f64 = 0.1;

/// Cells along the edge of the cubes of the series: first the thesis's, then up to 10⁶ cells and more.
const SERIES: [usize; 8] = [10, 16, 25, 38, 56, 70, 100, 126];
/// Number of cubes of the series that the default selection measures.
const THESIS: usize = 4;
/// The most tets of a cube, and the most hexes.
const MOST: usize = 2_100_000;
/// Cells along the edge of the large cubes on a GPU.
const ON_DEVICE: [usize; 2] = [60, 100];
/// Cells along the edge of the cube of `hex8-full`.
const FULL_EDGE: usize = 16;

/// An element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// `tet4`
    Tet4,
    /// `tet4-anp`
    Tet4Anp,
    /// `hex8`
    Hex8,
    /// `hex8-full`
    Hex8Full,
}

impl Element {
    /// Every element.
    pub const ALL: [Self; 4] = [Self::Tet4, Self::Tet4Anp, Self::Hex8, Self::Hex8Full];

    /// Its name in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tet4 => "tet4",
            Self::Tet4Anp => "tet4-anp",
            Self::Hex8 => "hex8",
            Self::Hex8Full => "hex8-full",
        }
    }

    /// Nodes of a cell.
    pub fn nodes(self) -> usize {
        match self {
            Self::Tet4 | Self::Tet4Anp => 4,
            Self::Hex8 | Self::Hex8Full => 8,
        }
    }

    /// Cells of a cube with `edge` grid cells along each edge.
    pub fn cells(self, edge: usize) -> usize {
        edge.pow(3) * if self.nodes() == 4 { 6 } else { 1 }
    }

    /// Cells along the edge of the cube on which all laws are compared.
    fn reference_edge(self) -> usize {
        match self {
            Self::Tet4 | Self::Tet4Anp => 21,
            Self::Hex8 => 30,
            Self::Hex8Full => FULL_EDGE,
        }
    }
}

/// A law with its tissue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawKind {
    /// Neo-Hookean, brain-like: E = 3 kPa, ν = 0.45.
    NeoHookean,
    /// Transversely isotropic, liver-like.
    Fibres,
    /// `NeoHookean`, with half of its isochoric stress relaxing (one Prony term).
    NeoHookeanProny,
    /// `Fibres`, with half of its isochoric stress relaxing.
    FibresProny,
}

impl LawKind {
    /// Every law.
    pub const ALL: [Self; 4] = [Self::NeoHookean, Self::Fibres, Self::NeoHookeanProny, Self::FibresProny];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::NeoHookean => "NH",
            Self::Fibres => "TI",
            Self::NeoHookeanProny => "NH+Prony",
            Self::FibresProny => "TI+Prony",
        }
    }

    /// True if it has fibres.
    pub fn has_fibres(self) -> bool {
        matches!(self, Self::Fibres | Self::FibresProny)
    }

    /// True if it relaxes.
    pub fn relaxes(self) -> bool {
        matches!(self, Self::NeoHookeanProny | Self::FibresProny)
    }

    fn material(self) -> Material {
        let law = if self.has_fibres() { liver() } else { soft_tissue() };
        let prony = if self.relaxes() { liver_relaxation(PronyUpdate::Exact) } else { Prony::default() };
        Material { prony, ..elastic(law) }
    }
}

/// A number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits.
    Single,
    /// 64 bits.
    Double,
}

impl Precision {
    /// Its name in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Double => "double",
        }
    }

    /// Bytes of a number.
    pub fn bytes(self) -> f64 {
        match self {
            Self::Single => 4.0,
            Self::Double => 8.0,
        }
    }
}

/// Number of threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Threads {
    /// One.
    One,
    /// One for each core.
    All,
}

impl Threads {
    /// The number on this machine.
    pub fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::All => thread::available_parallelism().map_or(1, usize::from),
        }
    }
}

/// Place where a case runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On the CPU.
    Processor(Threads),
    /// On the best GPU, with a design.
    Device(Design),
}

/// One thing to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Case {
    /// The element.
    pub element: Element,
    /// The law.
    pub law: LawKind,
    /// Grid cells along the edge of the cube.
    pub edge: usize,
    /// The number type.
    pub precision: Precision,
    /// Place where it runs.
    pub place: Place,
}

impl Case {
    /// Its name on the command line: `tet4-nh-55566`, with `-double` and `-all` unless single on one thread,
    /// or with the design on a GPU.
    pub fn id(&self) -> String {
        let law = self.law.name().to_lowercase().replace('+', "-");
        let precision = if self.precision == Precision::Double { "-double" } else { "" };
        let place = match self.place {
            Place::Processor(Threads::One) => String::new(),
            Place::Processor(Threads::All) => "-all".to_owned(),
            Place::Device(design) => format!("-{design}"),
        };
        format!("{}-{law}-{}{precision}{place}", self.element.name(), self.cells())
    }

    /// Cells of the mesh.
    pub fn cells(&self) -> usize {
        self.element.cells(self.edge)
    }

    /// Nodes of the mesh.
    pub fn nodes(&self) -> usize {
        (self.edge + 1).pow(3)
    }

    /// True if it runs on a GPU.
    pub fn is_on_device(&self) -> bool {
        matches!(self.place, Place::Device(_))
    }

    /// True if the default selection contains it: all laws on one mesh per element, and the thesis's series,
    /// on the CPU.
    pub fn is_default(&self) -> bool {
        let [simplest, richest] = [LawKind::NeoHookean, LawKind::FibresProny].map(|law| self.law == law);
        let reference = self.edge == self.element.reference_edge();
        let Place::Processor(threads) = self.place else { return false };
        match (self.precision, threads) {
            (Precision::Single, _) if reference && self.element != Element::Hex8Full => true,
            (_, Threads::One) if reference => simplest || richest,
            (Precision::Single, Threads::One) => simplest && self.in_series(THESIS),
            (Precision::Single, Threads::All) => (simplest || richest) && self.in_series(THESIS),
            (Precision::Double, _) => false,
        }
    }

    /// True if it belongs to the first `count` of the series of meshes.
    fn in_series(&self, count: usize) -> bool {
        matches!(self.element, Element::Tet4 | Element::Hex8)
            && self.cells() <= MOST
            && SERIES[..count].contains(&self.edge)
    }

    /// The cube, at rest and free.
    pub(crate) fn specimen(&self) -> Specimen {
        let cells = if self.element.nodes() == 4 { VolumeCell::Tet } else { VolumeCell::Hex };
        let tets = match self.element {
            Element::Tet4Anp => Tets::Averaged(Averaging::Nodal),
            _ => Tets::Plain,
        };
        let hexes = match self.element {
            Element::Hex8Full => Hexes::Full,
            _ => Hexes::UniformStrain(HOURGLASS),
        };
        let mesh = block([EDGE; 3], [self.edge; 3], cells);
        Specimen::of_elements(mesh, tets, hexes, &self.law.material(), [0.0, 1.0, 0.0])
    }
}

/// Returns all cases, ordered by element, law, precision and place.
pub fn cases() -> Vec<Case> {
    let mut cases = on_processor();
    cases.extend(on_device());
    cases
}

/// Cases on a GPU: all designs with the simplest and the richest law, on the mesh on which laws are compared
/// and on large meshes.
fn on_device() -> impl Iterator<Item = Case> {
    let kinds = Element::ALL.into_iter().flat_map(|element| {
        [LawKind::NeoHookean, LawKind::FibresProny].into_iter().map(move |law| (element, law))
    });
    kinds.flat_map(|(element, law)| {
        Design::ALL.iter().flat_map(move |&design| {
            let large = matches!(element, Element::Tet4 | Element::Hex8).then_some(ON_DEVICE);
            let edges = [element.reference_edge()].into_iter().chain(large.into_iter().flatten());
            let (precision, place) = (Precision::Single, Place::Device(design));
            edges.map(move |edge| Case { element, law, edge, precision, place })
        })
    })
}

fn on_processor() -> Vec<Case> {
    let mut cases = Vec::new();
    for element in Element::ALL {
        for law in LawKind::ALL {
            for (precision, threads) in [
                (Precision::Single, Threads::One),
                (Precision::Single, Threads::All),
                (Precision::Double, Threads::One),
                (Precision::Double, Threads::All),
            ] {
                let mut edges = SERIES.to_vec();
                edges.push(element.reference_edge());
                edges.sort_unstable();
                edges.dedup();
                let place = Place::Processor(threads);
                let case = |edge| Case { element, law, edge, precision, place };
                cases.extend(edges.into_iter().map(case).filter(|case| {
                    case.edge == element.reference_edge()
                        || precision == Precision::Single
                            && matches!(law, LawKind::NeoHookean | LawKind::FibresProny)
                            && case.in_series(SERIES.len())
                }));
            }
        }
    }
    cases
}

/// The case of an id.
///
/// # Errors
/// If it does not exist: the most similar id.
pub fn find(id: &str) -> Result<Case, String> {
    let (typed, known) = (id.to_lowercase(), cases());
    let likeness = |case: &&Case| strsim::jaro_winkler(&case.id(), &typed);
    match known.iter().find(|case| case.id() == typed) {
        Some(case) => Ok(*case),
        None => {
            let nearest = known.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
            Err(nearest.map_or_else(String::new, Case::id))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_lead_back_to_their_case() {
        let known = cases();
        let mut ids: Vec<String> = known.iter().map(Case::id).collect();
        for (case, id) in known.iter().zip(&ids) {
            assert_eq!(find(&id.to_uppercase()), Ok(*case));
        }
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), known.len());
        assert_eq!(find("tet4-nh-5556").unwrap_err(), "tet4-nh-55566");
    }

    #[test]
    fn the_series_are_the_thesiss_and_lead_beyond_a_million_cells() {
        for (id, nodes) in [("hex8-nh-1000", 1331), ("hex8-nh-54872", 59319), ("tet4-nh-6000", 1331)] {
            let case = find(id).unwrap();
            assert_eq!(case.nodes(), nodes);
            assert!(case.is_default());
        }
        for element in [Element::Tet4, Element::Hex8] {
            assert!(cases().iter().any(|case| case.element == element && case.cells() >= 1_000_000));
        }
    }

    #[test]
    fn the_meshes_have_as_many_nodes_and_cells_as_told() {
        for element in Element::ALL {
            let case = Case { element, edge: 3, ..find("tet4-ti-prony-55566").unwrap() };
            let model = case.specimen().model;
            assert_eq!(model.node_count(), case.nodes());
            let cells = &model.solids[0].cells;
            assert_eq!((cells.len(), cells.element()), (case.cells(), element.name()));
        }
    }
}
