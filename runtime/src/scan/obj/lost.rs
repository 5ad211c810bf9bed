//! Signs that a part of an OBJ file was lost: the format has no counts, so that a file that is cut off reads as a
//! smaller object, or as a cloud where no face is left.

use crate::scan::error::{ScanFault, shown};

/// The part of the vertices, one in so many, that may belong to no face without a warning.
const UNUSED: usize = 10;

/// Signs that are collected line by line.
#[derive(Default)]
pub(super) struct Signs {
    /// The first line of a face of fewer than three corners, and the number of those.
    short: Option<(usize, usize)>,
    /// Vertices and faces by the comments of programs that write their counts.
    announced: [usize; 2],
    faces: usize,
    /// A statement that belongs to faces only.
    of_faces: Option<&'static str>,
}

impl Signs {
    /// Looks at a line of the file.
    pub(super) fn look(&mut self, line: &str, number: usize) {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("f") => {
                self.faces += 1;
                if words.take_while(|word| !word.starts_with('#')).count() < 3 {
                    self.short.get_or_insert((number, 0)).1 += 1;
                }
            }
            Some("vt") => self.of_faces = Some("vt"),
            Some("usemtl") => self.of_faces = Some("usemtl"),
            Some("#") => {
                let (Some(a), Some(b), None) = (words.next(), words.next(), words.next()) else { return };
                let kinds = ["vertices", "faces"].map(|kind| (kind, a.trim_end_matches(':'), b));
                for ((kind, a, b), announced) in kinds.into_iter().zip(&mut self.announced) {
                    let number = if a.eq_ignore_ascii_case(kind) { b } else { a };
                    if a.eq_ignore_ascii_case(kind) || b.eq_ignore_ascii_case(kind) {
                        *announced = announced.saturating_add(number.parse().unwrap_or(0));
                    }
                }
            }
            _ => {}
        }
    }

    /// Warnings about a file with `vertices`, of which a mesh uses `used`; a cloud has none to tell.
    pub(super) fn warnings(&self, vertices: usize, used: Option<usize>, ends_within_line: bool) -> Vec<String> {
        const AGAIN: &str = "if the file was cut off, export it again";
        let mut warnings = Vec::new();
        if let Some((line, count)) = self.short {
            let others = if count > 1 { format!(" ({} more like it)", count - 1) } else { String::new() };
            warnings.push(format!("line {line}: a face of fewer than three corners is left out{others}"));
        }
        for ((kind, is), announced) in [("vertices", vertices), ("faces", self.faces)].into_iter().zip(self.announced) {
            if is < announced {
                warnings.push(format!("its comments announce {announced} {kind}, and {is} are there; {AGAIN}"));
            }
        }
        match used {
            Some(used) if (vertices - used.min(vertices)).saturating_mul(UNUSED) > vertices => {
                let unused = vertices - used;
                warnings
                    .push(format!("{unused} of its {vertices} vertices belong to no face and are left out; {AGAIN}"));
            }
            None => {
                let statement = self.of_faces.map(|statement| format!("it has `{statement}`, which faces use"));
                let end = || ends_within_line.then(|| "its last line has no end".to_owned());
                if let Some(sign) = statement.or_else(end) {
                    warnings.push(format!("it is read as a cloud of points: it has no faces, though {sign}; {AGAIN}"));
                }
            }
            Some(_) => {}
        }
        warnings
    }
}

/// Refuses a last line that has no end and is not whole.
pub(super) fn require_whole_end(text: &str) -> Result<(), ScanFault> {
    if text.ends_with(['\n', '\r']) {
        return Ok(());
    }
    let line = text.lines().next_back().unwrap_or_default();
    let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
    let slashes = |word: &str| word.matches('/').count();
    let whole = match words.next() {
        Some("v" | "vn") => words.count() >= 3,
        Some("vt") => words.count() >= 1,
        Some("f") => {
            let mut corners = words.map(|word| (slashes(word), word.ends_with('/')));
            let first = corners.next();
            let others: Vec<_> = corners.collect();
            others.len() >= 2 && others.iter().all(|corner| Some(*corner) == first)
        }
        _ => true,
    };
    if whole {
        return Ok(());
    }
    let place = format!("line {}", text.lines().count());
    let message = format!("the file ends within `{}`; it is cut off: export it again", shown(line));
    Err(ScanFault::malformed("OBJ", place, message))
}
