//! The cup against the same in C, with derivatives written by hand: times of points and derivatives, and whether they
//! agree.
//!
//! `cargo bench --bench cup` prints tables. The two are run by turns and the least time of each counts, so that ratios
//! mean something on a machine that has other work. Fits evaluate scattered points: 66,191 of them, as many as the
//! cup's scan has, on the outer and the inner surface and on the handle. Tessellations evaluate grids: 128 x 64 of
//! either surface and 64 x 32 of the handle, 18,432 points. 15 parameters, doubles, one thread. Another table shows how
//! M and its gradient grow with points and with parameters.

mod c;
mod growth;
mod jax;
mod waves;

use gml_compiler::program::{Instance, Options, Order, Program, Sites, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// The parts, as the C version numbers them: scattered points, columns and rows of the grid.
const PARTS: [(&str, usize, [usize; 2]); 3] =
    [("outside", 28_000, [128, 64]), ("inside", 26_000, [128, 64]), ("handle", 12_191, [64, 32])];

/// Largest difference between the two, relative to the largest value of the same kind.
const TOLERANCE: f64 = 1e-12;

/// A part of the cup with its sites, and room for what is computed there.
struct Task {
    patch: usize,
    part: usize,
    /// Scattered.
    u: Vec<f64>,
    v: Vec<f64>,
    w: Vec<[f64; 3]>,
    columns: Vec<f64>,
    rows: Vec<f64>,
    out: Vec<f64>,
}

impl Task {
    fn new(program: &Program, part: usize) -> Task {
        let (name, count, sizes) = PARTS[part];
        let patch = program.parts().iter().position(|p| p.name == name).expect("the cup has this part");
        let [columns, rows] = sizes.map(|n| (0..n).map(|i| i as f64 / (n - 1) as f64).collect());
        // Points that fill the square evenly, in no order.
        let weyl = |step: f64| -> Vec<f64> { (0..count).map(|i| (0.5 + i as f64 * step).fract()).collect() };
        let (u, v) = (weyl(0.754_877_666_246_692_7), weyl(0.569_840_290_998_053_3));
        let w = (0..count).map(|i| [0.5, 1.3, 2.1].map(|k| (i as f64 * k).sin())).collect();
        Task { patch, part, u, v, w, columns, rows, out: Vec::new() }
    }

    fn sites(&self) -> Sites<'_> {
        Sites::Scattered(&self.u, &self.v)
    }

    /// Evaluates what a row of the table says, of which `out` has the length.
    fn ours(&mut self, instance: &Instance<'_>, row: Row) {
        let mut out = std::mem::take(&mut self.out);
        let sites = if row == Row::Grid { Sites::Grid(&self.columns, &self.rows) } else { self.sites() };
        instance.evaluate(self.patch, sites, row.order(&self.w), &mut out).unwrap_or_else(|e| panic!("{}", e.message));
        self.out = out;
    }

    /// The same in C.
    fn theirs(&mut self, c: &c::Peers, x: &[f64], row: Row) {
        let mut out = std::mem::take(&mut self.out);
        match row {
            Row::Grid => c.grid(x, self.part, [&self.columns, &self.rows], &mut out),
            _ => c.evaluate(x, self.part, [&self.u, &self.v], row.order(&self.w), &mut out),
        }
        self.out = out;
    }

    /// Makes room for the results of a row.
    fn clear(&mut self, program: &Program, row: Row) {
        let width = row.order(&[]).width(&program.parts()[self.patch]);
        self.out = match row {
            Row::Grid => vec![0.0; width * self.columns.len() * self.rows.len()],
            Row::Pullback => vec![0.0; program.parameters().len()],
            _ => vec![0.0; width * self.u.len()],
        };
    }
}

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Row {
    Points,
    Partials,
    SecondPartials,
    Jacobian,
    Pullback,
    /// Points on the grids.
    Grid,
}

const ROWS: [Row; 6] = [Row::Points, Row::Partials, Row::SecondPartials, Row::Jacobian, Row::Pullback, Row::Grid];

impl Row {
    fn order(self, w: &[[f64; 3]]) -> Order<'_> {
        match self {
            Row::Points | Row::Grid => Order::Points,
            Row::Partials => Order::Partials,
            Row::SecondPartials => Order::SecondPartials,
            Row::Jacobian => Order::Jacobian,
            Row::Pullback => Order::Pullback(w),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Row::Points => "points",
            Row::Partials => "partials",
            Row::SecondPartials => "second partials",
            Row::Jacobian => "Jacobian",
            Row::Pullback => "pullback",
            Row::Grid => "points, grids",
        }
    }
}

fn main() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/cup/cup.gml");
    let text = std::fs::read_to_string(path).expect("the example is there");
    let script = SourceFile { name: "cup.gml".to_owned(), text };
    let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
    program.prepare().expect("the cup has derivatives");
    let peers = match c::VARIANTS.iter().map(|v| c::Peers::new(*v)).collect::<Result<Vec<_>, _>>() {
        Ok(peers) => peers,
        Err(e) => return println!("no version in C: {e}"),
    };
    peers.iter().for_each(|c| println!("{}: {}\n", c.name, c.command));
    let x = [3.0, -2.0, 5.0, 0.2, -0.3, 0.4, 1.2, 41.0, 92.0, 0.93, 1.85, 0.97, 1.75, 0.22, 0.78];
    let mut tasks = [0, 1, 2].map(|part| Task::new(&program, part));
    peers.iter().for_each(|c| agree(c, &program, &x, &mut tasks));
    time(&peers, &program, &x, &mut tasks);
    waves::table(&peers[0]);
    growth::table(&program);
}

/// Largest difference, relative to the largest value.
fn deviation(ours: &[f64], theirs: &[f64]) -> f64 {
    let (mut worst, mut largest) = (0.0f64, f64::MIN_POSITIVE);
    for (a, b) in ours.iter().zip(theirs) {
        worst = worst.max((a - b).abs());
        largest = largest.max(b.abs());
    }
    worst / largest
}

fn agree(c: &c::Peers, program: &Program, x: &[f64], tasks: &mut [Task]) {
    let instance = program.instantiate(x).unwrap_or_else(|e| panic!("{}", e.message));
    print!("differences from {}:", c.name);
    for row in ROWS {
        let mut worst = 0.0f64;
        for task in &mut *tasks {
            task.clear(program, row);
            task.ours(&instance, row);
            let ours = std::mem::take(&mut task.out);
            task.clear(program, row);
            task.theirs(c, x, row);
            worst = worst.max(deviation(&ours, &task.out));
        }
        print!(" {} {worst:.1e}", row.name());
        assert!(worst <= TOLERANCE, "{} differ from the version in C by {worst:e}", row.name());
    }
    println!();
}

/// Least times of two things that are done by turns, in microseconds.
fn by_turns(mut ours: impl FnMut(), mut theirs: impl FnMut()) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(2) {
        for (least, run) in least.iter_mut().zip([&mut ours as &mut dyn FnMut(), &mut theirs]) {
            let start = Instant::now();
            run();
            *least = least.min(start.elapsed().as_secs_f64() * 1e6);
        }
    }
    least
}

/// Prints the least times of all versions, which run by turns.
fn time(peers: &[c::Peers], program: &Program, x: &[f64], tasks: &mut [Task]) {
    let jax = jax::times();
    print!("\n{:16}{:>10}", "us", "gmlc");
    peers.iter().for_each(|c| print!("{:>10}{:>10}", c.name, "ratio"));
    println!("{}", jax.map_or(String::new(), |_| format!("{:>10}{:>12}", "JAX", "JAX / gmlc")));
    // Every run begins with new parameters, so that nothing of the last ones is of use.
    let mut last = x.to_vec();
    for row in ROWS {
        tasks.iter_mut().for_each(|task| task.clear(program, row));
        let mut least = vec![f64::INFINITY; 1 + peers.len()];
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(3) {
            for (k, least) in least.iter_mut().enumerate() {
                let start = Instant::now();
                match k.checked_sub(1) {
                    None => {
                        last.iter_mut().for_each(|x| *x = x.next_up());
                        let instance =
                            program.instantiate(black_box(&last)).unwrap_or_else(|e| panic!("{}", e.message));
                        tasks.iter_mut().for_each(|task| task.ours(&instance, row));
                    }
                    Some(k) => tasks.iter_mut().for_each(|task| task.theirs(&peers[k], black_box(x), row)),
                }
                *least = least.min(start.elapsed().as_secs_f64() * 1e6);
            }
        }
        print!("{:16}{:10.1}", row.name(), least[0]);
        least[1..].iter().for_each(|theirs| print!("{theirs:10.1}{:10.2}", least[0] / theirs));
        let jax = jax.and_then(|times| times.into_iter().find(|(name, _)| *name == row.name()));
        println!("{}", jax.map_or(String::new(), |(_, us)| format!("{us:10.1}{:12.1}", us / least[0])));
    }
}
