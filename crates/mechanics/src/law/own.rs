//! Laws that are not in the registry: a program gives its own. They are computed in double precision, a point
//! at a time, by every solver on the CPU. A law that should run in lanes and on a GPU belongs into the
//! registry.

use std::fmt;

use super::{AnyLaw, Deformation, Law, MOST_FAMILIES, Shader, SmallStrainModuli, Split};
use crate::Number;
use crate::tensor::{Symmetric, Tensor, Vector};

/// An elastic law of one's own.
///
/// ```
/// use pliant_mechanics::law::{AnyLaw, Deformation, OwnLaw, SmallStrainModuli, Split};
/// use pliant_mechanics::tensor::{Symmetric, Vector};
///
/// /// Hooke's law in the Green–Lagrange strain E: Ψ = μ E:E + ½ λ (tr E)².
/// #[derive(Debug)]
/// struct Hooke {
///     shear: f64, // Pa
///     lame: f64,  // Pa
/// }
///
/// impl OwnLaw for Hooke {
///     fn name(&self) -> &'static str {
///         "hooke"
///     }
///     fn energy(&self, deformation: &Deformation<f64>, _fibres: &[Vector<f64>]) -> Split<f64> {
///         let strain = deformation.strain_twice * 0.5;
///         let isochoric = self.shear * strain.commuting_product(&strain).trace();
///         Split { isochoric, volumetric: 0.5 * self.lame * strain.trace().powi(2) }
///     }
///     fn stress(&self, deformation: &Deformation<f64>, _fibres: &[Vector<f64>]) -> Split<Symmetric<f64>> {
///         let strain = deformation.strain_twice * 0.5;
///         let volumetric = Symmetric::IDENTITY * (self.lame * strain.trace());
///         Split { isochoric: strain * (2.0 * self.shear), volumetric }
///     }
///     fn small_strain(&self) -> SmallStrainModuli {
///         SmallStrainModuli { shear: self.shear, bulk: self.lame + 2.0 / 3.0 * self.shear }
///     }
/// }
///
/// let law = AnyLaw::own(Hooke { shear: 1000.0, lame: 4000.0 });
/// assert_eq!((law.name(), law.longitudinal_modulus()), ("hooke", 6000.0));
/// ```
pub trait OwnLaw: fmt::Debug + Send + Sync + 'static {
    /// Its name in messages.
    fn name(&self) -> &'static str;

    /// Strain energy per reference volume [J/m³]; see [`Law::energy`].
    fn energy(&self, deformation: &Deformation<f64>, fibres: &[Vector<f64>]) -> Split<f64>;

    /// Second Piola–Kirchhoff stress [Pa], the derivative of the energy by the Green–Lagrange strain; see
    /// [`Law::stress`].
    fn stress(&self, deformation: &Deformation<f64>, fibres: &[Vector<f64>]) -> Split<Symmetric<f64>>;

    /// Moduli at rest; see [`Law::small_strain`].
    fn small_strain(&self) -> SmallStrainModuli;

    /// Families of fibres, each with a direction in every cell; two at the most.
    fn families(&self) -> usize {
        0
    }

    /// True if the volumetric stress is J U′(J) C⁻¹; elements that average pressures refuse other laws.
    fn has_volumetric_energy(&self) -> bool {
        false
    }

    /// An upper bound of ρc² at rest [Pa], which the critical time step takes; see
    /// [`Law::longitudinal_modulus`]. A law with fibres adds their stiffness.
    fn longitudinal_modulus(&self) -> f64 {
        let SmallStrainModuli { shear, bulk } = self.small_strain();
        bulk + 4.0 / 3.0 * shear
    }
}

/// A user's law among the others.
#[derive(Clone, Copy)]
pub struct Own(&'static dyn OwnLaw);

impl AnyLaw {
    /// Makes a law of a user's law. It stays in memory as long as the program runs.
    pub fn own(law: impl OwnLaw) -> Self {
        Self::Own(Own(Box::leak(Box::new(law))))
    }
}

impl Own {
    pub(super) fn name(&self) -> &'static str {
        self.0.name()
    }

    pub(super) fn has_volumetric_energy(&self) -> bool {
        self.0.has_volumetric_energy()
    }
}

impl fmt::Debug for Own {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl PartialEq for Own {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::addr_eq(self.0, other.0)
    }
}

/// Numbers of a deformation and of the directions of fibres, one after the other.
const GIVEN: usize = 25 + 3 * MOST_FAMILIES;

fn given<R: Number>(deformation: &Deformation<R>, fibres: &[Vector<R>]) -> [R; GIVEN] {
    let Deformation { gradient, strain_twice, inverse_strain, .. } = deformation;
    let measures = [
        deformation.volume_ratio,
        deformation.volume_change,
        deformation.isochoric_factor,
        deformation.isochoric_change,
    ];
    let tensors = gradient.0.iter().flatten().chain(&strain_twice.0).chain(&inverse_strain.0);
    let mut flat = [R::ZERO; GIVEN];
    let numbers = tensors.chain(&measures).chain(fibres.iter().flatten());
    flat.iter_mut().zip(numbers).for_each(|(to, from)| *to = *from);
    flat
}

fn taken(flat: &[f64; GIVEN]) -> (Deformation<f64>, [Vector<f64>; MOST_FAMILIES]) {
    let three = |at: usize| [flat[at], flat[at + 1], flat[at + 2]];
    let six = |at: usize| Symmetric(std::array::from_fn(|k| flat[at + k]));
    let inverse_strain = six(15);
    let deformation = Deformation {
        gradient: Tensor([three(0), three(3), three(6)]),
        strain_twice: six(9),
        inverse_strain,
        inverse_cauchy_green: (-inverse_strain).plus_isotropic(1.0),
        volume_ratio: flat[21],
        volume_change: flat[22],
        isochoric_factor: flat[23],
        isochoric_change: flat[24],
    };
    (deformation, std::array::from_fn(|family| three(25 + 3 * family)))
}

impl Law for Own {
    fn energy<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> Split<R> {
        let families = fibres.len().min(MOST_FAMILIES);
        let [isochoric, volumetric] = R::lane_by_lane(given(deformation, fibres), |flat| {
            let (deformation, fibres) = taken(&flat);
            let energy = self.0.energy(&deformation, &fibres[..families]);
            [energy.isochoric, energy.volumetric]
        });
        Split { isochoric, volumetric }
    }

    fn stress<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> Split<Symmetric<R>> {
        let families = fibres.len().min(MOST_FAMILIES);
        let both: [R; 12] = R::lane_by_lane(given(deformation, fibres), |flat| {
            let (deformation, fibres) = taken(&flat);
            let Split { isochoric, volumetric } = self.0.stress(&deformation, &fibres[..families]);
            std::array::from_fn(|k| if k < 6 { isochoric.0[k] } else { volumetric.0[k - 6] })
        });
        let six = |first: usize| Symmetric(std::array::from_fn(|k| both[first + k]));
        Split { isochoric: six(0), volumetric: six(6) }
    }

    fn shader(&self) -> Option<Shader> {
        None
    }

    fn families(&self) -> usize {
        self.0.families()
    }

    fn small_strain(&self) -> SmallStrainModuli {
        self.0.small_strain()
    }

    fn longitudinal_modulus(&self) -> f64 {
        self.0.longitudinal_modulus()
    }

    fn fibre_modulus(&self) -> f64 {
        let SmallStrainModuli { shear, bulk } = self.0.small_strain();
        (self.0.longitudinal_modulus() - bulk - 4.0 / 3.0 * shear).max(0.0)
    }
}
