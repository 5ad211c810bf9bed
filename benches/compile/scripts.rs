//! Scripts of any size, alike in kind: what a larger model of the same style would be.

use std::fmt::Write as _;

/// A flange with so many holes in a loop.
pub(crate) fn holes(count: usize) -> String {
    format!(
        "use std.surface (cylinder, annulus)
use std.frame (translate)
use std.vector (polar)

model flange {{
  param r_out: length in 40mm..150mm = 80mm
  param r_circle: length in 10mm..r_out = 60mm
  param d_bolt: length in 0.001mm..20mm = 9mm / {count}
  param thick: length in 4mm..30mm = 12mm
  require r_circle + d_bolt / 2 < r_out, \"the bolt holes break the rim\"
  part rim = cylinder(r_out, thick)
  for i in 0..{count} {{
    part hole = cylinder(d_bolt / 2, thick).translate(polar(r_circle, i * 1turn / {count}, 0mm))
  }}
}}
"
    )
}

/// Lines of one section of [`lines`], in the model and outside.
const SECTION: usize = 40;

/// A model of about so many lines: sections with functions of their own, parameters, local values, a require, and parts
/// of several kinds, some of them in a loop; all in one pose.
pub(crate) fn lines(count: usize) -> String {
    let sections = count.div_ceil(SECTION);
    let mut text = String::from(
        "use std.math (mix, smoothstep)
use std.curve (bezier)
use std.surface (revolve, tube, cylinder)
use std.frame (place, euler, translate)
use std.vector (polar)

",
    );
    for k in 0..sections {
        functions(&mut text, k);
    }
    text.push_str(
        "model tower {
  param x: length = 0mm; param y: length = 0mm; param z: length = 0mm
  param alpha: angle = 0deg; param beta: angle = 0deg; param gamma: angle = 0deg
  let pose = place((x, y, z), euler(alpha, beta, gamma))
",
    );
    for k in 0..sections {
        section(&mut text, k);
    }
    text.push_str("}\n");
    text
}

fn functions(text: &mut String, k: usize) {
    let (depth, turns) = (2 + k % 5, 3 + k % 4);
    let _ = write!(
        text,
        "/// How far section {k} bulges at height t.
fn bulge{k}(t: real, size: real) -> real {{
  let rise = smoothstep(0, 1, t)
  let fall = 1 - t ^ {depth}
  size * rise * fall
}}

/// The profile of section {k}: straight at the foot, then rounded.
fn profile{k}(t: real, foot: real, size: real) -> real {{
  if t < foot {{
    1 + size * t
  }} else {{
    let s = (t - foot) / (1 - foot)
    mix(1 + size * foot, 1, s) + bulge{k}(s, size) * cos(s * {turns} * 1turn)
  }}
}}

"
    );
}

fn section(text: &mut String, k: usize) {
    let (rings, height) = (2 + k % 3, 20 + k % 7);
    let _ = write!(
        text,
        "
  /// Radius, height and shape of section {k}.
  param r{k}: length in 10mm..100mm = 40mm
  param h{k}: length in 5mm..80mm = {height}mm
  param s{k}: real in 0..0.5 = 0.2
  require r{k} > h{k} / 20, \"section {k} is too slender\"
  let base{k} = {k} * 60mm
  let foot{k} = 0.3 + s{k} / 4
  part wall{k} = pose(
    revolve(|t| (r{k} * profile{k}(t, foot{k}, s{k}), base{k} + h{k} * t))
  )
  part handle{k} = pose(tube(bezier([
    (r{k}, base{k}),
    (r{k} * 1.5, base{k} + h{k} / 4),
    (r{k} * 1.4, base{k} + h{k} / 2),
    (r{k}, base{k} + h{k}),
  ]), radius: 3mm))
  for i in 0..{rings} {{
    part peg{k} = pose(cylinder(4mm, 10mm).translate(polar(r{k}, i * 1turn / {rings}, base{k})))
  }}
"
    );
}
