//! OFF as bytes: whole numbers of 32 bits and numbers of single precision, the most significant byte first.

use super::{FORMAT, Mesh};
use crate::scan::error::ScanFault;

/// What follows the word `BINARY`.
struct Body<'a> {
    rest: &'a [u8],
    /// Size of the file.
    size: usize,
}

impl Body<'_> {
    fn fault(&self, message: impl Into<String>) -> ScanFault {
        ScanFault::malformed(FORMAT, format!("byte {}", self.size - self.rest.len()), message)
    }

    fn number(&mut self, what: &str) -> Result<[u8; 4], ScanFault> {
        let Some((number, rest)) = self.rest.split_first_chunk() else {
            return Err(self.fault(format!("the file ends within {what}; it is cut off: export it again")));
        };
        self.rest = rest;
        Ok(*number)
    }

    fn whole(&mut self, what: &str) -> Result<i32, ScanFault> {
        self.number(what).map(i32::from_be_bytes)
    }

    fn count(&mut self, what: &str) -> Result<usize, ScanFault> {
        let count = self.whole(what)?;
        usize::try_from(count).map_err(|_| self.fault(format!("{what} is {count}")))
    }
}

/// Reads what follows the word `BINARY` in a file of `size` bytes.
pub(super) fn read(body: &[u8], size: usize, mesh: &mut Mesh) -> Result<(), ScanFault> {
    let line = body.iter().position(|b| *b == b'\n').map_or(body.len(), |end| end + 1);
    let mut body = Body { rest: &body[line..], size };
    let vertices = body.count("the number of vertices")?;
    let faces = body.count("the number of faces")?;
    body.number("the number of edges")?;
    // Colours have an opacity here.
    let mut numbers = vec![0.0; mesh.kind.numbers() + usize::from(mesh.kind.colours)];
    for _ in 0..vertices {
        for number in &mut numbers {
            *number = f32::from_be_bytes(body.number("the vertices")?).into();
        }
        mesh.add_vertex(&numbers);
    }
    let mut corners = Vec::new();
    for face in 1..=faces {
        let what = "the faces";
        let count = body.count(what)?;
        corners.clear();
        for _ in 0..count {
            let index = body.whole(what)?;
            corners.push(mesh.corner(index.into(), || format!("face {face} (counted from 1)"))?);
        }
        mesh.add_face(&corners, face);
        for _ in 0..body.count(what)? {
            body.number(what)?;
        }
    }
    if !body.rest.is_empty() {
        let message = format!("{} bytes follow the last face; export it again", body.rest.len());
        return Err(body.fault(message));
    }
    Ok(())
}
