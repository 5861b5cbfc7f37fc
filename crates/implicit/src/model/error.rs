//! Errors of models, and reasons why a solver stops.

use pliant_linear::memory::OutOfMemory;

use pliant_linear::DeviceError;
use pliant_shells::Broken;

/// Reason why a part could not be added to a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A quantity out of its range.
    #[error("{what} of `{shell}` is {value}; it must be {range}")]
    OutOfRange {
        /// Name of the part.
        shell: String,
        /// Name of the quantity, with the element where the quantity is one of many.
        what: String,
        /// Its value.
        value: f64,
        /// Range that the value must be in.
        range: &'static str,
    },
    /// A solid that only explicit steps can move.
    #[error("solid `{solid}`: {why}")]
    NoStiffness {
        /// Name of the solid.
        solid: String,
        /// The reason, and what to do instead.
        why: &'static str,
    },
    /// Not one value and not one a cell.
    #[error("shell `{shell}` has {cells} elements and {given} {what}; give one, or one for each element")]
    Count {
        /// Name of the part.
        shell: String,
        /// `thicknesses`, `materials` or `directions`.
        what: &'static str,
        /// Elements.
        cells: usize,
        /// Values given.
        given: usize,
    },
    /// A node that does not exist.
    #[error("element {cell} of `{shell}` uses node {node}, but there are {nodes} nodes")]
    NoSuchNode {
        /// Name of the part.
        shell: String,
        /// Element.
        cell: usize,
        /// Node asked for.
        node: u32,
        /// Nodes of the model.
        nodes: usize,
    },
    /// An element without area or volume, or turned inside out.
    #[error(
        "element {cell} of `{shell}` is degenerate: its {what} is {value:.3e}; merge or remove its nodes"
    )]
    Degenerate {
        /// Name of the part.
        shell: String,
        /// Element.
        cell: usize,
        /// Area [m²] or volume [m³].
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// An edge of more than two triangles.
    #[error(
        "{count} triangles of `{shell}` meet in the edge of nodes {} and {}; allow branches if that is \
         meant, or remove the surplus", edge[0], edge[1]
    )]
    Branch {
        /// Name of the part.
        shell: String,
        /// Nodes of the edge.
        edge: [u32; 2],
        /// Triangles at it.
        count: usize,
    },
    /// Layers without a direction.
    #[error(
        "the direction of the layers of `{shell}` is perpendicular to element {cell}, or zero, so the angles \
         of the layers are undefined there; choose another direction"
    )]
    Direction {
        /// Name of the part.
        shell: String,
        /// An element.
        cell: usize,
    },
    /// A given normal that does not point away from the surface.
    #[error(
        "the normal given at node {node} of `{shell}` does not point away from the surface at element {cell}"
    )]
    Normal {
        /// Name of the part.
        shell: String,
        /// Node.
        node: u32,
        /// An element at it.
        cell: usize,
    },
    /// A surface with one side only.
    #[error(
        "shell `{shell}` has only one side, like a Möbius strip: its triangles cannot all have the same \
         orientation at the edge of nodes {} and {}; cut it there", edge[0], edge[1]
    )]
    OneSided {
        /// Name of the part.
        shell: String,
        /// Nodes of the edge.
        edge: [u32; 2],
    },
    /// A surface that encloses nothing.
    #[error("a balloon must be closed, but its surface has {} open border{}: {}", loops.len(),
        if loops.len() == 1 { "" } else { "s" }, borders(loops))]
    Open {
        /// Nodes along each border.
        loops: Vec<Vec<u32>>,
    },
}

/// The first borders with their first nodes.
fn borders(loops: &[Vec<u32>]) -> String {
    let border = |nodes: &Vec<u32>| {
        let first: Vec<String> = nodes.iter().take(5).map(u32::to_string).collect();
        let more = if nodes.len() > 5 { ", …" } else { "" };
        format!("{} nodes ({}{more})", nodes.len(), first.join(", "))
    };
    let descriptions: Vec<String> = loops.iter().take(3).map(border).collect();
    descriptions.join("; ") + if loops.len() > 3 { "; …" } else { "" }
}

/// Reason why a solver stopped. The state holds all that was found before.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Nothing holds a part.
    #[error(
        "the part with node {node} is free in {free_modes} of 6 rigid motions; fix more of its nodes, or tie it to points \
         with springs"
    )]
    FreeBody {
        /// A node of the part.
        node: u32,
        /// Rigid motions without resistance, 1 to 6.
        free_modes: usize,
    },
    /// No stiffness against some motion.
    #[error(
        "the stiffness is singular: node {node} can move in {component} without resistance (pivot {pivot:.1e} of the \
         diagonal); hold it, or give its elements stiffness in that direction"
    )]
    Singular {
        /// The node.
        node: u32,
        /// `x`, `y`, `z`, or a rotation about one of these axes.
        component: &'static str,
        /// The pivot over the diagonal entry.
        pivot: f64,
    },
    /// Conjugate gradients met a direction of negative stiffness.
    #[error(
        "the stiffness is not positive definite (found after {iterations} iterations of conjugate gradients): the \
         body buckles; use the direct solver, smaller load steps or a dynamic solver"
    )]
    Indefinite {
        /// Iterations until then.
        iterations: usize,
    },
    /// Conjugate gradients did not reach their tolerance.
    #[error(
        "conjugate gradients stopped at a residual of {residual:.1e} after {iterations} iterations; allow \
         more iterations or use the direct solver"
    )]
    Stalled {
        /// Iterations done.
        iterations: usize,
        /// Residual over the right-hand side.
        residual: f64,
    },
    /// An element folded over, collapsed or not finite.
    #[error("element {cell} {}", broken(*.why))]
    Broken {
        /// Element, facets before the cells of solids.
        cell: usize,
        /// The failure of the element.
        why: Broken,
    },
    /// No equilibrium, with load steps halved as often as allowed.
    #[error(
        "no equilibrium at t = {time:.6} after {} iterations: {}, largest at node {node}{}; try smaller \
         load steps or a smaller `step`, slower motions, `control` in a static run, or a `force-limit` of the tool \
         that presses",
        residuals.len(), residual_in_words(residuals), in_larger_steps(*broken)
    )]
    NotConverged {
        /// Time of the load step that failed.
        time: f64,
        /// Node with the largest residual.
        node: u32,
        /// Norm of the residual at each iteration of the last attempt [N].
        residuals: Vec<f64>,
        /// The element that broke in an attempt with a larger step, the last such, and how.
        broken: Option<(usize, Broken)>,
    },
    /// A tool or a prescribed motion that cannot move further.
    #[error(
        "{}{}: stopped at {:.1} % of the step to t = {time:.6} after {iterations} iterations; no bodies \
         intersect. Give it a `force-limit`, a shorter or slower motion, or smaller steps",
        blocked(driver.as_ref()), gap_left(*gap), 100.0 * part
    )]
    Blocked {
        /// Time of the step that failed.
        time: f64,
        /// The moving tool or constraint that pushes hardest, and its force [N] without friction, where the
        /// step began. `None` where a volume is to change.
        driver: Option<(String, f64)>,
        /// Part of the way that it went, from 0 to 1.
        part: f64,
        /// The least gap [m] where the step began.
        gap: f64,
        /// Iterations of the last attempt.
        iterations: usize,
    },
    /// A volume and the limit of its pressure that cannot both be kept: the state leaps from one side of them
    /// to the other.
    #[error(
        "neither the volume of `{constraint}` nor its `pressure-limit` of {limit:.4e} Pa can be kept at t = \
         {time:.6}: {}. The surface snaps through; try {}smaller steps or a higher `pressure-limit`",
        in_vain(*pressure, *ahead), if *inertia { "" } else { "the solver `implicit`, " }
    )]
    Snaps {
        /// Time of the step that failed.
        time: f64,
        /// Name of the constraint.
        constraint: String,
        /// The first node of its surface.
        node: u32,
        /// The limit [Pa].
        limit: f64,
        /// The pressure [Pa] in the prescribed volume; `None` if the volume was not prescribed.
        pressure: Option<f64>,
        /// Distance [m³] of the volume at the limit beyond the prescribed one; `None` if the limit was not
        /// prescribed.
        ahead: Option<f64>,
        /// True if the step has inertia.
        inertia: bool,
    },
    /// No lower energy along a direction that should have one.
    #[error(
        "the energy stopped falling at t = {time:.6} after {iterations} iterations in contact, largest \
         residual at node {node}; try smaller steps"
    )]
    Uphill {
        /// Time of the step that failed.
        time: f64,
        /// Node with the largest residual.
        node: u32,
        /// Iterations of the last attempt.
        iterations: usize,
    },
    /// An edge in a triangle, found by the check of intersections.
    #[error(
        "{count} edges pass through triangles at t = {time:.6}. The first joins nodes {} and {} and passes \
         through the triangle of nodes {}, {} and {} in contact {contact}. This is a fault of the program: \
         please report it with the scene", edge[0], edge[1], triangle[0], triangle[1], triangle[2]
    )]
    Crossed {
        /// Time of the state.
        time: f64,
        /// Edges that go through triangles.
        count: usize,
        /// The contact, by its number.
        contact: u32,
        /// Ends of the first edge.
        edge: [u32; 2],
        /// Corners of the triangle it goes through.
        triangle: [u32; 3],
    },
    /// A device that solves the equations failed.
    #[error("the equations could not be solved on the GPU: {0}")]
    Device(DeviceError),
    /// The system has no room for the factors of the equations; how much they take, where that is known.
    #[error(
        "not enough memory for the factors of the equations{}; use \
         `linear = {{ by = \"conjugate-gradients\" }}`, or a coarser mesh",
        .0.map_or(String::new(), |needed| format!(": {needed}"))
    )]
    OutOfMemory(Option<OutOfMemory>),
    /// Someone asked for it.
    #[error("the search for the state at the end of a step was stopped")]
    Stopped,
    /// A balloon that is not closed.
    #[error(transparent)]
    Open(#[from] ModelError),
    /// A request that cannot be met; the text says why and what to do instead.
    #[error("{0}")]
    Impossible(&'static str),
}

impl SolveError {
    /// True if smaller steps can't help.
    pub(crate) fn is_final(&self) -> bool {
        matches!(self, Self::Crossed { .. } | Self::Stopped | Self::Device(_) | Self::OutOfMemory(_))
    }

    /// The element that is broken, or was in a larger step, by its number in the model.
    pub fn broken(&self) -> Option<(usize, Broken)> {
        match self {
            Self::Broken { cell, why } => Some((*cell, *why)),
            Self::NotConverged { broken, .. } => *broken,
            _ => None,
        }
    }

    /// Adds the element that broke in a larger step before, if this error names no broken element.
    pub(crate) fn after(mut self, larger: Option<(usize, Broken)>) -> Self {
        if let Self::NotConverged { broken, .. } = &mut self {
            *broken = broken.or(larger);
        }
        self
    }
}

fn residual_in_words(residuals: &[f64]) -> String {
    match residuals.last() {
        Some(last) if last.is_finite() => format!("residual {last:.3e}"),
        _ => "forces that are not finite".into(),
    }
}

fn in_larger_steps(found: Option<(usize, Broken)>) -> String {
    let Some((cell, why)) = found else { return String::new() };
    let what = match why {
        Broken::Inverted(_) => "is inverted",
        Broken::Area(_) => "collapses",
        Broken::Folded(_) => "folds over",
    };
    format!("; in a larger step element {cell} {what}")
}

fn in_vain(pressure: Option<f64>, ahead: Option<f64>) -> String {
    let pressure = pressure.map(|pressure| format!("the volume needs {pressure:.4e} Pa"));
    let ahead = ahead.map(|ahead| format!("at the limit the volume is {ahead:.1e} m³ beyond its curve"));
    pressure.into_iter().chain(ahead).collect::<Vec<_>>().join(", and ")
}

fn gap_left(gap: f64) -> String {
    if gap.is_finite() { format!(", with a gap of {gap:.1e} m left") } else { String::new() }
}

fn blocked(driver: Option<&(String, f64)>) -> String {
    match driver {
        Some((name, force)) => format!("`{name}` is blocked, pushing with {force:.3e} N"),
        None => "a prescribed volume is blocked".into(),
    }
}

fn broken(why: Broken) -> String {
    match why {
        Broken::Inverted(determinant) => {
            format!("is inverted (det F = {determinant:.2e}); use smaller steps or smaller loads")
        }
        Broken::Area(area) => format!("has collapsed: its area is {area:.1e} m²; use smaller steps"),
        Broken::Folded(angle) => {
            format!(
                "is folded over: a node has turned by {angle:.2} rad against it; use smaller steps or a finer mesh"
            )
        }
    }
}
