//! The device of a run: the CPU or a GPU, as requested by the scene and available on the machine.

use pliant_sim::Precision;
#[cfg(feature = "gpu")]
use pliant_sim::gpu::{Device, GpuError, Kind};

use crate::assemble::Built;
use crate::diagnostic::Diagnostic;
use crate::format::{DeviceName, RunTable, SolverName};
use crate::scene::Scene;

/// The device of a run, and its number type.
#[derive(Clone, Debug)]
pub struct Target {
    /// The GPU; `None`: the CPU.
    #[cfg(feature = "gpu")]
    pub device: Option<Device>,
    /// The number type.
    pub precision: Precision,
    /// Why the run uses another device than one might expect.
    pub note: Option<String>,
}

impl Target {
    /// The target that the scene requests; opens the device.
    ///
    /// # Errors
    /// If a GPU is requested, and there is none or it can't run the scene.
    pub(crate) fn choose(scene: &Scene, built: &Built) -> Result<Self, Box<Diagnostic>> {
        let run = &scene.run;
        let (implicit, touches) = (built.implicit.is_some(), built.contacts.is_some());
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
            DeviceName::Gpu => match processor_only(run, implicit, touches) {
                None => Self::gpu(scene),
                Some((key, what, help)) => {
                    let error = Diagnostic::error(format!("{what} runs on the CPU only"))
                        .at(scene.source.span(&scene.run_at("device")), "not for this")
                        .also(scene.source.span(&scene.run_at(key)), "requested here");
                    Err(Box::new(error.help(help)))
                }
            },
            DeviceName::Auto => Ok(match processor_only(run, implicit, touches) {
                Some((_, what, _)) => Self::processor(run, Some(format!("{what} runs on the CPU only"))),
                None => Self::best(run),
            }),
        }
    }

    /// The GPU of the scene.
    #[cfg(feature = "gpu")]
    fn gpu(scene: &Scene) -> Result<Self, Box<Diagnostic>> {
        let run = &scene.run;
        match open(run) {
            Ok(device) => {
                let software = device.adapter().kind == Kind::Software;
                let note = software.then(|| {
                    format!(
                        "`{}` is software on the CPU: correct, but slower than `device = \"cpu\"`",
                        device.adapter().name
                    )
                });
                Ok(Self { device: Some(device), precision: Precision::Single, note })
            }
            Err(error) => {
                let key = if run.adapter.is_some() { "adapter" } else { "device" };
                let place = scene.source.span(&scene.run_at(key));
                Err(Box::new(Diagnostic::error(error.to_string()).at(place, "").help(error.remedy())))
            }
        }
    }

    #[cfg(not(feature = "gpu"))]
    fn gpu(scene: &Scene) -> Result<Self, Box<Diagnostic>> {
        let place = scene.source.span(&scene.run_at("device"));
        let help = "set `device = \"cpu\"`, or build it with the feature `gpu`";
        Err(Box::new(Diagnostic::error(WITHOUT).at(place, "not in this build").help(help)))
    }

    /// A GPU that is one, else the CPU.
    #[cfg(feature = "gpu")]
    fn best(run: &RunTable) -> Self {
        match open(run) {
            Ok(device) if device.adapter().kind == Kind::Software => {
                let name = &device.adapter().name;
                let note = format!("the only adapter, `{name}`, is software: the run uses the CPU directly");
                Self::processor(run, Some(note))
            }
            Ok(device) => {
                let note = Some(format!("it runs on `{}`", device.adapter().name));
                Self { device: Some(device), precision: Precision::Single, note }
            }
            Err(error) => Self::processor(run, Some(format!("{error}: it runs on the CPU"))),
        }
    }

    #[cfg(not(feature = "gpu"))]
    fn best(run: &RunTable) -> Self {
        Self::processor(run, Some(format!("{WITHOUT}: it runs on the CPU")))
    }

    fn processor(run: &RunTable, note: Option<String>) -> Self {
        Self {
            #[cfg(feature = "gpu")]
            device: None,
            precision: run.precision.unwrap_or(Precision::Double),
            note,
        }
    }

    /// Whether it is a GPU.
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

#[cfg(not(feature = "gpu"))]
const WITHOUT: &str = "this build of Pliant has no GPU support";

/// A key that is for GPUs alone.
fn key_of_gpu(run: &RunTable) -> Option<&'static str> {
    if run.adapter.is_some() {
        return Some("adapter");
    }
    #[cfg(feature = "gpu")]
    if run.design.is_some() {
        return Some("design");
    }
    None
}

/// The key that a GPU can't support, in words, and a remedy.
fn processor_only(
    run: &RunTable,
    implicit: bool,
    touches: bool,
) -> Option<(&'static str, &'static str, &'static str)> {
    if implicit {
        let help = "set `device = \"cpu\"`, or leave it out";
        return Some(("device", "the model of shells, `implicit` and `static`", help));
    }
    if touches {
        return Some(("device", "contact", "set `device = \"cpu\"`, or leave it out"));
    }
    if run.solver == SolverName::QuasiStatic {
        let help = "set `device = \"cpu\"`, or `solver = \"explicit\"`";
        return Some(("solver", "the solver `quasi-static`", help));
    }
    if run.precision == Some(Precision::Double) {
        let help = "set `device = \"cpu\"`, or leave `precision` out";
        return Some(("precision", "double precision", help));
    }
    None
}

#[cfg(feature = "gpu")]
fn open(run: &RunTable) -> Result<Device, GpuError> {
    Device::open(run.adapter.as_deref())
}
