//! Distances from every texel of the model's surface to the scan; statistics.
