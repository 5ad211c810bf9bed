//! The file of the scene.

use crate::export::atomic::{self, WriteError};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::Write;
use std::path::Path;

/// How the scene is encoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SceneFormat {
    /// XML.
    #[default]
    X3d,
    /// XML, compressed with gzip.
    X3dz,
}

impl SceneFormat {
    /// The name of its file.
    #[must_use]
    pub const fn file(self) -> &'static str {
        match self {
            Self::X3d => "model.x3d",
            Self::X3dz => "model.x3dz",
        }
    }

    /// Writes a scene into a folder, which must exist.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(self, folder: &Path, scene: &str) -> Result<(), WriteError> {
        let file = folder.join(self.file());
        match self {
            Self::X3d => atomic::write(&file, scene.as_bytes()),
            Self::X3dz => {
                let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
                // Writing to memory does not fail.
                let _ = encoder.write_all(scene.as_bytes());
                atomic::write(&file, &encoder.finish().unwrap_or_default())
            }
        }
    }
}
