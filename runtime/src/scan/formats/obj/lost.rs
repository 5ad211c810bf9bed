//! Signs that a part of an OBJ file was lost or is not what it seems: the format has no counts, so that a file that is
//! cut off reads as a smaller object, or as a cloud where no face is left.

use crate::scan::error::{ScanFault, shown};
use crate::scan::raw::Odd;

/// The part of the vertices, one in so many, that may belong to no face without a warning.
const UNUSED: usize = 10;

/// The statements of the format (Alias' 'Object Files', appendix B1 of the Advanced Visualizer manual), beside `v` and
/// `f`, which are looked at: they say nothing of triangles, or read as groups and normals.
const STATEMENTS: [&str; 41] = [
    "vn",
    "vp",
    "deg",
    "bmat",
    "step",
    "cstype",
    "p",
    "l",
    "fo",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "g",
    "s",
    "mg",
    "o",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "mtllib",
    "maplib",
    "usemap",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "call",
    "csh",
    "bsp",
    "bzp",
    "cdc",
    "cdp",
    "res",
];

/// Signs that are collected line by line.
#[derive(Default)]
pub(super) struct Signs {
    /// Lines of faces of fewer than three corners.
    short: Option<Odd<usize>>,
    /// Lines and weights of vertices with a weight that is not 1.
    weighted: Option<Odd<(usize, String)>>,
    /// Lines that the format does not know, with their texts.
    unknown: Option<Odd<(usize, String)>>,
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
                    Odd::add(&mut self.short, || number);
                }
            }
            Some("v") => {
                let mut rest = words.take_while(|word| !word.starts_with('#')).skip(3);
                if let (Some(weight), None) = (rest.next(), rest.next())
                    && weight.parse().is_ok_and(|weight: f64| weight != 1.0)
                {
                    Odd::add(&mut self.weighted, || (number, shown(weight)));
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
            Some(word) if !word.starts_with('#') && !STATEMENTS.contains(&word) => {
                Odd::add(&mut self.unknown, || (number, shown(line)));
            }
            _ => {}
        }
    }

    /// Warnings about a file with `vertices`, of which a mesh uses `used`; a cloud has none to tell.
    pub(super) fn warnings(&self, vertices: usize, used: Option<usize>, ends_within_line: bool) -> Vec<String> {
        const AGAIN: &str = "if the file was cut off, export it again";
        let mut warnings = Vec::new();
        if let Some(odd) = &self.short {
            let (line, others) = (odd.first, odd.others());
            warnings.push(format!("line {line}: a face of fewer than three corners is left out{others}"));
        }
        if let Some(odd) = &self.weighted {
            let ((line, weight), others) = (&odd.first, odd.others());
            warnings.push(format!(
                "line {line}: a vertex has the weight {weight}, by which its coordinates are divided{others}; if it is something else, export \
                 the file without it"
            ));
        }
        if let Some(odd) = &self.unknown {
            let ((line, text), others) = (&odd.first, odd.others());
            let text = if text.starts_with('\0') {
                "zero bytes, as of a file that was not written to its end, are left out".to_owned()
            } else {
                format!("`{text}` is no statement of the format and is left out")
            };
            warnings.push(format!("line {line}: {text}{others}"));
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
