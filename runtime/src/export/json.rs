//! Results as JSON files.

use super::atomic::{self, WriteError};
use serde::Serialize;
use std::io;
use std::path::Path;

/// Writes a result as indented JSON that ends with a line end. Equal results give equal bytes: fields come in the order
/// of their declaration, and numbers with the fewest digits that read back as the same double. JSON has no NaN and no
/// infinity: they become null.
///
/// # Errors
/// The file cannot be written, or a map has keys that are no text.
pub fn write(path: &Path, result: &impl Serialize) -> Result<(), WriteError> {
    let mut text = serde_json::to_vec_pretty(result)
        .map_err(|error| WriteError { path: path.to_owned(), source: io::Error::other(error) })?;
    text.push(b'\n');
    atomic::write(path, &text)
}

#[cfg(test)]
mod tests {
    use super::write;
    use serde::Serialize;
    use std::collections::BTreeMap;

    #[derive(Serialize)]
    struct Result {
        zeta: f64,
        alpha: [f64; 3],
        seconds: BTreeMap<&'static str, f64>,
    }

    #[test]
    fn pretty_and_the_same_every_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.json");
        let seconds = BTreeMap::from([("trace", 0.25), ("build", 1e-9)]);
        let result = Result { zeta: 0.1 + 0.2, alpha: [f64::NAN, f64::INFINITY, -0.0], seconds };
        write(&path, &result).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(
            text,
            "{\n  \"zeta\": 0.30000000000000004,\n  \"alpha\": [\n    null,\n    null,\n    -0.0\n  ],\n  \
             \"seconds\": {\n    \"build\": 1e-9,\n    \"trace\": 0.25\n  }\n}\n"
        );
        write(&path, &result).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }

    #[test]
    fn a_folder_that_is_missing_is_named() {
        let error = write(std::path::Path::new("/absent/result.json"), &1).unwrap_err().to_string();
        assert!(error.contains("/absent"), "{error}");
    }
}
