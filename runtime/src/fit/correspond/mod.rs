//! Correspondences between the scan's points and the model's surface: its facets and exact foot points, and a cache of
//! foot points between evaluations.

pub(crate) mod cache;
pub(crate) use crate::feet::{facets, foot, layout, nearest};
