//! 5: a law of one's own: quadratic in the strain and in the logarithm of the volume, on a cube stretched
//! between plates.
//!
//! Run: `cargo run --release --bin 5-own-law`
//!
//! Read before: 2 and `docs/develop/add-a-law.md`.

use std::error::Error;

use pliant_mechanics::Model;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::law::{AnyLaw, Deformation, OwnLaw, SmallStrainModuli, Split};
use pliant_mechanics::model::{Cells, Material, Motion, Solid};
use pliant_mechanics::tensor::{Symmetric, Vector};
use pliant_sim::{ParticipantSetup, Simulation};

/// Ψ = μ E:E + ½ λ ln² J, with S = 2 μ E + λ ln J C⁻¹.
#[derive(Debug)]
struct Logarithmic {
    /// Shear modulus μ [Pa].
    shear: f64,
    /// Lamé's first parameter λ [Pa].
    lame: f64,
}

impl OwnLaw for Logarithmic {
    fn name(&self) -> &'static str {
        "logarithmic"
    }

    fn energy(&self, deformation: &Deformation<f64>, _fibres: &[Vector<f64>]) -> Split<f64> {
        let strain = deformation.strain_twice * 0.5;
        Split {
            isochoric: self.shear * strain.commuting_product(&strain).trace(),
            volumetric: 0.5 * self.lame * deformation.volume_change.ln_1p().powi(2),
        }
    }

    fn stress(&self, deformation: &Deformation<f64>, _fibres: &[Vector<f64>]) -> Split<Symmetric<f64>> {
        Split {
            isochoric: deformation.strain_twice * self.shear,
            volumetric: deformation.inverse_cauchy_green * (self.lame * deformation.volume_change.ln_1p()),
        }
    }

    fn small_strain(&self) -> SmallStrainModuli {
        SmallStrainModuli { shear: self.shear, bulk: self.lame + 2.0 / 3.0 * self.shear }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let cube = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let points = cube.map(|corner| corner.map(|x| 0.1 * f64::from(x)));

    let mut model = Model::default();
    let body = model.add_body("cube", &points);
    let (shear, lame) = (1000.0, 4000.0);
    let law = AnyLaw::own(Logarithmic { shear, lame });
    let cells = Cells::full_hex8(vec![[0, 1, 2, 3, 4, 5, 6, 7]], &model.rest);
    model.add_solid(Solid::new(body, Material::elastic(law, 1000.0), cells));
    model.fix("base", vec![0, 1, 2, 3]);
    let pull = Curve { shape: Shape::Ramp, from: 0.0, to: 1.0 };
    model.constrain("top", vec![4, 5, 6, 7], Motion::Displacement([0.0, 0.0, 0.03], pull));

    let mut simulation = Simulation::new(ParticipantSetup::quasi_static("cube", model, 1.0, 3))?;
    let mut worst = 0.0_f64;
    simulation.run(1.0, |now| {
        // Both faces are held: P₃₃ = F₃₃ S₃₃ at the stretch of the cube, times the area.
        let stretch = 1.0 + 0.3 * now.time();
        let stress = shear * (stretch * stretch - 1.0) + lame * stretch.ln() / (stretch * stretch);
        let (exact, found) =
            (stretch * stress * 0.01, now.reaction("top").map_or(f64::NAN, |force| force[2]));
        println!("stretched by {:.0} %: {found:.4} N, exactly {exact:.4} N", 100.0 * (stretch - 1.0));
        worst = worst.max((found - exact).abs());
    })?;
    if worst < 1e-4 { Ok(()) } else { Err(format!("off by {worst} N").into()) }
}
