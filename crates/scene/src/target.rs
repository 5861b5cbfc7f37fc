//! The device of a run: the CPU or a GPU, as requested by the scene and available on the machine.

use pliant_sim::Precision;
#[cfg(feature = "gpu")]
use pliant_sim::gpu::{Design, Device, GpuError, GpuShells, Kind};

use crate::assemble::Built;
use pliant_format::Scene;
use pliant_format::diagnostic::Diagnostic;
use pliant_format::registry::OutputTable;
#[cfg(feature = "gpu")]
use pliant_format::tables::DesignName;
use pliant_format::tables::{
    DeviceName, FieldName, LinearName, PrecisionName, PreconditionerName, RunTable, SolverName,
};

/// The device of a run, and its number type.
#[derive(Clone, Debug)]
pub struct Target {
    /// The GPU; `None`: the CPU.
    #[cfg(feature = "gpu")]
    pub device: Option<Device>,
    /// The number type.
    pub precision: Precision,
    /// Reason why the run uses another device than one might expect.
    pub note: Option<String>,
}

impl Target {
    /// The target that the scene requests; opens the device.
    ///
    /// # Errors
    /// If a GPU is requested, and the machine has no GPU or its GPU can't run the scene.
    pub(crate) fn choose(scene: &Scene, built: &Built) -> Result<Self, Box<Diagnostic>> {
        let run = &scene.run;
        let only = processor_only(scene, built);
        match run.device {
            DeviceName::Cpu => match key_of_gpu(run) {
                None => Ok(Self::processor(run, None)),
                Some(key) => {
                    let message = format!("`{key}` is given, but the scene runs on the CPU");
                    let place = scene.source.span(&scene.run_at(key));
                    let help = format!("set `device = \"gpu\"` or `\"auto\"`, or leave `{key}` out");
                    Err(Box::new(Diagnostic::error(message).at(place, "not used").help(help)))
                }
            },
            DeviceName::Gpu => match only {
                None => Self::gpu(scene, built),
                Some((key, what, help)) => {
                    let error = Diagnostic::error(format!("{what} runs on the CPU only"))
                        .at(scene.source.span(&scene.run_at("device")), "not on a GPU")
                        .also(scene.source.span(&scene.run_at(key)), "requested here");
                    Err(Box::new(error.help(help)))
                }
            },
            DeviceName::Auto => match only {
                Some((_, what, _)) => Ok(Self::processor(run, Some(format!("{what} runs on the CPU only")))),
                None => Self::best(scene, built),
            },
        }
    }

    /// The GPU of the scene.
    #[cfg(feature = "gpu")]
    fn gpu(scene: &Scene, built: &Built) -> Result<Self, Box<Diagnostic>> {
        let run = &scene.run;
        with_design(scene, built)?;
        match open(run) {
            Ok(device) => {
                let software = device.adapter().kind == Kind::Software;
                let note = software.then(|| {
                    format!(
                        "`{}` is software on the CPU: correct, but slower than `device = \"cpu\"`",
                        device.adapter().name
                    )
                });
                Ok(Self::on(device, run, note))
            }
            Err(error) => {
                let key = if run.adapter.is_some() { "adapter" } else { "device" };
                let place = scene.source.span(&scene.run_at(key));
                Err(Box::new(Diagnostic::error(error.to_string()).at(place, "").help(error.remedy())))
            }
        }
    }

    #[cfg(not(feature = "gpu"))]
    fn gpu(scene: &Scene, _built: &Built) -> Result<Self, Box<Diagnostic>> {
        let place = scene.source.span(&scene.run_at("device"));
        let help = "set `device = \"cpu\"`, or build Pliant with the feature `gpu`";
        Err(Box::new(Diagnostic::error(WITHOUT).at(place, "not in this build").help(help)))
    }

    /// A GPU that is one, else the CPU.
    #[cfg(feature = "gpu")]
    fn best(scene: &Scene, built: &Built) -> Result<Self, Box<Diagnostic>> {
        let run = &scene.run;
        with_design(scene, built)?;
        Ok(match open(run) {
            Ok(device) if device.adapter().kind == Kind::Software => {
                let name = &device.adapter().name;
                let note = format!("the only adapter, `{name}`, is software: the run uses the CPU directly");
                Self::processor(run, Some(note))
            }
            Ok(device) => {
                let solved = built.implicit.is_some() && run.solver == SolverName::Implicit;
                let what = if solved { "its equations are solved" } else { "it runs" };
                let note = Some(format!("{what} on `{}`", device.adapter().name));
                Self::on(device, run, note)
            }
            Err(error) => Self::processor(run, Some(format!("{error}: the scene runs on the CPU"))),
        })
    }

    #[cfg(not(feature = "gpu"))]
    fn best(scene: &Scene, _built: &Built) -> Result<Self, Box<Diagnostic>> {
        Ok(Self::processor(&scene.run, Some(format!("{WITHOUT}: the scene runs on the CPU"))))
    }

    /// Explicit steps in single precision; equations, whose device works for a state in double precision.
    #[cfg(feature = "gpu")]
    fn on(device: Device, run: &RunTable, note: Option<String>) -> Self {
        let solved = run.solver == SolverName::Implicit;
        let precision = if solved { Precision::Double } else { Precision::Single };
        Self { device: Some(device), precision, note }
    }

    fn processor(run: &RunTable, note: Option<String>) -> Self {
        Self {
            #[cfg(feature = "gpu")]
            device: None,
            precision: run.precision.map_or(Precision::Double, precision),
            note,
        }
    }

    /// True for a GPU.
    pub fn is_gpu(&self) -> bool {
        #[cfg(feature = "gpu")]
        return self.device.is_some();
        #[cfg(not(feature = "gpu"))]
        return false;
    }

    /// `cpu`, or the name of the GPU.
    pub fn name(&self) -> &str {
        #[cfg(feature = "gpu")]
        if let Some(device) = &self.device {
            return &device.adapter().name;
        }
        "cpu"
    }
}

/// The number type of a word.
fn precision(name: PrecisionName) -> Precision {
    match name {
        PrecisionName::Single => Precision::Single,
        PrecisionName::Double => Precision::Double,
    }
}

/// The design of a word.
#[cfg(feature = "gpu")]
pub(crate) fn design(name: DesignName) -> Design {
    match name {
        DesignName::Gather => Design::Gather,
        DesignName::Blocks => Design::Blocks,
        DesignName::FloatAtomics => Design::FloatAtomics,
        DesignName::Fast => Design::Fast,
    }
}

#[cfg(not(feature = "gpu"))]
const WITHOUT: &str = "this build of Pliant has no GPU support";

/// A key that is for GPUs alone.
fn key_of_gpu(run: &RunTable) -> Option<&'static str> {
    if run.adapter.is_some() {
        return Some("adapter");
    }
    if run.design.is_some() {
        return Some("design");
    }
    None
}

/// Checks that the design that the scene asks for supports the scene.
#[cfg(feature = "gpu")]
fn with_design(scene: &Scene, built: &Built) -> Result<(), Box<Diagnostic>> {
    let place = scene.source.span(&scene.run_at("design"));
    if scene.run.design.is_some() && built.implicit.is_some() {
        let message = "`design` is for explicit solids, but this run has shells or solves equations";
        return Err(Box::new(Diagnostic::error(message).at(place, "not used").help("leave `design` out")));
    }
    let Some(design @ Design::Blocks) = scene.run.design.map(design) else { return Ok(()) };
    let error = match (&built.contacts, built.model.ties.is_empty()) {
        (Some(_), _) => GpuError::NoContact { design: design.to_string() },
        (None, false) => GpuError::NoTies { design: design.to_string() },
        (None, true) => return Ok(()),
    };
    Err(Box::new(Diagnostic::error(error.to_string()).at(place, "").help(error.remedy())))
}

/// Returns a feature of the contacts that a GPU can't support, in words.
fn contact_only(built: &Built) -> Option<String> {
    if !built.meets.is_empty() {
        return Some("contact between participants".into());
    }
    #[cfg(feature = "gpu")]
    return built.contacts.as_deref().and_then(pliant_sim::gpu::processor_only);
    #[cfg(not(feature = "gpu"))]
    return built.contacts.as_ref().map(|_| "contact".to_owned());
}

/// A field of contacts that an output has.
fn contact_field(scene: &Scene) -> Option<FieldName> {
    let fields = |output: &OutputTable| -> Vec<FieldName> {
        match output {
            OutputTable::Vtu(table) => table.data.clone(),
            OutputTable::Csv(table) => table.probes.values().flat_map(|probe| probe.data.clone()).collect(),
        }
    };
    let found = scene.outputs.iter().flat_map(|(_, output)| fields(output));
    found.into_iter().find(|field| field.is_of_contact())
}

/// The key that a GPU can't support, in words, and a remedy.
fn processor_only(scene: &Scene, built: &Built) -> Option<(&'static str, String, &'static str)> {
    let run = &scene.run;
    let leave_out = "set `device = \"cpu\"`, or leave it out";
    if built.implicit.is_some() {
        return match run.solver {
            SolverName::Explicit => shells_only(run, built),
            _ => equations_only(run),
        };
    }
    if let Some(what) = contact_only(built) {
        return Some(("device", what, leave_out));
    }
    if let Some(field) = contact_field(scene) {
        let help = "set `device = \"cpu\"`, or leave the field out";
        return Some(("device", format!("the field `{}` of contacts", field.name()), help));
    }
    if run.solver == SolverName::QuasiStatic {
        let help = "set `device = \"cpu\"`, or `solver = \"explicit\"`";
        return Some(("solver", "the solver `quasi-static`".into(), help));
    }
    if run.precision == Some(PrecisionName::Double) {
        let help = "set `device = \"cpu\"`, or leave `precision` out";
        return Some(("precision", "double precision".into(), help));
    }
    None
}

/// Returns the key of explicit shells that a GPU can't support, in words, and a remedy.
fn shells_only(run: &RunTable, built: &Built) -> Option<(&'static str, String, &'static str)> {
    let help = "set `device = \"cpu\"`, or leave it out";
    if !built.meets.is_empty() {
        return Some(("device", "contact between participants".into(), help));
    }
    if run.precision == Some(PrecisionName::Double) {
        return Some((
            "precision",
            "double precision".into(),
            "set `device = \"cpu\"`, or leave `precision` out",
        ));
    }
    #[cfg(feature = "gpu")]
    if let Some(what) = built.implicit.as_ref().and_then(|bodies| GpuShells::unsupported(&bodies.model)) {
        return Some(("device", what, help));
    }
    None
}

/// Returns the key of shells, or of solids whose equations are solved, that a GPU can't support. A GPU solves
/// the equations of implicit steps by conjugate gradients.
fn equations_only(run: &RunTable) -> Option<(&'static str, String, &'static str)> {
    let help = "set `device = \"cpu\"`, or `solver = \"implicit\"` with `linear = \"conjugate-gradients\"`";
    match run.solver {
        SolverName::Implicit => {}
        SolverName::Static => return Some(("solver", "the solver `static`".into(), help)),
        SolverName::QuasiStatic => return Some(("solver", "the solver `quasi-static`".into(), help)),
        SolverName::Explicit => return None,
    }
    let table = run.linear.table();
    let by = match table.by {
        LinearName::ConjugateGradients => None,
        LinearName::Direct => Some("`direct`"),
        LinearName::Unsymmetric => Some("`unsymmetric`"),
    };
    if let Some(by) = by {
        let help = "set `device = \"cpu\"`, or `linear = \"conjugate-gradients\"`";
        return Some(("linear", format!("the linear solver {by}"), help));
    }
    if table.preconditioner == PreconditionerName::LaggedFactors {
        let help = "set `device = \"cpu\"`, or the preconditioner `aggregates` or `block-jacobi`";
        return Some(("linear", "the preconditioner `lagged-factors`".into(), help));
    }
    None
}

#[cfg(feature = "gpu")]
fn open(run: &RunTable) -> Result<Device, GpuError> {
    Device::open(run.adapter.as_deref())
}
