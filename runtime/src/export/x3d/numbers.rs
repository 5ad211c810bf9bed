//! Numbers and strings as X3D writes them.

use glam::{DMat3, DQuat};

/// Tuples separated by commas.
pub(super) fn list<const N: usize>(tuples: impl Iterator<Item = [String; N]>, out: &mut String) {
    for (i, tuple) in tuples.enumerate() {
        if i > 0 {
            out.push_str(if i % 16 == 0 { "\n" } else { "," });
        }
        out.push_str(&tuple.join(" "));
    }
}

/// Numbers separated by spaces.
pub(super) fn list_of<const N: usize>(values: [f64; N], decimals: usize) -> String {
    values.map(|v| number(v, decimals)).join(" ")
}

/// A number with at most so many decimals and no trailing zeros.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

/// A string inside an MFString.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// A rotation as X3D writes it: an axis and an angle in radians, at most half a turn.
pub(super) fn axis_angle(rotation: DMat3) -> [f64; 4] {
    let quaternion = DQuat::from_mat3(&rotation);
    match (if quaternion.w < 0.0 { -quaternion } else { quaternion }).to_axis_angle() {
        (_, 0.0) => [0.0, 0.0, 1.0, 0.0],
        (axis, angle) => [axis.x, axis.y, axis.z, angle],
    }
}
