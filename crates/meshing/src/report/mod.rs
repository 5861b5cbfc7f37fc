//! Distances of a mesh from its body.

pub(crate) mod assessment;
pub(crate) mod deviation;
pub(crate) mod hausdorff;
pub(crate) mod percentiles;
pub(crate) mod regions;
pub(crate) mod soundness;
