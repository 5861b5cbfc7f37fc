//! Failures of solvers in words.

use pliant_geometry::words::number;
use pliant_implicit::SolveError;

use crate::bodies::ImplicitBodies;
use crate::failure::{BlockedDriver, Failure, FailureKind};

/// The report of a step that failed after a time.
pub(super) fn failure(
    error: &SolveError,
    model: &pliant_mechanics::Model,
    bodies: &ImplicitBodies,
    time: f64,
) -> Failure {
    let body_of = |node: u32| model.bodies.iter().find(|body| body.nodes.contains(&node));
    let (kind, node, cell) = match error {
        SolveError::NotConverged { node, .. } => (FailureKind::NotConverged, Some(*node), None),
        SolveError::Uphill { node, .. } => (FailureKind::NotConverged, Some(*node), None),
        SolveError::Snaps { .. } | SolveError::Stalled { .. } => (FailureKind::NotConverged, None, None),
        SolveError::Blocked { .. } => (FailureKind::Blocked, None, None),
        SolveError::Crossed { edge, .. } => (FailureKind::Intersecting, Some(edge[0]), None),
        SolveError::Singular { node, .. } | SolveError::FreeBody { node, .. } => {
            (FailureKind::Singular, Some(*node), None)
        }
        SolveError::Indefinite { .. } => (FailureKind::Unstable, None, None),
        SolveError::Broken { cell, .. } => (FailureKind::Inverted, None, bodies.cell(*cell)),
        SolveError::Stopped => return Failure::stopped(time),
        SolveError::Device(_) => (FailureKind::Device, None, None),
        SolveError::OutOfMemory(_) => (FailureKind::Memory, None, None),
        SolveError::Open(_) | SolveError::Impossible(_) => (FailureKind::Input, None, None),
    };
    let owner = match error {
        SolveError::Snaps { node, .. } => body_of(*node),
        _ => node.and_then(body_of),
    };
    let own_node = node.zip(owner).map(|(node, body)| node - body.nodes.start);
    let body = owner.map(|body| body.name.clone()).or_else(|| Some(model.bodies[cell?.0].name.clone()));
    let place = body.as_ref().map(|name| format!(" in `{name}`")).unwrap_or_default();
    let of_body =
        |cell| bodies.cell(cell).filter(|(owner, _)| body.as_ref() == Some(&model.bodies[*owner].name));
    let renumbered = numbered(error, own_node, |cell| of_body(cell).map(|(_, cell)| cell));
    let slack = node.or_else(|| Some(bodies.model.facets.get(error.broken()?.0)?.nodes[0]));
    let hint = match slack.is_some_and(|node| bodies.is_slack(node)) {
        true => {
            "; a membrane without tension has no transverse stiffness: hold it on all sides, give it `pre-tension`, or take \
             an element with bending"
        }
        false => "",
    };
    let message = format!(
        "after t = {} s{place}: {renumbered}{hint}; what was written before stays readable",
        number(time)
    );
    let element = cell.map(|(_, cell)| cell);
    let blocked = match error {
        SolveError::Blocked { driver: Some((driver, force)), part, gap, .. } => {
            Some(Box::new(BlockedDriver { driver: driver.clone(), force: *force, part: *part, gap: *gap }))
        }
        _ => None,
    };
    let body = body.map(String::into_boxed_str);
    Failure { body, element, node: own_node, blocked, ..Failure::new(kind, message, Some(time)) }
}

/// An error with the numbers that a node and a cell have in their body.
pub(super) fn numbered(
    error: &SolveError,
    own_node: Option<u32>,
    own_cell: impl Fn(usize) -> Option<u32>,
) -> SolveError {
    let mut renumbered = error.clone();
    if let SolveError::NotConverged { node, .. }
    | SolveError::Singular { node, .. }
    | SolveError::Uphill { node, .. }
    | SolveError::FreeBody { node, .. } = &mut renumbered
    {
        *node = own_node.unwrap_or(*node);
    }
    match &mut renumbered {
        SolveError::Broken { cell, .. } => *cell = own_cell(*cell).map_or(*cell, |cell| cell as usize),
        SolveError::NotConverged { broken, .. } => {
            *broken = broken.and_then(|(cell, why)| Some((own_cell(cell)? as usize, why)));
        }
        _ => {}
    }
    renumbered
}
