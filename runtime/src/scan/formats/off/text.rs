//! OFF as text: a line a vertex, a line a face.

use super::{FORMAT, Mesh};
use crate::scan::error::{ScanFault, shown};

/// Lines with a content: their numbers, counted from 1, and their words without comments.
struct Lines<'a> {
    rest: &'a [u8],
    line: usize,
    end: u8,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<(usize, &'a [u8])> {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|b| *b == self.end).unwrap_or(self.rest.len());
            let (line, rest) = self.rest.split_at(end);
            self.rest = rest.get(1..).unwrap_or_default();
            self.line += 1;
            let comment = line.iter().position(|b| *b == b'#').unwrap_or(line.len());
            let content = line[..comment].trim_ascii();
            if !content.is_empty() {
                return Some((self.line, content));
            }
        }
        None
    }
}

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn fault(line: usize, message: String) -> ScanFault {
    ScanFault::malformed(FORMAT, format!("line {line}"), message)
}

fn text_of(line: &[u8]) -> String {
    shown(&String::from_utf8_lossy(&line[..line.len().min(400)]))
}

/// Reads a file whose first word ends at `start`.
pub(super) fn read(bytes: &[u8], start: usize, mesh: &mut Mesh) -> Result<(), ScanFault> {
    // Files from old programs have no line end but this.
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let line = bytes[..start].iter().filter(|b| **b == end).count();
    let mut lines = Lines { rest: &bytes[start..], line, end };
    let expected = "expected the numbers of vertices, faces and edges";
    let Some((line, content)) = lines.next() else {
        return Err(fault(lines.line.max(1), format!("{expected}, the file ends; it is cut off: export it again")));
    };
    let counts: Option<Vec<usize>> = words(content).map(parse).collect();
    // The number of edges is used by nobody, and missing at times.
    let Some([vertices, faces] | [vertices, faces, _]) = counts.as_deref() else {
        return Err(fault(line, format!("{expected}, found `{}`", text_of(content))));
    };
    read_vertices(&mut lines, *vertices, mesh)?;
    read_faces(&mut lines, *faces, mesh)?;
    match lines.next() {
        Some((line, content)) => {
            let message = format!(
                "`{}` follows the last of the {vertices} vertices and {faces} faces that the header counts; export it again",
                text_of(content)
            );
            Err(fault(line, message))
        }
        None => Ok(()),
    }
}

fn cut_off(lines: &Lines, counted: usize, what: &str, read: usize) -> ScanFault {
    let message =
        format!("the header counts {counted} {what}, the file ends after {read}; it is cut off: export it again");
    fault(lines.line, message)
}

fn read_vertices(lines: &mut Lines, count: usize, mesh: &mut Mesh) -> Result<(), ScanFault> {
    let mut numbers = Vec::new();
    for read in 0..count {
        let Some((line, content)) = lines.next() else { return Err(cut_off(lines, count, "vertices", read)) };
        numbers.clear();
        for word in words(content) {
            let number = parse::<f64>(word);
            numbers.push(number.ok_or_else(|| fault(line, format!("expected a number, found `{}`", text_of(word))))?);
        }
        if !mesh.add_vertex(&numbers) {
            let (name, least) = (mesh.kind.name(), mesh.kind.numbers());
            let most = if mesh.kind.colours { format!(" or {}", least + 1) } else { String::new() };
            let message = format!(
                "a vertex of `{name}` has {least}{most} numbers on a line of its own, found {}: `{}`; the prefixes C, N, ST and 4 \
                 of `OFF` say what it has beside its position",
                numbers.len(),
                text_of(content)
            );
            return Err(fault(line, message));
        }
    }
    Ok(())
}

fn read_faces(lines: &mut Lines, count: usize, mesh: &mut Mesh) -> Result<(), ScanFault> {
    let mut corners = Vec::new();
    for read in 0..count {
        let Some((line, content)) = lines.next() else { return Err(cut_off(lines, count, "faces", read)) };
        let wrong = || {
            let expected = "a face is its number of corners and as many vertices, on a line of its own";
            fault(line, format!("{expected}; found `{}`", text_of(content)))
        };
        let mut words = words(content);
        let announced: usize = words.next().and_then(parse).ok_or_else(wrong)?;
        corners.clear();
        // What follows is a colour.
        for word in words.take(announced) {
            let index = parse(word).ok_or_else(wrong)?;
            corners.push(mesh.corner(index, || format!("line {line}: face {} (counted from 1)", read + 1))?);
        }
        if corners.len() < announced {
            return Err(wrong());
        }
        mesh.add_face(&corners, read + 1);
    }
    Ok(())
}
