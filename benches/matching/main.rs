//! Whether hits of rays that belong elsewhere on the model are refused, and what else is lost: virtual scans of
//! examples whose deviations are known. `cargo bench --bench matching -- [SCANS [NAME]...]` needs no data and prints,
//! for scans without and with spikes and for shapes as the script has them and with dents and bumps of 2 mm, the share
//! of the area that is wrong (the distance is off by more than five standard deviations of the noise), how much of that
//! is refused, how much of the rest, and figures before and after.

mod shape;

use gml_runtime::model::Motion;
use gml_runtime::progress::Silent;
use gml_runtime::scan::Scan;
use gml_runtime::variance::{Device, Matching, MeasureOptions, Measurement, Reference, Resolution, measure};
use shape::{NOISE, Shape};

const NAMES: [&str; 6] = ["box", "cup", "mug", "can", "bowl", "flange"];

/// A distance is wrong that differs from the truth by so many standard deviations of the noise.
const WRONG: f64 = 5.0;

/// Dents and bumps of shapes that deviate. Millimetres.
const DENT: f64 = 2.0;

/// The share of outliers that scans have by default.
const OUTLIERS: f64 = 0.001;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let scans = words.iter().find_map(|w| w.parse().ok()).unwrap_or(1);
    let is_named = |name: &&str| words.iter().any(|w| w == name) || !words.iter().any(|w| NAMES.contains(&w.as_str()));
    for (dent, outliers) in [(0.0, 0.0), (0.0, OUTLIERS), (DENT, 0.0)] {
        println!("dents of {dent} mm, outliers {outliers}");
        println!("| | wrong | refused of it | lost of the rest | rms | max | true rms | trace | matching | spikes |");
        for name in NAMES.iter().filter(|name| is_named(name)) {
            let shape = Shape::of(name, dent);
            let mut sum = Figures::default();
            (1..=scans).for_each(|seed| sum.add(&shape, &shape.scanned(seed, outliers)));
            println!("| {name} | {sum}");
        }
    }
}

/// Areas, sums over them, and extremes. Square millimetres, millimetres, seconds.
#[derive(Default)]
struct Figures {
    wrong: f64,
    refused: f64,
    good: f64,
    lost: f64,
    squares: [f64; 3],
    largest: [f64; 2],
    spikes: usize,
    trace: f64,
    matching: f64,
}

impl Figures {
    fn add(&mut self, shape: &Shape, scan: &Scan) {
        let measured = |matching| {
            let mut options = MeasureOptions::default();
            options.resolution = Resolution::Side(1024);
            options.device = Device::Cpu;
            options.matching = matching;
            let reference = Reference::Model { model: &shape.program, x: &shape.x, motion: Motion::IDENTITY };
            measure(reference, scan, None, &options, &Silent).unwrap_or_else(|e| panic!("{e}"))
        };
        let [all, mutual]: [Measurement; 2] = [Matching::All, Matching::Mutual].map(measured);
        self.trace += mutual.report.seconds.cast;
        self.matching += mutual.report.seconds.matching;
        self.spikes += mutual.report.spikes;
        let texels = &all.deviations.texels;
        let truth = shape.truth(texels, all.deviations.max_distance);
        for i in 0..texels.len() {
            let [before, after] = [&all, &mutual].map(|m| f64::from(m.deviations.signed(i)));
            let (area, truth) = (f64::from(texels.area[i]), truth[i]);
            // Where the part itself is not met, the truth is not known.
            if before.is_nan() || truth.is_nan() {
                continue;
            }
            let is_off = |distance: f64| (distance - truth).abs() > WRONG * NOISE;
            let (of, gone) = match is_off(before) {
                true => (&mut self.wrong, (!is_off(after)).then_some(&mut self.refused)),
                false => (&mut self.good, after.is_nan().then_some(&mut self.lost)),
            };
            *of += area;
            if let Some(gone) = gone {
                *gone += area;
            }
            for (k, distance) in [before, after, truth].into_iter().enumerate().filter(|(_, d)| !d.is_nan()) {
                self.squares[k] += area * distance * distance;
            }
            self.largest[0] = self.largest[0].max(before.abs());
            self.largest[1] = self.largest[1].max(after.abs());
        }
    }
}

impl std::fmt::Display for Figures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let all = self.wrong + self.good;
        let [before, after, truth] = self.squares;
        write!(
            f,
            "{:.2} % | {:.1} % | {:.2} % | {:.3} -> {:.3} | {:.2} -> {:.2} | {:.3} | {:.2} s | {:.3} s | {} |",
            100.0 * self.wrong / all,
            100.0 * self.refused / self.wrong,
            100.0 * self.lost / self.good,
            (before / all).sqrt(),
            (after / (all - self.refused - self.lost)).sqrt(),
            self.largest[0],
            self.largest[1],
            (truth / all).sqrt(),
            self.trace,
            self.matching,
            self.spikes,
        )
    }
}
