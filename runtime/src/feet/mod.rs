//! Foot points: the place of a surface that is nearest to a point. A model's patches are divided into facets, whose
//! nearest one is found by a tree; Newton's method leads from there to the foot on the exact surface.

pub(crate) mod domain;
mod edge;
pub(crate) mod facets;
pub(crate) mod foot;
mod gauge;
pub(crate) mod layout;
pub(crate) mod nearest;
pub(crate) mod signed;
#[cfg(test)]
mod tests;
mod tree;
mod trim;
mod tuning;
