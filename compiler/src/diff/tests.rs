//! Tests of derivatives.

mod printed;
mod properties;
mod special;
