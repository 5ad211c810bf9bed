//! Correspondences between the scan's points and the model's surface: the surface as facets, the nearest facet to a
//! point, the exact foot point on the surface, and a cache of foot points between evaluations.

pub(crate) mod cache;
pub(crate) mod domain;
pub(crate) mod facets;
pub(crate) mod foot;
mod gauge;
pub(crate) mod layout;
pub(crate) mod nearest;
mod tree;
