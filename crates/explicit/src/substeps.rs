//! Into how many parts a step is cut, from the largest stable one.

/// The most substeps a step is cut into.
pub(crate) const MOST_SUBSTEPS: u32 = 100;
/// Substeps are chosen so that they reach this part of the limit at the most.
pub(crate) const RESERVE: f64 = 0.95;
/// Part of the limit up to which substeps are kept: the limit may fall before the next check.
pub const KEEP: f64 = 0.97;
/// Steps for which the limit has to allow fewer parts before they are used.
pub(crate) const REJOIN_AFTER: u64 = 1000;
/// Maximum number of times that the steps of a run are halved.
pub const MOST_HALVINGS: u32 = 3;

/// Returns the parts into which a step is cut, from the present number of parts and the limit; `None` if more
/// than `MOST_SUBSTEPS` are needed. Fewer parts than now are used only if they keep the reserve. So a limit
/// that hovers at a number of parts does not make this number change all the time.
pub(crate) fn substeps(step: f64, limit: f64, now: u32) -> Option<u32> {
    let enough = (step / (RESERVE * limit)).ceil();
    if enough > f64::from(MOST_SUBSTEPS) || enough.is_nan() {
        return None;
    }
    let enough = (enough as u32).max(1);
    let stable = step / f64::from(now) <= KEEP * limit;
    Some(if stable { now.min(enough) } else { enough })
}

/// Returns the factor by which the limit may change before [`substeps`] chooses other parts, as a logarithm.
/// It is zero if the limit asks for more parts now. If the limit allows fewer parts already, only a change to
/// more counts: fewer are not used at once.
pub(crate) fn margin(step: f64, limit: f64, parts: u32) -> f64 {
    let more = f64::from(parts) * KEEP * limit / step;
    // One part cannot become fewer.
    let fewer = step / (RESERVE * limit * f64::from(parts - 1));
    let nearest = if fewer > 1.0 { more.min(fewer) } else { more };
    nearest.ln().max(0.0)
}
