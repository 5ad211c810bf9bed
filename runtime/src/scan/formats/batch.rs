//! Points on their way from a reader to what keeps them.

use crate::scan::cloud::{BATCH, Entry, NoPoint, Points, RawPoint};
use crate::scan::error::ScanFault;

/// Gathers points, and hands them on some thousands at a time.
pub(super) struct Batch<'a> {
    points: &'a mut dyn Points,
    gathered: Vec<RawPoint>,
    /// Cells without a point that are not reported yet.
    empty: u64,
    /// The size of the file in bytes.
    size: u64,
}

impl<'a> Batch<'a> {
    /// For a file of `size` bytes.
    pub(super) fn new(points: &'a mut dyn Points, size: u64) -> Self {
        Self { points, gathered: Vec::with_capacity(BATCH), empty: 0, size }
    }

    /// Adds a point, or counts an empty cell if its coordinates are not numbers; `read` bytes of the file were read.
    pub(super) fn push(&mut self, point: RawPoint, read: u64) -> Result<(), ScanFault> {
        if point.position.iter().all(|c| c.is_finite()) {
            self.gathered.push(point);
        } else {
            self.empty += 1;
        }
        self.when_full(read)
    }

    /// Counts a cell without a point.
    pub(super) fn push_empty(&mut self, read: u64) -> Result<(), ScanFault> {
        self.empty += 1;
        self.when_full(read)
    }

    fn when_full(&mut self, read: u64) -> Result<(), ScanFault> {
        if self.gathered.len() + self.empty as usize >= BATCH { self.flush(read) } else { Ok(()) }
    }

    /// Hands on what was gathered.
    pub(super) fn flush(&mut self, read: u64) -> Result<(), ScanFault> {
        if self.empty > 0 {
            self.points.leave_out(NoPoint::Empty, self.empty);
        }
        if self.empty > 0 || !self.gathered.is_empty() {
            // Without points too: this is where the user may end the work.
            self.points.take(&self.gathered)?;
        }
        self.empty = 0;
        self.gathered.clear();
        self.progress(read);
        Ok(())
    }

    /// Begins the next scan of the file.
    pub(super) fn begin(&mut self, entry: Entry, read: u64) -> Result<(), ScanFault> {
        self.flush(read)?;
        self.points.begin(entry);
        Ok(())
    }

    pub(super) fn unit(&mut self, millimetres: f64) {
        self.points.unit(millimetres);
    }

    /// The unit that files of the format have by custom.
    pub(super) fn usual_unit(&mut self, millimetres: f64) {
        self.points.usual_unit(millimetres);
    }

    /// A field of the file that is not read.
    pub(super) fn ignore(&mut self, field: &str) {
        self.points.ignore(field);
    }

    pub(super) fn warn(&mut self, sentence: String) {
        self.points.warn(sentence);
    }

    /// `read` bytes of the file were read.
    pub(super) fn progress(&mut self, read: u64) {
        self.points.progress(read as f64 / self.size.max(1) as f64);
    }
}

/// A file of one scan has no other.
pub(super) fn require_first(only: Option<usize>) -> Result<(), ScanFault> {
    match only {
        None | Some(0) => Ok(()),
        Some(_) => Err(ScanFault::NoSuchScan { count: 1 }),
    }
}
