//! The nodes of the file.

use super::{X3dScene, shaders};
use crate::export::escape::escape;
use crate::mesh::{Group, TriangleMesh};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat3, DQuat, DVec3};
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write;

/// The choices of the Switch, in its order; a viewpoint leads to each.
const MODES: [&str; 5] =
    ["Nominal", "Actual", "Nominal and actual", "Actual (vertex shader)", "Nominal and actual (vertex shader)"];

/// The appearance of the nominal model.
const SOLID: &str = "              <Appearance DEF='Solid'>
                <Material diffuseColor='0.72 0.74 0.77' specularColor='0.1 0.1 0.1'/>
              </Appearance>\n";

/// The appearance of the nominal model around the actual one.
const GLASS: &str = "                <Appearance DEF='Glass'>
                  <Material diffuseColor='0.5 0.52 0.55' transparency='0.6'/>
                </Appearance>\n";

/// Vertical field of view of the viewpoints. Radians.
const FIELD_OF_VIEW: f64 = 0.6;

/// The whole document of a checked scene.
pub(super) fn document(scene: &X3dScene<'_>) -> String {
    let mesh = &scene.tessellation.mesh;
    let frame = Frame::of(mesh, &scene.turned);
    let mut out = String::new();
    head(scene, &mut out);
    let _ = writeln!(out, "  <Scene>");
    world(scene, &frame, &mut out);
    viewpoints(&frame, &mut out);
    let rotation = list_of(axis_angle(frame.upright), 9);
    let translation = list_of(frame.place.to_array(), frame.decimals);
    let _ = writeln!(out, "    <Transform rotation='{rotation}' translation='{translation}'>");
    let _ = writeln!(out, "        <Switch DEF='Mode' whichChoice='0'>");
    let parts = parts(mesh);
    nominal(scene, &parts, &frame, &mut out);
    let mut displaced = Displaced { scene, parts: parts.len(), defined: Vec::new() };
    displaced.mode(&["Geometry", "Web"], false, &mut out);
    displaced.mode(&["Geometry", "Web"], true, &mut out);
    displaced.mode(&["Vertex", "Web"], false, &mut out);
    displaced.mode(&["Vertex", "Web"], true, &mut out);
    let _ = writeln!(out, "        </Switch>\n    </Transform>");
    routes(&mut out);
    out.push_str("  </Scene>\n</X3D>\n");
    out
}

fn head(scene: &X3dScene<'_>, out: &mut String) {
    out.push_str("<?xml version='1.0' encoding='UTF-8'?>\n<X3D profile='Immersive' version='4.0'>\n  <head>\n");
    out.push_str("    <component name='Shaders' level='1'/>\n    <component name='Texturing' level='2'/>\n");
    let metas = [
        ("title", escape(scene.title)),
        ("generator", "gmlc".to_owned()),
        ("description", "Nominal model and actual (scanned) surface; the viewpoints switch between them.".to_owned()),
        ("comment", "Coordinates and deviations in millimetres; positive: the scan lies outside the model.".to_owned()),
    ];
    for (name, content) in metas {
        let _ = writeln!(out, "    <meta name='{name}' content='{content}'/>");
    }
    out.push_str("  </head>\n");
}

/// Title, figures, background and navigation.
fn world(scene: &X3dScene<'_>, frame: &Frame, out: &mut String) {
    let _ = writeln!(out, "    <WorldInfo title='{}'>", escape(scene.title));
    let _ = writeln!(
        out,
        "      <MetadataSet name='deviations' containerField='metadata' reference='millimetres; positive: scan outside model'>"
    );
    let settings = [("maximum distance", scene.max_distance), ("colour range", scene.colour_range)];
    for (name, value) in settings {
        let _ = writeln!(out, "        <MetadataDouble name='{name}' value='{value}' containerField='value'/>");
    }
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
        "    <NavigationInfo type='\"EXAMINE\" \"ANY\"' speed='{}' avatarSize='{} {} {}' headlight='true'/>",
        number(frame.radius, 4),
        number(frame.radius * 0.01, 6),
        number(frame.radius * 0.1, 6),
        number(frame.radius * 0.01, 6),
    );
}

/// A viewpoint a mode, all from the same place: in front (from the model's -y), to the right and above. They are not
/// in the Transform, because X_ITE takes y of a viewpoint's own coordinates as upwards.
fn viewpoints(frame: &Frame, out: &mut String) {
    let toward = DVec3::new(0.45, 0.45, 0.8).normalize();
    let position = frame.place + toward * (1.05 * frame.radius / (FIELD_OF_VIEW / 2.0).sin());
    let triple = |v: DVec3| list_of(v.to_array(), frame.decimals);
    let (position, centre) = (triple(position), triple(frame.place));
    let right = DVec3::Y.cross(toward).normalize();
    let orientation = list_of(axis_angle(DMat3::from_cols(right, toward.cross(right), toward)), 6);
    for (i, mode) in MODES.iter().enumerate() {
        let _ = writeln!(
            out,
            "    <Viewpoint DEF='View{i}' description='{mode}' position='{position}' orientation='{orientation}' \
             centerOfRotation='{centre}' fieldOfView='{FIELD_OF_VIEW}'/>"
        );
    }
}

/// A rotation as X3D writes it: an axis and an angle in radians, at most half a turn.
fn axis_angle(rotation: DMat3) -> [f64; 4] {
    let quaternion = DQuat::from_mat3(&rotation);
    match (if quaternion.w < 0.0 { -quaternion } else { quaternion }).to_axis_angle() {
        (_, 0.0) => [0.0, 0.0, 1.0, 0.0],
        (axis, angle) => [axis.x, axis.y, axis.z, angle],
    }
}

/// The model as it is, readable by viewers without shaders. Defines the geometry that all other modes use.
fn nominal(scene: &X3dScene<'_>, parts: &[Part], frame: &Frame, out: &mut String) {
    out.push_str("          <Group DEF='Nominal'>\n");
    for (i, part) in parts.iter().enumerate() {
        let name = escape(&quoted(&part.name));
        let _ = writeln!(out, "            <Shape DEF='Part{i}'>");
        let _ = writeln!(out, "              <MetadataString name='part' value='{name}' containerField='metadata'/>");
        out.push_str(if i == 0 { SOLID } else { "              <Appearance USE='Solid'/>\n" });
        part.write(i, &scene.tessellation.mesh, frame, out);
        out.push_str("            </Shape>\n");
    }
    out.push_str("          </Group>\n");
}

/// Writes the modes that show the scan.
struct Displaced<'a, 'b> {
    scene: &'a X3dScene<'b>,
    parts: usize,
    /// Nodes that are in the file already and are referred to from now on.
    defined: Vec<&'static str>,
}

impl Displaced<'_, '_> {
    /// One choice of the Switch: the displaced parts and, where `both`, the model translucent around them.
    fn mode(&mut self, shaders: &[&'static str; 2], both: bool, out: &mut String) {
        out.push_str("          <Group>\n");
        let name = if shaders[0] == "Geometry" { "Subdivided" } else { "Displaced" };
        for i in 0..self.parts {
            out.push_str("            <Shape>\n");
            if self.first(name) {
                let _ = writeln!(out, "              <Appearance DEF='{name}'>\n                <Material/>");
                for shader in shaders {
                    self.shader(shader, out);
                }
                out.push_str("              </Appearance>\n");
            } else {
                let _ = writeln!(out, "              <Appearance USE='{name}'/>");
            }
            let _ = writeln!(out, "              <IndexedTriangleSet USE='Mesh{i}'/>\n            </Shape>");
        }
        if both {
            self.translucent(out);
        }
        out.push_str("          </Group>\n");
    }

    /// The model as glass, once.
    fn translucent(&mut self, out: &mut String) {
        if !self.first("Translucent") {
            out.push_str("            <Group USE='Translucent'/>\n");
            return;
        }
        out.push_str("            <Group DEF='Translucent'>\n");
        for i in 0..self.parts {
            let appearance = if i == 0 { GLASS } else { "                <Appearance USE='Glass'/>\n" };
            let _ = writeln!(
                out,
                "              <Shape>\n{appearance}                <IndexedTriangleSet USE='Mesh{i}'/>\n              </Shape>"
            );
        }
        out.push_str("            </Group>\n");
    }

    /// A shader with its texture and stages.
    fn shader(&mut self, name: &'static str, out: &mut String) {
        if !self.first(name) {
            let _ = writeln!(out, "                <ComposedShader USE='{name}' containerField='shaders'/>");
            return;
        }
        let _ = writeln!(out, "                <ComposedShader DEF='{name}' language='GLSL' containerField='shaders'>");
        let fields =
            [("maxDistance", self.scene.max_distance), ("colourRange", self.scene.colour_range), ("exaggeration", 1.0)];
        for (field, value) in fields {
            let _ = writeln!(
                out,
                "                  <field accessType='inputOutput' type='SFFloat' name='{field}' value='{value}'/>"
            );
        }
        out.push_str("                  <field accessType='inputOutput' type='SFNode' name='distances'>\n");
        self.texture(out);
        out.push_str("                  </field>\n");
        let stages = match name {
            "Geometry" => shaders::GEOMETRY,
            "Vertex" => shaders::VERTEX,
            _ => shaders::WEB,
        };
        for (stage, source) in stages {
            let source = shaders::complete(source);
            let _ = writeln!(
                out,
                "                  <ShaderPart type='{stage}'><![CDATA[data:text/plain,{source}]]></ShaderPart>"
            );
        }
        out.push_str("                </ComposedShader>\n");
    }

    /// The distance texture, once; its bytes must reach the shaders as they are.
    fn texture(&mut self, out: &mut String) {
        if !self.first("Distances") {
            out.push_str("                    <ImageTexture USE='Distances'/>\n");
            return;
        }
        let data = STANDARD.encode(self.scene.texture_png);
        let _ = writeln!(
            out,
            "                    <ImageTexture DEF='Distances' repeatS='false' repeatT='false' \
             url='\"data:image/png;base64,{data}\"'>"
        );
        out.push_str(
            "                      <TextureProperties magnificationFilter='NEAREST_PIXEL' \
             minificationFilter='NEAREST_PIXEL' boundaryModeS='CLAMP_TO_EDGE' boundaryModeT='CLAMP_TO_EDGE' \
             generateMipMaps='false'/>\n                    </ImageTexture>\n",
        );
    }

    /// True the first time that it is asked for a name.
    fn first(&mut self, name: &'static str) -> bool {
        let new = !self.defined.contains(&name);
        if new {
            self.defined.push(name);
        }
        new
    }
}

/// A viewpoint that is bound sets the Switch.
fn routes(out: &mut String) {
    for i in 0..MODES.len() {
        let _ = writeln!(out, "    <BooleanFilter DEF='Filter{i}'/>");
        let _ = writeln!(out, "    <IntegerTrigger DEF='Trigger{i}' integerKey='{i}'/>");
    }
    for i in 0..MODES.len() {
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

/// The place and the size of the model.
struct Frame {
    /// Centre of the bounding box; coordinates are written relative to it, because viewers use single precision.
    centre: DVec3,
    /// The rotation from the mesh's coordinates to the scene's, whose y points upwards.
    upright: DMat3,
    /// The centre in the scene's coordinates.
    place: DVec3,
    /// Half the diagonal of the bounding box.
    radius: f64,
    /// Decimals of coordinates: five digits of the radius, and a thousandth of a millimetre at least, a tenth of by
    /// how much triangles may leave the surface.
    decimals: usize,
}

impl Frame {
    fn of(mesh: &TriangleMesh, turned: &[[f64; 3]; 3]) -> Self {
        let bounds = mesh.bounds();
        let (centre, radius) = (bounds.centre(), bounds.diagonal() / 2.0);
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let decimals = (4.0 - radius.log10().floor()).clamp(3.0, 12.0) as usize;
        // The rows are taken for columns: the transpose, which turns back.
        let upright = DMat3::from_rotation_x(-FRAC_PI_2) * DMat3::from_cols_array_2d(turned);
        Self { centre, upright, place: upright * centre, radius, decimals }
    }
}

/// A part's triangles with vertices of their own.
struct Part {
    name: String,
    /// The vertices of the mesh that it has.
    vertices: Vec<u32>,
    /// Its triangles, as indices into `vertices`.
    triangles: Vec<[u32; 3]>,
}

fn parts(mesh: &TriangleMesh) -> Vec<Part> {
    let whole = [Group { name: "model".to_owned(), start: 0, end: mesh.triangles.len() }];
    let groups = if mesh.groups.is_empty() { &whole[..] } else { &mesh.groups };
    groups.iter().filter(|g| g.start < g.end).map(|g| Part::of(g, mesh)).collect()
}

impl Part {
    fn of(group: &Group, mesh: &TriangleMesh) -> Part {
        let mut vertices = Vec::new();
        let mut renumbered = HashMap::new();
        let triangles = mesh.triangles[group.start..group.end]
            .iter()
            .map(|t| {
                t.map(|v| {
                    *renumbered.entry(v).or_insert_with(|| {
                        vertices.push(v);
                        vertices.len() as u32 - 1
                    })
                })
            })
            .collect();
        Part { name: group.name.clone(), vertices, triangles }
    }

    fn write(&self, i: usize, mesh: &TriangleMesh, frame: &Frame, out: &mut String) {
        let _ = write!(out, "              <IndexedTriangleSet DEF='Mesh{i}' solid='false' index='");
        list(self.triangles.iter().map(|t| t.map(|v| v.to_string())), out);
        out.push_str("'>\n                <Coordinate point='");
        let point = |&v: &u32| DVec3::from_array(mesh.positions[v as usize]) - frame.centre;
        list(self.vertices.iter().map(|v| point(v).to_array().map(|c| number(c, frame.decimals))), out);
        out.push_str("'/>\n                <Normal vector='");
        list(self.vertices.iter().map(|&v| mesh.normals[v as usize].map(|c| number(c, 3))), out);
        out.push_str("'/>\n                <TextureCoordinate point='");
        list(self.vertices.iter().map(|&v| mesh.texcoords[v as usize].map(|c| number(c, 5))), out);
        out.push_str("'/>\n              </IndexedTriangleSet>\n");
    }
}

/// Tuples separated by commas.
fn list<const N: usize>(tuples: impl Iterator<Item = [String; N]>, out: &mut String) {
    for (i, tuple) in tuples.enumerate() {
        if i > 0 {
            out.push_str(if i % 16 == 0 { "\n" } else { "," });
        }
        out.push_str(&tuple.join(" "));
    }
}

/// Numbers separated by spaces.
fn list_of<const N: usize>(values: [f64; N], decimals: usize) -> String {
    values.map(|v| number(v, decimals)).join(" ")
}

/// A number with at most so many decimals and no trailing zeros.
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

/// A string inside an MFString.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
