//! The shaders, from their files, with their common parts inserted.

use crate::export::colormap::diverging;
use crate::export::scale::BANDS;
use std::fmt::Write;

const COMMON: &str = include_str!("glsl/common.glsl");
const COLOUR: &str = include_str!("glsl/colour.glsl");
const SCALED: &str = include_str!("glsl/scale.glsl");
const TEXEL: &str = include_str!("glsl/texel.glsl");
const TILE_VERTEX: &str = include_str!("glsl/tile.vert");
const TILE_FRAGMENT: &str = include_str!("glsl/tile.frag");

/// Samples of the colour scale between which shaders interpolate.
const SCALE_SAMPLES: usize = 17;

/// Which viewers a shader is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dialect {
    /// Castle Game Engine, on the desktop.
    Desktop,
    /// X_ITE, in browsers.
    Web,
}

/// Displacement in the geometry stage, for desktop viewers (\[VA\] sect. 7): stages by their name in X3D.
pub(super) fn geometry() -> [(&'static str, String); 3] {
    [
        ("VERTEX", complete(include_str!("glsl/geometry.vert"))),
        ("GEOMETRY", complete(include_str!("glsl/geometry.geom"))),
        ("FRAGMENT", complete(include_str!("glsl/geometry.frag"))),
    ]
}

/// Displacement in the vertex stage of tiles of triangles.
pub(super) fn tiles(dialect: Dialect) -> [(&'static str, String); 2] {
    let (head, names) = match dialect {
        Dialect::Desktop => (include_str!("glsl/desktop.head"), include_str!("glsl/desktop.names")),
        Dialect::Web => (include_str!("glsl/web.head"), include_str!("glsl/web.names")),
    };
    [
        ("VERTEX", complete(&format!("{head}{names}{TILE_VERTEX}"))),
        ("FRAGMENT", complete(&format!("{head}{TILE_FRAGMENT}"))),
    ]
}

/// The complete source of a stage.
pub(in crate::export) fn complete(source: &str) -> String {
    let inserted = source.replace("//!common\n", COMMON).replace("//!texel\n", TEXEL);
    let inserted = inserted.replace("//!scaled\n", &SCALED.replace("//!bands", &format!("{BANDS}.0")));
    inserted.replace("//!colour\n", &COLOUR.replace("//!scale\n", &scale()))
}

/// Statements that return the colour for `t` in [0, 1].
fn scale() -> String {
    let segments = SCALE_SAMPLES - 1;
    let vector = |i: usize| {
        let [r, g, b] = diverging(2.0 * i as f64 / segments as f64 - 1.0).map(|c| f64::from(c) / 255.0);
        format!("vec3({r:.4}, {g:.4}, {b:.4})")
    };
    let mut out = format!("  vec3 c = {};\n  t *= {segments}.0;\n", vector(0));
    for i in 1..=segments {
        let _ = writeln!(out, "  c = mix(c, {}, clamp(t - {}.0, 0.0, 1.0));", vector(i), i - 1);
    }
    out.push_str("  return c;\n");
    out
}
