//! The document: its head, what it says of itself, and its nodes in order.

use super::annotations;
use super::frame::Frame;
use super::modes::{Mode, Modes};
use super::numbers::{axis_angle, list_of, number, quoted};
use super::parts::parts;
use super::surface::Tiles;
use super::textures::Textures;
use super::viewpoints::{routes, viewpoints};
use super::{X3dError, X3dScene};
use crate::export::escape::escape;
use std::fmt::Write;

/// The whole document of a checked scene.
pub(super) fn document(scene: &X3dScene<'_>) -> Result<String, X3dError> {
    let mesh = &scene.tessellation.mesh;
    let frame = Frame::of(mesh, &scene.turned);
    let encoded = |error: crate::export::image::ImageError| X3dError::Texture(error.to_string());
    let tiles = Tiles::new(mesh, &frame, scene.deviations);
    let words = tiles.as_ref().map_or(&[][..], |tiles| &tiles.words);
    let textures = Textures::new(scene, words).map_err(encoded)?;
    let modes = Mode::all(tiles.is_some());
    let mut out = String::new();
    head(scene, &mut out);
    let _ = writeln!(out, "  <Scene>");
    world(scene, &frame, tiles.is_some(), &mut out);
    viewpoints(&modes, &frame, &mut out);
    annotations::legend(scene.deviations, &scene.scale, &frame, &mut out);
    annotations::scale_bar(&frame, &mut out);
    let rotation = list_of(axis_angle(frame.upright), 9);
    let _ = writeln!(out, "    <Transform rotation='{rotation}'>\n      <Switch DEF='Mode' whichChoice='0'>");
    let parts = parts(mesh);
    let (frame, textures, tiles) = (&frame, &textures, tiles.as_ref());
    let mut writer = Modes { scene, frame, parts: &parts, textures, tiles, defined: Vec::new() };
    modes.iter().for_each(|mode| writer.write(*mode, &mut out));
    let _ = writeln!(out, "      </Switch>\n    </Transform>");
    routes(modes.len(), &mut out);
    out.push_str("  </Scene>\n</X3D>\n");
    Ok(out)
}

fn head(scene: &X3dScene<'_>, out: &mut String) {
    out.push_str("<?xml version='1.0' encoding='UTF-8'?>\n<X3D profile='Immersive' version='4.0'>\n  <head>\n");
    for (component, level) in [("Rendering", 5), ("Shaders", 1), ("Texturing", 2)] {
        let _ = writeln!(out, "    <component name='{component}' level='{level}'/>");
    }
    let metas = [
        ("title", escape(scene.title)),
        ("generator", "gmlc".to_owned()),
        (
            "description",
            "Nominal model, deviations, scan and actual (scanned) surface; the viewpoints switch between them."
                .to_owned(),
        ),
        ("comment", "Coordinates and deviations in millimetres; positive: the scan lies outside the model.".to_owned()),
    ];
    for (name, content) in metas {
        let _ = writeln!(out, "    <meta name='{name}' content='{content}'/>");
    }
    out.push_str("  </head>\n");
}

/// Title, figures, background and navigation.
fn world(scene: &X3dScene<'_>, frame: &Frame, tiled: bool, out: &mut String) {
    let info = if tiled {
        ""
    } else {
        " info='\"The mesh has too many triangles for a texture: the actual surface needs a geometry shader.\"'"
    };
    let _ = writeln!(out, "    <WorldInfo title='{}'{info}>", escape(scene.title));
    let _ = writeln!(
        out,
        "      <MetadataSet name='deviations' containerField='metadata' reference='millimetres; positive: scan outside model'>"
    );
    let settings = [("maximum distance", scene.deviations.max_distance), ("colour range", scene.scale.end)];
    for (name, value) in settings {
        let _ = writeln!(out, "        <MetadataDouble name='{name}' value='{value}' containerField='value'/>");
    }
    way_back(frame, out);
    for group in scene.metadata {
        let _ = writeln!(out, "        <MetadataSet name='{}' containerField='value'>", escape(&group.name));
        for (name, value) in &group.entries {
            let (name, value) = (escape(name), escape(&quoted(value)));
            let _ = writeln!(out, "          <MetadataString name='{name}' value='{value}' containerField='value'/>");
        }
        out.push_str("        </MetadataSet>\n");
    }
    out.push_str("      </MetadataSet>\n    </WorldInfo>\n");
    out.push_str("    <Background skyColor='0.94 0.95 0.96'/>\n");
    let _ = writeln!(
        out,
        "    <NavigationInfo type='\"EXAMINE\" \"ANY\"' speed='{}' avatarSize='{} {} {}' headlight='false' \
         visibilityLimit='{}'/>",
        number(frame.radius, 4),
        number(frame.radius * 0.01, 6),
        number(frame.radius * 0.1, 6),
        number(frame.radius * 0.01, 6),
        // Without one X_ITE shows nothing that is farther than 100,000 units.
        number(frame.radius * 100.0, 4),
    );
}

/// How coordinates of the scene become those of the scan.
fn way_back(frame: &Frame, out: &mut String) {
    let joined = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    // By columns, so that the transpose is written row by row.
    let (rotation, centre) = (joined(&frame.upright.to_cols_array()), joined(&frame.centre.to_array()));
    let _ = writeln!(
        out,
        "        <MetadataSet name='scan coordinates' containerField='value' reference='scan = rotation * scene + centre; \
         millimetres, the rotation row by row'>\n          \
         <MetadataDouble name='rotation' value='{rotation}' containerField='value'/>\n          \
         <MetadataDouble name='centre' value='{centre}' containerField='value'/>\n        </MetadataSet>"
    );
}
