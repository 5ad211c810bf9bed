//! What readers hand on, for their tests.

use crate::scan::cloud::{Entry, Input, NoPoint, Points, RawPoint};
use crate::scan::error::ScanFault;
use std::io::Cursor;

/// All that a file has.
#[derive(Debug, Default)]
pub(crate) struct Collected {
    pub(crate) points: Vec<RawPoint>,
    /// The scans, and the number of the first point of each.
    pub(crate) entries: Vec<(Entry, usize)>,
    pub(crate) marked: u64,
    pub(crate) empty: u64,
    pub(crate) unit: Option<f64>,
    pub(crate) warnings: Vec<String>,
    pub(crate) ignored: Vec<String>,
    pub(crate) progress: f64,
}

impl Points for Collected {
    fn unit(&mut self, millimetres: f64) {
        assert!(self.points.is_empty(), "units come before points");
        self.unit = Some(millimetres);
    }

    fn usual_unit(&mut self, millimetres: f64) {
        self.unit(millimetres);
    }

    fn begin(&mut self, entry: Entry) {
        self.entries.push((entry, self.points.len()));
    }

    fn take(&mut self, points: &[RawPoint]) -> Result<(), ScanFault> {
        self.points.extend_from_slice(points);
        Ok(())
    }

    fn leave_out(&mut self, why: NoPoint, count: u64) {
        match why {
            NoPoint::Marked => self.marked += count,
            NoPoint::Empty => self.empty += count,
        }
    }

    fn ignore(&mut self, field: &str) {
        self.ignored.push(field.to_owned());
    }

    fn progress(&mut self, share: f64) {
        assert!((0.0..=1.0).contains(&share), "{share}");
        self.progress = share;
    }

    fn warn(&mut self, sentence: String) {
        self.warnings.push(sentence);
    }
}

/// What a reader of clouds makes of some bytes.
pub(crate) fn collect(
    read: fn(Input, &mut dyn Points) -> Result<(), ScanFault>,
    bytes: &[u8],
    only: Option<usize>,
) -> Result<Collected, ScanFault> {
    let mut collected = Collected::default();
    let input = Input { bytes: Box::new(Cursor::new(bytes.to_vec())), size: bytes.len() as u64, only };
    read(input, &mut collected)?;
    Ok(collected)
}

/// Whether a reader lives through some thousands of faulty forms of a file: bytes that are changed, inserted, taken
/// away or repeated. What it makes of them is its own affair, as long as it hands on no more points than bytes.
pub(crate) fn mutate(read: fn(Input, &mut dyn Points) -> Result<(), ScanFault>, seeds: &[&[u8]], runs: u64) {
    const SPICE: &[u8] = b"\0\n\r\t ,;\"-+.0123456789eEnNaAxX#/\xff\xfe\xef\x80";
    for run in 0..runs {
        let mut state = run;
        let mut random = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below.max(1)
        };
        let mut bytes = seeds[random(seeds.len())].to_vec();
        for _ in 0..=random(6) {
            let at = random(bytes.len());
            let to = (at + 1 + random(12)).min(bytes.len());
            match random(6) {
                0 if at < bytes.len() => bytes[at] = random(256) as u8,
                1 if at < bytes.len() => bytes[at] = SPICE[random(SPICE.len())],
                2 => bytes.insert(at, SPICE[random(SPICE.len())]),
                3 => drop(bytes.drain(at..to)),
                4 => bytes.extend_from_within(at..to),
                5 => bytes.truncate(at),
                _ => {}
            }
        }
        if let Ok(collected) = collect(read, &bytes, (random(4) == 0).then(|| random(3))) {
            assert!(collected.points.len() <= bytes.len(), "run {run}");
        }
    }
}
