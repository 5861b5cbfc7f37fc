//! Numbers that distinguish models, part by part and bit for bit, by FNV-1a in 64 bits. They are the same on
//! every machine and in every version of the language.

use std::fmt::{self, Debug, Write};

use crate::model::{Cells, Model, Solid};

/// A hash under way.
struct Fnv(u64);

impl Fnv {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) {
        numbers.into_iter().for_each(|x| self.bytes(&x.to_bits().to_le_bytes()));
    }

    fn indices<'a>(&mut self, indices: impl IntoIterator<Item = &'a u32>) {
        indices.into_iter().for_each(|n| self.bytes(&n.to_le_bytes()));
    }
}

impl Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.bytes(text.as_bytes());
        Ok(())
    }
}

/// The number of whatever writes itself in full, as derived `Debug` does: floating-point numbers come out
/// with all their digits.
pub fn fingerprint(thing: &impl Debug) -> u64 {
    let mut hash = Fnv::new();
    // Writing to a hash cannot fail.
    let _ = write!(hash, "{thing:?}");
    hash.0
}

impl Model {
    /// Each part of the model in words, such as ``load `push` ``, with its number. The material of a body is
    /// all but its mesh: laws, fibres, masses, damping, hourglass control, velocity at the start.
    pub fn fingerprints(&self) -> Vec<(String, u64)> {
        let damping = fingerprint(&self.stiffness_damping);
        let mut parts = vec![("damping by stiffness of solids".into(), damping)];
        for (index, body) in self.bodies.iter().enumerate() {
            let range = body.nodes.start as usize..body.nodes.end as usize;
            let solids = || self.solids.iter().filter(|solid| solid.body == index);
            let mut mesh = Fnv::new();
            mesh.numbers(self.rest[range.clone()].iter().flatten());
            solids().for_each(|solid| add_cells(&mut mesh, solid));
            mesh.indices(&body.shared);
            let mut material = Fnv::new();
            material.numbers([&body.damping]);
            let velocity = self.initial_velocity.iter().skip(range.start).take(range.len());
            material.numbers(velocity.flatten());
            material.numbers(&self.mass[range]);
            for solid in solids() {
                let _ = write!(material, "{:?}", solid.material);
                material.numbers(solid.fibre.iter().flatten());
                (0..solid.cells.len())
                    .for_each(|cell| material.numbers([&solid.cells.hourglass_modulus(cell)]));
                if let Some(shear) = solid.hourglass_growth() {
                    material.numbers([&shear]);
                }
                match &solid.cells {
                    Cells::Membrane(_, sheets) => {
                        material.numbers(sheets.iter().map(|sheet| &sheet.thickness));
                    }
                    Cells::Bar(block, cord) => {
                        material.numbers(block.rest.iter().map(|rest| &rest.volume));
                        let _ = write!(material, "{cord:?}");
                    }
                    _ => {}
                }
            }
            parts.push((format!("mesh of body `{}`", body.name), mesh.0));
            parts.push((format!("material of body `{}`", body.name), material.0));
        }
        let surfaces = self.surfaces.iter();
        parts.extend(surfaces.map(|s| (format!("surface `{}`", s.name), fingerprint(s))));
        parts.extend(self.ties.iter().map(|tie| (format!("tie `{}`", tie.name), fingerprint(tie))));
        let constraints = self.constraints.iter();
        parts.extend(constraints.map(|c| (format!("constraint `{}`", c.name), fingerprint(c))));
        parts.extend(self.loads.iter().map(|load| (format!("load `{}`", load.name), fingerprint(load))));
        parts
    }
}

fn add_cells(hash: &mut Fnv, solid: &Solid) {
    let _ = write!(hash, "{} {}", solid.cells.element(), solid.cells.len());
    hash.indices(&solid.original);
    (0..solid.cells.len()).for_each(|cell| hash.indices(solid.cells.nodes(cell)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_the_published_tables() {
        // Fowler, Noll and Vo's own test vectors.
        let of = |text: &str| {
            let mut hash = Fnv::new();
            hash.bytes(text.as_bytes());
            hash.0
        };
        assert_eq!(of(""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(of("a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(of("foobar"), 0x8594_4171_f739_67e8);
    }
}
