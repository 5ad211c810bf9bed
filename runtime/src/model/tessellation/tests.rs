//! Tests of tessellations.
