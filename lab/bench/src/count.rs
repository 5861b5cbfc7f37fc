//! Bytes and floating-point operations of a step on the CPU, counted by hand from the formulas.
//!
//! The counts do not hold for GPUs. There each design has arrays and passes of its own for every element.
//! `blocks` computes cells at the borders of blocks several times, and `fast` computes shapes at rest again.
//!
//! **Operations**: every +, −, × and ÷ on real numbers in the formulas of `law/`, `forces/` and the node pass
//! of `node_pass.rs`; a multiply-add is two. Not counted: index arithmetic, comparisons, and repeated
//! subexpressions. With N nodes per cell and 3 numbers per node:
//!
//! | part | operations | |
//! |---|---|---|
//! | u_a − u_0 | 3 (N−1) | |
//! | H = Σ u_a ⊗ B_a | 18 (N−1) | 9 multiply-adds a node |
//! | J − 1 = tr H + II(H) + det H | 29 | 2 + 11 + 14 + 2 |
//! | F, C − I, I − C⁻¹, C⁻¹, J, q | 95 + root | 3 + 42 + 39 (cofactors 18, sums 15, over J² 6) + 3 + 8 |
//! | extremes of deformation | 12 | \|C − I\|² |
//! | isochoric stress NH | 14 | 2 W₁ q and its mean 5, times I − C⁻¹ 6, mean 3 |
//! | fibre stress TI, beyond NH | 52 | q − 1 7, fibre strain 23, part of mean 4, a⊗a 6, multiple 12 |
//! | one Prony term | 36 | change 6, what remains 6, d h + g ΔΦ 18, sum 6 |
//! | volumetric stress | 14 | κ J (J − 1) 2, times C⁻¹ 6, sum 6 |
//! | volumetric stress of an averaged pressure | 45 | cof F 27, times p and sum 18 |
//! | P = F S | 45 | |
//! | V P, f_a = V P B_a, f_0 = −Σ f_a | 9 + 15 (N−1) + 3 (N−2) | |
//! | hourglass control (`hex8`) | 295 | Σ Γ u 48, less H Y 72, energy 26, k q 12, V P 72, Σ Γ k q 60, 5 |
//! | sums of blocks | 3 N | |
//! | a node's step | 79 | per component 24, of which 12 are energies; 7 once |
//!
//! The cofactors belong to C − I. The root is J^(−1/3) by steps of third order, 9 operations each: 18 in
//! single, 27 in double precision. Hourglass control changes V P (72), and tests for corners that may be
//! inverted (5).
//!
//! `tet4-anp` computes J in a separate pass and averages it (6 + 4 per cell, 1 per node); `hex8-full`
//! computes J and the stress at eight points, where f_a = Σ w P B_a takes 18 (N−1) per point.
//!
//! **Bytes**: memory traffic of a step if all intermediate data stay in the caches: a lower bound for any
//! layout. A cell reads its node numbers (2 bytes each), the gradients of all nodes but the first and the
//! volume (3 N − 2 numbers). It also reads the fibre (3), and the hourglass moments, stiffness and reach
//! (14). It reads and writes its history (Φ and h, 6 numbers each). A node reads and writes displacement and
//! increment (12 numbers), and reads mass and damping (2). `tet4-anp` reads its cells twice. Not counted: the
//! copies of a block and its sums, each four numbers per node of a block.

use crate::case::{Case, Element, LawKind, Precision};

/// Operations and bytes of a step per cell, including its share of the nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Count {
    /// Bytes to and from memory.
    pub bytes: f64,
    /// Floating-point operations.
    pub flops: f64,
}

/// Operations and numbers of one element with any law.
struct OfElement {
    /// Points at which the law is evaluated.
    points: f64,
    /// Constants read [numbers].
    constants: f64,
    /// Node numbers read.
    indices: f64,
    /// Numbers read and written per node.
    node_numbers: f64,
    /// Operations per cell except at the points.
    flops: f64,
    /// Operations per point except the cube root and the isochoric stress.
    point_flops: f64,
    /// Operations per node.
    node_flops: f64,
}

/// Operations and numbers of one law at a point.
struct OfLaw {
    /// Fibre directions of a cell [numbers].
    fibre: f64,
    /// History read and written [numbers].
    history: f64,
    /// Operations of the isochoric stress.
    flops: f64,
}

/// Bytes of a node's number.
const INDEX: f64 = 2.0;
const NODE_NUMBERS: f64 = 14.0;
const NODE_FLOPS: f64 = 79.0;

/// u_a − u_0 and H of a cell with N nodes.
const fn gradient(nodes: f64) -> f64 {
    21.0 * (nodes - 1.0)
}

/// f_a, and the blocks' sums of f_a.
const fn forces(nodes: f64) -> f64 {
    9.0 + 15.0 * (nodes - 1.0) + 3.0 * (nodes - 2.0) + 3.0 * nodes
}

/// Gradients and volume.
const fn rest(nodes: f64) -> f64 {
    3.0 * (nodes - 1.0) + 1.0
}

/// J − 1.
const VOLUME_CHANGE: f64 = 29.0;
/// The measures of a deformation from H except the cube root, its extremes, and P.
const POINT: f64 = VOLUME_CHANGE + 95.0 + 12.0 + 45.0;
/// Volumetric stress by the law's own pressure.
const VOLUMETRIC: f64 = 14.0;
/// Volumetric stress by an averaged pressure.
const AVERAGED: f64 = 45.0;
const HOURGLASS: f64 = 295.0;

const fn of_element(element: Element) -> OfElement {
    match element {
        Element::Tet4 => OfElement {
            points: 1.0,
            constants: rest(4.0),
            indices: 4.0,
            node_numbers: NODE_NUMBERS,
            flops: gradient(4.0) + forces(4.0),
            point_flops: POINT + VOLUMETRIC,
            node_flops: NODE_FLOPS,
        },
        Element::Tet4Anp => OfElement {
            points: 1.0,
            constants: 2.0 * rest(4.0),
            indices: 2.0 * 4.0,
            // J_n and p_n stay in the caches; the volume of the node is read.
            node_numbers: NODE_NUMBERS + 1.0,
            flops: 2.0 * gradient(4.0) + VOLUME_CHANGE + 10.0 + forces(4.0),
            point_flops: POINT + AVERAGED,
            node_flops: NODE_FLOPS + 1.0,
        },
        Element::Hex8 => OfElement {
            points: 1.0,
            constants: rest(8.0) + 14.0,
            indices: 8.0,
            node_numbers: NODE_NUMBERS,
            flops: gradient(8.0) + forces(8.0) + HOURGLASS,
            point_flops: POINT + VOLUMETRIC,
            node_flops: NODE_FLOPS,
        },
        Element::Hex8Full => OfElement {
            points: 8.0,
            // Gradients and volumes of eight points, and the volume.
            constants: 8.0 * rest(8.0) + 1.0,
            indices: 8.0,
            node_numbers: NODE_NUMBERS,
            // u_a − u_0, U'(v/V), f_0, the blocks' sums.
            flops: 21.0 + 2.0 + 18.0 + 24.0,
            // H twice; the mean of J; f_a = Σ w P B_a.
            point_flops: 2.0 * 126.0 + VOLUME_CHANGE + 2.0 + POINT + AVERAGED + 9.0 + 18.0 * 7.0,
            node_flops: NODE_FLOPS,
        },
    }
}

const fn of_law(law: LawKind) -> OfLaw {
    let (neo_hookean, fibres, prony) = (14.0, 52.0, 36.0);
    match law {
        LawKind::NeoHookean => OfLaw { fibre: 0.0, history: 0.0, flops: neo_hookean },
        LawKind::Fibres => OfLaw { fibre: 3.0, history: 0.0, flops: neo_hookean + fibres },
        LawKind::NeoHookeanProny => OfLaw { fibre: 0.0, history: 24.0, flops: neo_hookean + prony },
        LawKind::FibresProny => OfLaw { fibre: 3.0, history: 24.0, flops: neo_hookean + fibres + prony },
    }
}

impl Count {
    /// Returns the count of a case on the CPU.
    pub fn of(case: &Case) -> Self {
        let (element, law) = (of_element(case.element), of_law(case.law));
        let nodes_per_cell = case.nodes() as f64 / case.cells() as f64;
        let root = match case.precision {
            Precision::Single => 18.0,
            Precision::Double => 27.0,
        };
        let numbers = element.constants
            + law.fibre
            + element.points * law.history
            + nodes_per_cell * element.node_numbers;
        Self {
            bytes: case.precision.bytes() * numbers + INDEX * element.indices,
            flops: element.flops
                + element.points * (element.point_flops + root + law.flops)
                + nodes_per_cell * element.node_flops,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cases, find};

    /// Bytes and operations of the cells alone, without their share of the nodes.
    fn cells_only(id: &str) -> [f64; 2] {
        let case = find(id).unwrap();
        let (count, nodes) = (Count::of(&case), case.nodes() as f64 / case.cells() as f64);
        let element = of_element(case.element);
        let bytes = count.bytes - nodes * case.precision.bytes() * element.node_numbers;
        [bytes, count.flops - nodes * element.node_flops].map(f64::round)
    }

    #[test]
    fn the_sums_of_the_table_are_those_written_out_by_hand() {
        // 9 + 54, 29 + 95 + 18, 12, 14, 14, 45, 60, 12.
        assert_eq!(cells_only("tet4-nh-55566"), [48.0, 362.0]);
        // The wider root is the only other operation.
        assert_eq!(cells_only("tet4-nh-55566-double"), [88.0, 371.0]);
        assert_eq!(cells_only("tet4-ti-prony-55566"), [48.0 + 12.0 + 96.0, 362.0 + 52.0 + 36.0]);
        // 21 + 126, 142, 12, 14, 14, 45, 132, 24, 295.
        assert_eq!(cells_only("hex8-nh-27000"), [160.0, 825.0]);
    }

    #[test]
    fn every_case_is_counted_and_richer_ones_count_more() {
        for case in cases().into_iter().filter(|case| !case.is_on_device()) {
            let count = Count::of(&case);
            assert!(count.bytes > 50.0 && count.flops > 300.0, "{}", case.id());
            let richer = Count::of(&Case { law: LawKind::FibresProny, ..case });
            assert!(richer.bytes >= count.bytes && richer.flops >= count.flops, "{}", case.id());
            let double = Count::of(&Case { precision: Precision::Double, ..case });
            assert!(double.bytes >= count.bytes && double.flops >= count.flops, "{}", case.id());
        }
    }
}
