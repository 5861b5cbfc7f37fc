//! Points that a user has picked: they are followed, read and plotted until they are forgotten.

use std::sync::Arc;

use pliant_geometry::{CellBlock, CellId, Region, Vector3, cell_body};
use pliant_mechanics::grip::Grip;
use pliant_picture::{Subject, visible};
use pliant_run::Live;
use pliant_scene::World;

use crate::hand::{Point, nodes_of};

/// A point that a user follows, at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct FollowedPoint {
    /// Position [m].
    pub place: Vector3,
    /// The field that is shown; `None` without one, or where another surface is shown than when it was
    /// picked.
    pub value: Option<f64>,
    /// Body, element and label.
    pub about: Arc<str>,
}

/// A point that a user follows.
pub(crate) struct Followed {
    /// Its nodes; it pulls at none.
    point: Grip,
    /// Its place at rest [m].
    rest: Vector3,
    /// Points of the drawn mesh and their weights, until another surface is shown.
    shown: Vec<(u32, f64)>,
    about: Arc<str>,
}

impl Followed {
    /// Makes a point of the drawn mesh of a body or a surface (`on`), without hidden cells. Returns `None` on
    /// an obstacle or a tool.
    pub fn new(
        point: &Point,
        subject: &Subject,
        live: &Live,
        world: &World,
        on: Option<&str>,
        hidden: &[Region],
    ) -> Option<Self> {
        let grip = Grip { nodes: nodes_of(point, subject, live)?, ..Grip::default() };
        let rest = |&(node, weight): &(u32, f64)| Vector3::from(live.simulation.rest(node)) * weight;
        let rest = grip.nodes.iter().map(rest).sum();
        let corners = subject.triangles().nth(point.triangle as usize)?;
        let shown = corners.into_iter().zip(point.weights).collect();
        let cell = subject.cell(point.triangle as usize)?;
        let about = about(cell, live, world, on, hidden).unwrap_or_default().into();
        Some(Self { point: grip, rest, shown, about })
    }

    /// Its place at rest [m].
    pub fn rest(&self) -> Vector3 {
        self.rest
    }

    /// Another surface is shown: its values are none of this point.
    pub(crate) fn forget_shown(&mut self) {
        self.shown.clear();
    }

    /// It at the instant of a run, whose points that are shown have some values.
    pub fn now(&self, live: &Live, values: &[f64]) -> FollowedPoint {
        let place = live.simulation.pulled(&self.point)[0].into();
        let parts = self.shown.iter().map(|&(point, weight)| Some(values.get(point as usize)? * weight));
        let value = parts.sum::<Option<f64>>().filter(|value| value.is_finite() && !self.shown.is_empty());
        FollowedPoint { place, value, about: Arc::clone(&self.about) }
    }
}

/// Body, element and label of a cell that is drawn.
fn about(cell: CellId, live: &Live, world: &World, on: Option<&str>, hidden: &[Region]) -> Option<String> {
    let seen = visible(live.shown(), hidden);
    let block = seen.block(cell.kind)?;
    let number = |name: &str| block.data.get(name)?.values.get(cell.index as usize).copied();
    let names = world.body_names(on);
    let body = on.or_else(|| names.get(&cell_body(block, cell.index)).map(String::as_str))?;
    // Cells are counted in the whole mesh, hidden ones included.
    let corners = block.cells().nth(cell.index as usize)?;
    let element = live
        .shown()
        .block(cell.kind)
        .and_then(|whole| CellBlock::cells(whole).position(|nodes| nodes == corners));
    let element = element.map_or(String::new(), |element| format!(", element {element}"));
    let label = number("label").map_or(String::new(), |label| {
        let name = seen.label_names.get(&(label as i32)).map_or(String::new(), |name| format!(" ({name})"));
        format!(", label {label}{name}")
    });
    Some(format!("{body}{element}{label}"))
}
