//! Participants of a simulation, and how each is stepped.

use std::sync::Arc;

use pliant_contact::touch::Contacts;
use pliant_explicit::stability::{Monitor, OnUnstable};
#[cfg(feature = "gpu")]
use pliant_gpu::{Design, Device};
use pliant_implicit::{Assembly, DynamicSettings, StaticSettings};
use pliant_linear::memory::room_for;
use pliant_mechanics::Model;
use serde::{Deserialize, Serialize};

use crate::bodies::ImplicitBodies;
use crate::failure::{Failure, FailureKind};
use crate::steps::{Critical, Steps};

/// Number type of the solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// 32-bit numbers: faster, about six digits.
    Single,
    /// 64-bit numbers: the reference.
    Double,
}

impl Precision {
    /// Its word in a scene file.
    pub fn word(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Double => "double",
        }
    }
}

/// A participant: bodies that one stepper advances together, and how it does so.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Nodes, bodies, names of constraints and carried surfaces; solids, too.
    pub model: Arc<Model>,
    /// Method that steps it.
    pub method: Method,
    /// Its steps.
    pub steps: Steps,
}

/// Method that advances the state of a participant from instant to instant.
#[derive(Clone, Debug)]
pub enum Method {
    /// Solids with inertia, by central differences.
    Explicit(Explicit),
    /// Equilibria of solids at the ends of load steps, by dynamic relaxation.
    QuasiStatic {
        /// The number type.
        precision: Precision,
        /// Relative residual of an equilibrium; `None`: the default of the number type.
        tolerance: Option<f64>,
    },
    /// Shells with inertia, by central differences.
    ExplicitShells(Arc<ImplicitBodies>, ShortSteps),
    /// Equilibria of shells and solids at the ends of load steps, by Newton's method.
    Static(Arc<ImplicitBodies>, StaticSettings),
    /// Shells and solids with inertia in long steps; the length of [`Part::steps`] counts.
    Implicit(Arc<ImplicitBodies>, LongSteps),
}

/// Settings of explicit steps of shells.
#[derive(Clone, Debug, Default)]
pub struct ShortSteps {
    /// The GPU that takes them in single precision; `None`: the CPU, in double.
    #[cfg(feature = "gpu")]
    pub device: Option<Device>,
}

/// Settings of implicit steps.
#[derive(Clone, Debug)]
pub struct LongSteps {
    /// Settings of their solution.
    pub settings: DynamicSettings,
    /// The GPU that solves their linear equations; `None`: the CPU.
    #[cfg(feature = "gpu")]
    pub device: Option<Device>,
}

impl From<DynamicSettings> for LongSteps {
    /// Makes long steps on the CPU.
    fn from(settings: DynamicSettings) -> Self {
        Self {
            settings,
            #[cfg(feature = "gpu")]
            device: None,
        }
    }
}

/// Settings of central differences.
#[derive(Clone, Debug)]
pub struct Explicit {
    /// The number type; single on a GPU.
    pub precision: Precision,
    /// Action when the critical time step falls below the step.
    pub on_unstable: OnUnstable,
    /// The critical time step of the assembled model at rest [s]; where it is infinite it is not monitored.
    pub critical_step: f64,
    /// Contacts with rigid things.
    pub contacts: Option<Arc<Contacts>>,
    /// Displacements [m] of all nodes at the start; `None`: at rest.
    pub start: Option<Arc<Vec<[f64; 3]>>>,
    /// The GPU; `None`: the CPU.
    #[cfg(feature = "gpu")]
    pub device: Option<Device>,
    /// Method by which its kernels bring forces from cells to nodes; `None`: the fastest one in measurements.
    #[cfg(feature = "gpu")]
    pub design: Option<Design>,
}

impl Explicit {
    /// The monitor of the critical time step; `None` where every node is held.
    pub(crate) fn monitor(&self, model: &Model) -> Option<Monitor> {
        self.critical_step.is_finite().then(|| Monitor::new(model, self.critical_step, self.on_unstable))
    }
}

impl Method {
    /// Shells, and solids whose equations are solved, with all data that they need in addition to the model.
    pub fn bodies(&self) -> Option<&Arc<ImplicitBodies>> {
        match self {
            Self::ExplicitShells(bodies, _) | Self::Static(bodies, _) | Self::Implicit(bodies, _) => {
                Some(bodies)
            }
            Self::Explicit(_) | Self::QuasiStatic { .. } => None,
        }
    }

    /// Contacts, with their obstacles and tools.
    pub fn contacts(&self) -> Option<&Arc<Contacts>> {
        match self {
            Self::Explicit(explicit) => explicit.contacts.as_ref(),
            Self::Static(bodies, _) | Self::Implicit(bodies, _) => {
                bodies.model.contact.as_ref().map(|contact| &contact.contacts)
            }
            _ => None,
        }
    }

    /// True if its stepper takes forces on nodes from outside; a stepper on a GPU takes none.
    pub(crate) fn takes_forces(&self) -> bool {
        #[cfg(feature = "gpu")]
        if let Self::Explicit(Explicit { device, .. }) = self {
            return device.is_none();
        }
        true
    }

    /// The number type.
    pub fn precision(&self) -> Precision {
        match self {
            Self::Explicit(Explicit { precision, .. }) | Self::QuasiStatic { precision, .. } => *precision,
            #[cfg(feature = "gpu")]
            Self::ExplicitShells(_, ShortSteps { device: Some(_) }) => Precision::Single,
            Self::ExplicitShells(..) | Self::Static(..) | Self::Implicit(..) => Precision::Double,
        }
    }
}

/// Least memory in bytes of a solver for a tet or hex and for a shell, in addition to the model. Growing
/// blocks and plates gave 172, 3,250 and 7,800: the largest memory of `pliant run` less the largest of
/// `pliant check`.
const EXPLICIT_CELL: u64 = 150;
const IMPLICIT_CELL: u64 = 3000;
const IMPLICIT_SHELL: u64 = 7000;

impl Part {
    /// Least memory in bytes of its solver, in addition to the model.
    fn bytes(&self) -> u64 {
        let cells = self.model.cell_count() as u64;
        match &self.method {
            Method::Explicit(_) | Method::QuasiStatic { .. } => EXPLICIT_CELL * cells,
            Method::ExplicitShells(..) => 0,
            Method::Static(bodies, _) | Method::Implicit(bodies, _) => {
                IMPLICIT_CELL * cells + IMPLICIT_SHELL * bodies.model.facets.len() as u64
            }
        }
    }

    /// Checks that the system has room for its solver.
    ///
    /// # Errors
    /// If it has not.
    pub(crate) fn has_room(&self) -> Result<(), Failure> {
        room_for(self.bytes()).map_err(|error| {
            let message = format!("there is no room for the solver: {error}; use a coarser mesh");
            Failure::new(FailureKind::Memory, message, None)
        })
    }

    /// True if its steps are cut where they are too long.
    pub(crate) fn cuts_steps(&self) -> bool {
        let Method::Explicit(settings) = &self.method else { return false };
        settings.on_unstable == OnUnstable::Substep && settings.critical_step.is_finite()
    }

    /// Solids by central differences in double precision on the CPU, for a duration [s]. Steps take 0.9 of
    /// the critical time step, which is monitored: steps are cut where it falls.
    ///
    /// # Errors
    /// If the model has no cells, or constraints that contradict one another.
    pub fn explicit(name: &str, model: impl Into<Arc<Model>>, duration: f64) -> Result<Self, Failure> {
        let model = model.into();
        let critical = Critical::of(&model).map_err(|error| Failure::input(&error))?;
        let critical = critical.ok_or_else(|| Failure::input(&"the model has no cells"))?;
        let settings = Explicit {
            precision: Precision::Double,
            on_unstable: OnUnstable::default(),
            critical_step: critical.assembled.step,
            contacts: None,
            start: None,
            #[cfg(feature = "gpu")]
            device: None,
            #[cfg(feature = "gpu")]
            design: None,
        };
        let steps = Steps::within(duration, critical.automatic());
        Ok(Self { name: name.into(), model, method: Method::Explicit(settings), steps })
    }

    /// Makes a participant of solids with equilibria in double precision, at the ends of equal load steps
    /// within a duration [s].
    pub fn quasi_static(name: &str, model: impl Into<Arc<Model>>, duration: f64, load_steps: u64) -> Self {
        let method = Method::QuasiStatic { precision: Precision::Double, tolerance: None };
        let steps = Steps::within(duration, duration / load_steps.max(1) as f64);
        Self { name: name.into(), model: model.into(), method, steps }
    }

    /// Makes a participant of shells and solids with equilibria by Newton's method, at the ends of equal load
    /// steps within a duration [s].
    pub fn equilibria(name: &str, model: impl Into<Arc<Assembly>>, duration: f64, load_steps: u64) -> Self {
        let assembly = model.into();
        let model = Arc::clone(&assembly.model);
        let bodies = ImplicitBodies::alone(assembly);
        let steps = Steps::within(duration, duration / load_steps.max(1) as f64);
        let method = Method::Static(Arc::new(bodies), StaticSettings::default());
        Self { name: name.into(), model, method, steps }
    }

    /// Shells and solids with inertia by backward Euler, in steps of a length [s] within a duration [s].
    pub fn implicit(name: &str, model: impl Into<Arc<Assembly>>, duration: f64, step: f64) -> Self {
        let assembly = model.into();
        let model = Arc::clone(&assembly.model);
        let bodies = ImplicitBodies::alone(assembly);
        let steps = Steps::within(duration, step);
        let method = Method::Implicit(Arc::new(bodies), DynamicSettings::new(steps.step).into());
        Self { name: name.into(), model, method, steps }
    }
}
