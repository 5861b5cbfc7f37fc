//! Remedies after a failed step. They depend on what the run does already. No text advises a setting that is
//! already on, or more damping where damping is the trouble.

use pliant_format::tables::OnUnstableName;
use pliant_geometry::words::{counted, number};
use pliant_sim::contact::touch::{Contact, With};
use pliant_sim::{Failure, FailureKind, Instant, Precision};

use pliant_format::tables::SolverName;
use pliant_scene::{Built, PlannedParticipant};

/// Damping [1/s] times step [s] above which a step does not resolve the damping. Over a step central
/// differences multiply a velocity by (1 − a) / (1 + a), where a = ½ damping × step. From 2 on the velocity
/// turns round.
const RESOLVED: f64 = 1.0;

/// The remedy of a failed explicit step, where the run's state says more than the failure itself.
pub(crate) fn remedy(failure: &Failure, part: &PlannedParticipant, now: &dyn Instant) -> Option<String> {
    let PlannedParticipant { scene, built, plan, .. } = part;
    if scene.run.solver != SolverName::Explicit || built.implicit.is_some() {
        return None;
    }
    let on_unstable = scene.run.on_unstable.unwrap_or_default();
    let stability = now.stability();
    let step = plan.steps.step / f64::from(1 << stability.halvings);
    if let Some(message) = too_much_damping(failure, built, step) {
        return Some(message);
    }
    let seen = stability.smallest.as_ref().map(|look| look.limit / plan.steps.step);
    let cuts = match stability.halvings {
        0 => "the run already cuts its steps".to_owned(),
        n => format!("the run cuts its steps, went back {} and halved them", counted(n as usize, "time")),
    };
    let shorter = format!("a `step` of {} s or less", number(0.5 * step));
    let message = match (failure.kind, on_unstable) {
        (FailureKind::Unstable, OnUnstableName::Substep) => format!(
            "{cuts}, but even 100 parts are not enough: try a slower or smaller motion, a coarser mesh there, or {shorter}"
        ),
        (FailureKind::Unstable, _) => {
            "try a smaller `step` or a slower motion, or let the run cut its steps (`on-unstable = \"substep\"`)".into()
        }
        (FailureKind::Inverted, OnUnstableName::Substep) => {
            format!("{cuts}: try {shorter}, a slower or smaller motion or load, more damping, or a finer mesh there")
        }
        (FailureKind::Inverted, _) => "try a slower or smaller motion or load, `on-unstable = \"substep\"`, a smaller `step`, more damping, or a finer \
                            mesh there"
            .into(),
        (FailureKind::NotFinite | FailureKind::Unbalanced, OnUnstableName::Report) => {
            let limit = seen.map_or(String::new(), |ratio| format!(" (smallest stable step seen: {ratio:.2} × the step)"));
            format!(
                "try a smaller `step` or `on-unstable = \"substep\"`{limit}; else a slower motion or a smoother curve"
            )
        }
        (FailureKind::NotFinite | FailureKind::Unbalanced, _) => {
            let single = plan.target.precision == Precision::Single;
            let precise = if single { ", or `precision = \"double\"`" } else { "" };
            let held = if on_unstable == OnUnstableName::Substep { &cuts } else { "the step is below the limit" };
            format!("{held}: try {shorter}, a slower motion, a smoother curve or a smaller load{precise}")
        }
        _ => return None,
    };
    Some(message + &pushing(part, now))
}

/// Advice to limit the force of moving tools that touch these bodies and have no limit; empty without such
/// tools.
fn pushing(part: &PlannedParticipant, now: &dyn Instant) -> String {
    let Some(contacts) = &part.built.contacts else { return String::new() };
    let unlimited = |contact: &Contact| {
        let With::Rigid(number) = contact.with else { return None };
        let rigid = &contacts.rigids[number];
        let moves = rigid.trajectory.moves() || now.leg(number).is_some();
        (moves && rigid.trajectory.limit().is_none()).then(|| format!("`{}`", rigid.tool()))
    };
    let mut tools: Vec<String> = contacts.contacts.iter().filter_map(unlimited).collect();
    tools.dedup();
    match tools.is_empty() {
        true => String::new(),
        false => format!("; where {} pushes too hard, give it a `force-limit`", tools.join(" or ")),
    }
}

/// Message if a step is too long for the damping of the body that failed.
fn too_much_damping(failure: &Failure, built: &Built, step: f64) -> Option<String> {
    let body = built.model.bodies.iter().find(|body| failure.body.as_deref() == Some(&body.name))?;
    (body.damping * step > RESOLVED).then(|| {
        format!(
            "the damping of `{}`, {} 1/s, is too strong for steps of {} s: it would reverse velocities; take `damping` below {} 1/s or a \
             `step` below {} s",
            body.name,
            number(body.damping),
            number(step),
            number(RESOLVED / step),
            number(RESOLVED / body.damping)
        )
    })
}
