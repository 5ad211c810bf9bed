//! What the scene shows, one thing at a time.

use super::X3dScene;
use super::annotations;
use super::frame::Frame;
use super::numbers::{list_of, quoted};
use super::parts::Part;
use super::shaders::{self, Dialect};
use super::surface::Tiles;
use super::textures::Textures;
use super::{scan, section};
use crate::export::escape::escape;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

/// A choice of the Switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Nominal,
    Deviations,
    Scan,
    Actual,
    Both,
    BothHits,
    Section,
    GeometryActual,
    GeometryBoth,
}

impl Mode {
    /// The choices in the Switch's order: what all viewers show comes first, what needs a geometry stage last. Without
    /// `tiles` those that are displaced in the vertex stage are missing.
    pub(super) fn all(tiles: bool) -> Vec<Self> {
        let displaced = [Self::Actual, Self::Both, Self::BothHits];
        let modes = [Self::Nominal, Self::Deviations, Self::Scan].into_iter();
        let modes = modes.chain(displaced.into_iter().filter(|_| tiles));
        modes.chain([Self::Section, Self::GeometryActual, Self::GeometryBoth]).collect()
    }

    /// Its name in the list of viewpoints.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Nominal => "Nominal",
            Self::Deviations => "Nominal, coloured by deviations",
            Self::Scan => "Scan",
            Self::Actual => "Actual",
            Self::Both => "Nominal and actual",
            Self::BothHits => "Actual, hits on both sides",
            Self::Section => "Section",
            Self::GeometryActual => "Actual, hits on both sides (geometry shader)",
            Self::GeometryBoth => "Nominal and actual (geometry shader)",
        }
    }
}

/// The appearance of the nominal model.
const SOLID: &str = "<Appearance DEF='Solid'><Material ambientIntensity='1' diffuseColor='0.72 0.74 0.77' specularColor='0.1 0.1 0.1'/>\
                     </Appearance>";

/// The appearance of the nominal model around the actual one.
const GLASS: &str = "<Appearance DEF='Glass'><Material ambientIntensity='1' diffuseColor='0.5 0.52 0.55' transparency='0.6'/></Appearance>";

/// The appearance of the scan: clay, as in the pictures.
const CLAY: &str = "<Appearance><Material ambientIntensity='1' diffuseColor='0.78 0.75 0.7' specularColor='0.05 0.05 0.05'/></Appearance>";

/// Colours of the outlines of model and scan in the section.
const OUTLINES: [&str; 2] = ["0.1 0.12 0.15", "0.85 0.35 0"];

/// Writes the modes.
pub(super) struct Modes<'a, 'b> {
    pub(super) scene: &'a X3dScene<'b>,
    pub(super) frame: &'a Frame,
    pub(super) parts: &'a [Part],
    pub(super) textures: &'a Textures,
    pub(super) tiles: Option<&'a Tiles>,
    /// Nodes that are in the file already and are referred to from now on.
    pub(super) defined: Vec<&'static str>,
}

impl Modes<'_, '_> {
    pub(super) fn write(&mut self, mode: Mode, out: &mut String) {
        let _ = writeln!(out, "          <Group DEF='{mode:?}'>");
        match mode {
            Mode::Nominal => self.nominal(out),
            Mode::Deviations => {
                self.coloured(out);
                out.push_str("            <Group USE='Names'/>\n");
            }
            Mode::Scan => {
                let _ = write!(out, "            <Shape>{CLAY}");
                scan::write(self.scene.scan, self.frame, out);
                out.push_str("</Shape>\n");
            }
            Mode::Actual => self.actual(out),
            Mode::Both => {
                self.actual(out);
                self.translucent(out);
            }
            Mode::BothHits => {
                self.actual(out);
                self.tiled(1, out);
            }
            Mode::Section => self.section(out),
            Mode::GeometryActual => self.geometry(out),
            Mode::GeometryBoth => {
                self.geometry(out);
                self.translucent(out);
            }
        }
        out.push_str("          </Group>\n");
    }

    /// The model as it is, readable by viewers without shaders. Defines the geometry that other modes use.
    fn nominal(&mut self, out: &mut String) {
        for (i, part) in self.parts.iter().enumerate() {
            let name = escape(&quoted(&part.name));
            let _ = writeln!(out, "            <Shape DEF='Part{i}'>");
            let _ =
                writeln!(out, "              <MetadataString name='part' value='{name}' containerField='metadata'/>");
            let solid = if i == 0 { SOLID } else { "<Appearance USE='Solid'/>" };
            let _ = writeln!(out, "              {solid}");
            part.write(i, &self.scene.tessellation.mesh, self.frame, out);
            out.push_str("            </Shape>\n");
        }
        out.push_str("            <Group DEF='Names'>\n");
        annotations::names(self.parts, &self.scene.tessellation.mesh, self.frame, out);
        out.push_str("            </Group>\n");
    }

    /// The geometry of all parts in one appearance, which is written once.
    fn shapes(&self, first: &str, further: &str, out: &mut String) {
        for i in 0..self.parts.len() {
            let appearance = if i == 0 { first } else { further };
            let _ = writeln!(out, "            <Shape>{appearance}<IndexedTriangleSet USE='Mesh{i}'/></Shape>");
        }
    }

    /// The model in the colours of its deviations.
    fn coloured(&mut self, out: &mut String) {
        if !self.first("Coloured") {
            out.push_str("            <Group USE='ColouredParts'/>\n");
            return;
        }
        let data = STANDARD.encode(&self.textures.colours);
        let appearance = format!(
            "<Appearance DEF='Coloured'><Material ambientIntensity='1' diffuseColor='1 1 1'/>\
             <ImageTexture repeatS='false' repeatT='false' url='\"data:image/png;base64,{data}\"'/></Appearance>"
        );
        out.push_str("            <Group DEF='ColouredParts'>\n");
        self.shapes(&appearance, "<Appearance USE='Coloured'/>", out);
        out.push_str("            </Group>\n");
    }

    /// The model as glass.
    fn translucent(&mut self, out: &mut String) {
        if !self.first("Translucent") {
            out.push_str("            <Group USE='Translucent'/>\n");
            return;
        }
        out.push_str("            <Group DEF='Translucent'>\n");
        self.shapes(GLASS, "<Appearance USE='Glass'/>", out);
        out.push_str("            </Group>\n");
    }

    /// The nearer hits.
    fn actual(&mut self, out: &mut String) {
        if self.first("ActualSurface") {
            out.push_str("            <Group DEF='ActualSurface'>\n");
            self.tiled(0, out);
            out.push_str("            </Group>\n");
        } else {
            out.push_str("            <Group USE='ActualSurface'/>\n");
        }
    }

    /// Shapes of tiles that show some hits.
    fn tiled(&mut self, hits: u8, out: &mut String) {
        let Some(tiles) = self.tiles else { return };
        out.push_str("            ");
        tiles.transform(self.frame, out);
        for [translation, colour] in tiles.shapes(hits) {
            let _ = write!(
                out,
                "\n<Shape><Appearance><Material diffuseColor='{colour}'/><TextureTransform translation='{translation}'/>"
            );
            self.tile_shader(tiles, Dialect::Desktop, out);
            self.tile_shader(tiles, Dialect::Web, out);
            out.push_str("</Appearance>");
            if self.first("Tile") {
                tiles.tile(out);
            } else {
                out.push_str("<IndexedTriangleStripSet USE='Tile'/>");
            }
            out.push_str("</Shape>");
        }
        out.push_str("</Transform>\n");
    }

    /// The desktop's shader is first, since Castle Game Engine takes the first whether or not it can compile it. X_ITE
    /// takes the first that it can use, and would say what it cannot: `load` keeps it from what it need not try, and
    /// Castle Game Engine does not know `load`.
    fn tile_shader(&mut self, tiles: &Tiles, dialect: Dialect, out: &mut String) {
        let name = if dialect == Dialect::Desktop { "DesktopTiles" } else { "WebTiles" };
        if !self.first(name) {
            let _ = write!(out, "<ComposedShader USE='{name}' containerField='shaders'/>");
            return;
        }
        let _ = writeln!(out, "\n<ComposedShader DEF='{name}' language='GLSL' containerField='shaders'>");
        self.common_fields(out);
        for (kind, field, value) in tiles.fields(self.frame) {
            let _ = writeln!(out, "<field accessType='inputOutput' type='{kind}' name='{field}' value='{value}'/>");
        }
        parts_of(&shaders::tiles(dialect), dialect == Dialect::Web, out);
        out.push_str("</ComposedShader>");
    }

    /// Displacement in the geometry stage.
    fn geometry(&mut self, out: &mut String) {
        let mut appearance = "<Appearance USE='Subdivided'/>".to_owned();
        if self.first("Subdivided") {
            appearance = "<Appearance DEF='Subdivided'><Material/>\n\
                          <ComposedShader language='GLSL' containerField='shaders'>\n"
                .to_owned();
            self.common_fields(&mut appearance);
            parts_of(&shaders::geometry(), false, &mut appearance);
            appearance.push_str("</ComposedShader></Appearance>");
        }
        self.shapes(&appearance, "<Appearance USE='Subdivided'/>", out);
    }

    /// The fields of all shaders.
    fn common_fields(&mut self, out: &mut String) {
        let scale = &self.scene.scale;
        let limits = scale.tolerance.map_or((0.0, 0.0, 0.0), |t| (t.lower, t.upper, scale.step_beyond(&t)));
        let fields = [
            ("distanceRows", f64::from(self.textures.rows)),
            ("fineDistance", self.textures.fine),
            ("maxDistance", self.scene.deviations.max_distance),
            ("colourRange", self.scene.scale.end),
            ("lowerLimit", limits.0),
            ("upperLimit", limits.1),
            ("stepBeyond", limits.2),
            ("exaggeration", 1.0),
        ];
        for (field, value) in fields {
            let _ = writeln!(out, "<field accessType='inputOutput' type='SFFloat' name='{field}' value='{value}'/>");
        }
        out.push_str("<field accessType='inputOutput' type='SFNode' name='distances'>\n");
        self.distances(out);
        out.push_str("</field>\n");
    }

    /// The texture of distances and tiles, once; its bytes must reach the shaders as they are.
    fn distances(&mut self, out: &mut String) {
        if !self.first("Distances") {
            out.push_str("<ImageTexture USE='Distances'/>\n");
            return;
        }
        let data = STANDARD.encode(&self.textures.coded);
        let _ = writeln!(
            out,
            "<ImageTexture DEF='Distances' repeatS='false' repeatT='false' url='\"data:image/png;base64,{data}\"'>\
             <TextureProperties magnificationFilter='NEAREST_PIXEL' minificationFilter='NEAREST_PIXEL' \
             boundaryModeS='CLAMP_TO_EDGE' boundaryModeT='CLAMP_TO_EDGE' generateMipMaps='false'/></ImageTexture>"
        );
    }

    /// The half of the model behind a plane, and the outlines of model and scan in it.
    fn section(&mut self, out: &mut String) {
        let plane = list_of(section::plane(self.frame), 9);
        let _ = writeln!(out, "            <Group><ClipPlane plane='{plane}'/>");
        self.coloured(out);
        out.push_str("            </Group>\n");
        section::outline(&self.scene.tessellation.mesh, OUTLINES[0], self.frame, out);
        section::outline(self.scene.scan, OUTLINES[1], self.frame, out);
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

/// The stages of a shader.
fn parts_of(stages: &[(&'static str, String)], web: bool, out: &mut String) {
    let load = if web { "" } else { " load='false'" };
    for (stage, source) in stages {
        let _ = writeln!(out, "<ShaderPart type='{stage}'{load}><![CDATA[data:text/plain,{source}]]></ShaderPart>");
    }
}
