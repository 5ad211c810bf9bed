//! Between the readers of clouds and what keeps their points: files of clouds are read in batches, since they may have
//! more points than the memory holds.

use super::attributes::Station;
use super::error::ScanFault;
use std::io::{Read, Seek};

/// What readers of clouds read from.
pub(crate) trait Source: Read + Seek + Send + Sync {}

impl<T: Read + Seek + Send + Sync> Source for T {}

/// A file, open at its beginning.
pub(crate) struct Input {
    /// Its bytes.
    pub(crate) bytes: Box<dyn Source>,
    /// Their number.
    pub(crate) size: u64,
    /// Of the scans in it only this one is wanted, counted from 0.
    pub(crate) only: Option<usize>,
}

/// A point as its file has it, in the file's unit; poses in the file are applied.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RawPoint {
    pub(crate) position: [f64; 3],
    /// Of any length.
    pub(crate) normal: Option<[f32; 3]>,
    pub(crate) colour: Option<[u8; 3]>,
    pub(crate) intensity: Option<f32>,
}

/// One of the scans that a file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Entry {
    /// Its name; empty where it has none.
    pub(crate) name: String,
    /// Where the scanner stood, in the file's unit; none where the file does not tell.
    pub(crate) station: Option<Station>,
}

/// Why points of a file are none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoPoint {
    /// The file marks them as invalid, or as noise, or withheld.
    Marked,
    /// Cells of a grid without an echo, or coordinates that are not a number.
    Empty,
}

/// Receives the points of a file.
pub(crate) trait Points {
    /// The unit that the file states, in millimetres. Before the first point.
    fn unit(&mut self, millimetres: f64);

    /// The unit that files of the format have by custom, in millimetres, where this one does not state it.
    fn usual_unit(&mut self, millimetres: f64);

    /// Begins the next of the scans in the file: points that follow belong to it. A file of one scan need not say so.
    fn begin(&mut self, entry: Entry);

    /// Takes points, some thousands at a time. The error says that the user has ended the work.
    fn take(&mut self, points: &[RawPoint]) -> Result<(), ScanFault>;

    /// Counts what is no point.
    fn leave_out(&mut self, why: NoPoint, count: u64);

    /// A field of the file that is not read.
    fn ignore(&mut self, field: &str);

    /// The share of the file that has been read, from 0 to 1.
    fn progress(&mut self, share: f64);

    /// A sentence about a fault of the file that is put up with; the file's name is put before it.
    fn warn(&mut self, sentence: String);
}

/// The number of points that readers hand on at a time.
pub(crate) const BATCH: usize = 4096;
