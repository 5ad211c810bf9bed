//! Breaks of compiled surfaces.
