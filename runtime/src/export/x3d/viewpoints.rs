//! The viewpoints, which switch between the modes, and from the sides.

use super::frame::Frame;
use super::modes::Mode;
use super::numbers::{axis_angle, list_of};
use glam::{DMat3, DVec3};
use std::fmt::Write;

/// Vertical field of view. Radians.
const FIELD_OF_VIEW: f64 = 0.6;

/// From the model toward the viewer of the modes: in front (the model's -y), to the right and above.
pub(super) const TOWARD: DVec3 = DVec3::new(0.437_41, 0.437_41, 0.785_70);

/// The sides, toward the viewer, and upwards as seen from there.
const SIDES: [(&str, DVec3, DVec3); 6] = [
    ("Front", DVec3::Z, DVec3::Y),
    ("Back", DVec3::NEG_Z, DVec3::Y),
    ("Left", DVec3::NEG_X, DVec3::Y),
    ("Right", DVec3::X, DVec3::Y),
    ("Top", DVec3::Y, DVec3::NEG_Z),
    ("Below", DVec3::NEG_Y, DVec3::Z),
];

/// A viewpoint a mode, then one a side, which leaves the mode as it is; the modes that need a geometry stage are last.
/// They are not in a Transform, because X_ITE takes y of a viewpoint's own coordinates as upwards.
pub(super) fn viewpoints(modes: &[Mode], frame: &Frame, out: &mut String) {
    let geometry = |mode: Mode| matches!(mode, Mode::GeometryActual | Mode::GeometryBoth);
    let of_mode = |geometry_stage: bool, out: &mut String| {
        for (i, mode) in modes.iter().enumerate().filter(|(_, mode)| geometry(**mode) == geometry_stage) {
            let toward = if *mode == Mode::Section { DVec3::Z } else { TOWARD };
            viewpoint(&format!("View{i}"), mode.name(), toward, DVec3::Y, frame, out);
        }
    };
    of_mode(false, out);
    for (name, toward, up) in SIDES {
        viewpoint(name, &format!("From: {}", name.to_lowercase()), toward, up, frame, out);
    }
    of_mode(true, out);
}

fn viewpoint(name: &str, description: &str, toward: DVec3, up: DVec3, frame: &Frame, out: &mut String) {
    let toward = toward.normalize();
    let position = list_of((toward * (1.05 * frame.radius / (FIELD_OF_VIEW / 2.0).sin())).to_array(), frame.decimals);
    let right = up.cross(toward).normalize();
    let orientation = list_of(axis_angle(DMat3::from_cols(right, toward.cross(right), toward)), 6);
    let _ = writeln!(
        out,
        "    <Viewpoint DEF='{name}' description='{description}' position='{position}' orientation='{orientation}' \
         centerOfRotation='0 0 0' fieldOfView='{FIELD_OF_VIEW}'/>"
    );
}

/// A viewpoint that is bound sets the Switch.
pub(super) fn routes(modes: usize, out: &mut String) {
    for i in 0..modes {
        let _ = writeln!(out, "    <BooleanFilter DEF='Filter{i}'/>");
        let _ = writeln!(out, "    <IntegerTrigger DEF='Trigger{i}' integerKey='{i}'/>");
    }
    for i in 0..modes {
        for (from, event, to, receiver) in [
            (format!("View{i}"), "isBound", format!("Filter{i}"), "set_boolean"),
            (format!("Filter{i}"), "inputTrue", format!("Trigger{i}"), "set_boolean"),
            (format!("Trigger{i}"), "triggerValue", "Mode".to_owned(), "whichChoice"),
        ] {
            let _ =
                writeln!(out, "    <ROUTE fromNode='{from}' fromField='{event}' toNode='{to}' toField='{receiver}'/>");
        }
    }
}
