//! The JSON of a file, as far as it is about geometry.

use super::malformed;
use crate::scan::error::{ScanFault, shown};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    pub(super) scene: Option<usize>,
    pub(super) scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<View>,
    pub(super) buffers: Vec<Buffer>,
    pub(super) animations: Vec<IgnoredAny>,
    extensions_required: Vec<String>,
    pub(super) extensions_used: Vec<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Asset {
    version: String,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Scene {
    pub(super) nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: String,
    pub(super) mesh: Option<usize>,
    pub(super) skin: Option<usize>,
    pub(super) children: Vec<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Mesh {
    pub(super) name: String,
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Primitive {
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) mode: Option<u32>,
    pub(super) targets: Vec<IgnoredAny>,
    pub(super) extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparseList,
    pub(super) values: SparseList,
}

/// Of indices, or of values, whose type is the accessor's.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SparseList {
    pub(super) buffer_view: usize,
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct View {
    pub(super) buffer: usize,
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
    pub(super) extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: usize,
}

/// Extensions that a file may require without a loss: they are about how things look, or add types of numbers.
const HARMLESS: [&str; 8] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    "KHR_mesh_quantization",
];
/// What each node stands many times by; such copies are no nodes.
pub(super) const INSTANCING: &str = "EXT_mesh_gpu_instancing";

impl Document {
    /// Refuses other versions, and extensions without which the geometry is not what it seems.
    pub(super) fn require_readable(&self) -> Result<(), ScanFault> {
        let version = &self.asset.version;
        if version.split('.').next() != Some("2") {
            let message = format!("it has version `{}`; export it as glTF 2.0", shown(version));
            return Err(malformed("asset", message));
        }
        let is_harmless = |name: &&String| HARMLESS.iter().any(|begin| name.starts_with(begin));
        match self.extensions_required.iter().find(|name| !is_harmless(name)) {
            Some(name) => Err(extension("extensionsRequired", name)),
            None => Ok(()),
        }
    }
}

/// The fault of an extension that is not read.
pub(super) fn extension(place: impl Into<String>, name: &str) -> ScanFault {
    let fix = if name.contains("draco") || name.contains("meshopt") {
        "export it without compression, or undo that by a tool such as `gltf-transform copy`"
    } else {
        "export it without"
    };
    malformed(place, format!("it uses the extension `{}`, which is not read; {fix}", shown(name)))
}

impl Node {
    /// From its own coordinates to its parent's.
    pub(super) fn transform(&self) -> DAffine3 {
        if let Some(matrix) = self.matrix {
            return DAffine3::from_mat4(DMat4::from_cols_array(&matrix));
        }
        let turn = self.rotation.map_or(DQuat::IDENTITY, |q| {
            let turn = DQuat::from_array(q);
            if turn.length_squared() > 0.0 && turn.is_finite() { turn.normalize() } else { DQuat::IDENTITY }
        });
        let scale = self.scale.map_or(DVec3::ONE, DVec3::from);
        DAffine3::from_scale_rotation_translation(scale, turn, self.translation.unwrap_or_default().into())
    }
}
