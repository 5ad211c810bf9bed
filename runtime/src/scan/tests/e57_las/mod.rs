//! Readers and writers of E57 and LAS, against each other, made files, mutations and real data.

mod data;
mod e57;
mod las;
mod made;
mod mutations;
mod round_trip;

use crate::scan::ScanFault;
use crate::scan::cloud::{Entry, Input, NoPoint, Points, RawPoint};
use crate::scan::formats;

/// All that a reader says.
#[derive(Debug, Default)]
struct Collected {
    unit: Option<f64>,
    entries: Vec<Entry>,
    points: Vec<RawPoint>,
    /// By point, the index of its entry.
    of: Vec<usize>,
    marked: u64,
    empty: u64,
    warnings: Vec<String>,
    share: f64,
}

impl Points for Collected {
    fn unit(&mut self, millimetres: f64) {
        assert!(self.points.is_empty(), "the unit comes first");
        self.unit = Some(millimetres);
    }

    fn usual_unit(&mut self, millimetres: f64) {
        self.unit(millimetres);
    }

    fn begin(&mut self, entry: Entry) {
        self.entries.push(entry);
    }

    fn take(&mut self, points: &[RawPoint]) -> Result<(), ScanFault> {
        self.points.extend_from_slice(points);
        self.of.resize(self.points.len(), self.entries.len().saturating_sub(1));
        Ok(())
    }

    fn leave_out(&mut self, why: NoPoint, count: u64) {
        match why {
            NoPoint::Marked => self.marked += count,
            NoPoint::Empty => self.empty += count,
        }
    }

    fn ignore(&mut self, _: &str) {}

    fn progress(&mut self, share: f64) {
        assert!((self.share..=1.0).contains(&share), "{share} follows {}", self.share);
        self.share = share;
    }

    fn warn(&mut self, sentence: String) {
        self.warnings.push(sentence);
    }
}

/// Reads a file of either format, as its beginning says.
fn collect(bytes: &[u8], only: Option<usize>) -> Result<Collected, ScanFault> {
    let mut collected = Collected::default();
    let read = if bytes.starts_with(b"LASF") { formats::las::read } else { formats::e57::read };
    let source = std::io::Cursor::new(bytes.to_vec());
    read(Input { bytes: Box::new(source), size: bytes.len() as u64, only }, &mut collected)?;
    Ok(collected)
}

/// The message of a file that is not read.
fn message(bytes: &[u8]) -> String {
    collect(bytes, None).unwrap_err().to_string()
}
