//! The cup against the same in C, with derivatives written by hand: how long points, Jacobian and pullback take, and
//! whether they agree.
//!
//! `cargo bench --bench cup` prints a table. The two are run by turns and the least time of each counts, so that ratios mean
//! something on a machine that has other work. The grids are those of the outer and the inner surface (128 x 64) and of
//! the handle (64 x 32): 18,432 points, 15 parameters, doubles, one thread. A second table shows how M and its gradient grow with points and with parameters.

mod c;
mod growth;
mod jax;
mod waves;

use gml_compiler::program::{Instance, JacobianEntry, Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Part of the script, part of the C version, columns, rows.
const PARTS: [(&str, usize, usize, usize); 3] =
    [("outside", 0, 128, 64), ("inside", 1, 128, 64), ("handle", 2, 64, 32)];

/// What the two must agree to, relative to the largest value of the same kind: coordinates, derivatives by one parameter.
const TOLERANCE: f64 = 1e-12;

/// A part on its grid, with room for what is computed there.
struct Task {
    patch: usize,
    part: usize,
    entries: Vec<JacobianEntry>,
    columns: Vec<f64>,
    rows: Vec<f64>,
    /// Of every point.
    w: Vec<[f64; 3]>,
    points: Vec<f64>,
    jacobian: Vec<f64>,
    dense: Vec<f64>,
}

impl Task {
    fn new(program: &Program, (name, part, columns, rows): (&str, usize, usize, usize)) -> Task {
        let patch = program.parts().iter().position(|p| p.name == name).expect("the cup has this part");
        let entries = program.jacobian_entries(patch);
        let varying = entries.iter().filter(|e| e.constant.is_none()).count();
        let even = |n: usize| -> Vec<f64> { (0..n).map(|i| i as f64 / (n - 1) as f64).collect() };
        let (columns, rows) = (even(columns), even(rows));
        let n = columns.len() * rows.len();
        let w = (0..n).map(|i| [0.5, 1.3, 2.1].map(|k| (i as f64 * k).sin())).collect();
        let jacobian = vec![0.0; n * varying];
        Task { patch, part, entries, columns, rows, w, points: vec![0.0; 3 * n], jacobian, dense: vec![0.0; 45 * n] }
    }

    fn grid(&self) -> [&[f64]; 2] {
        [&self.columns, &self.rows]
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
    let instance = program.instantiate(&x).unwrap_or_else(|e| panic!("{}", e.message));
    let mut tasks = PARTS.map(|part| Task::new(&program, part));
    peers.iter().for_each(|c| agree(c, &instance, &x, &mut tasks));
    time(&peers, &program, &x, &mut tasks);
    waves::table(&peers[0]);
    growth::table(&program);
}

/// Largest difference, relative to the largest value.
fn deviation(ours: impl Iterator<Item = f64>, theirs: impl Iterator<Item = f64>) -> f64 {
    let (mut worst, mut largest) = (0.0f64, f64::MIN_POSITIVE);
    for (a, b) in ours.zip(theirs) {
        worst = worst.max((a - b).abs());
        largest = largest.max(b.abs());
    }
    worst / largest
}

/// Our Jacobian as the version in C has it.
fn dense(task: &Task) -> Vec<f64> {
    let mut dense = vec![0.0; task.dense.len()];
    let mut values = task.jacobian.iter();
    for point in dense.chunks_exact_mut(45) {
        for entry in &task.entries {
            let value = entry.constant.or_else(|| values.next().copied()).unwrap_or(f64::NAN);
            point[15 * usize::from(entry.coordinate) + entry.param as usize] = value;
        }
    }
    dense
}

fn agree(c: &c::Peers, instance: &Instance<'_>, x: &[f64], tasks: &mut [Task]) {
    let mut gradients = [vec![0.0; 15], vec![0.0; 15]];
    let [mut of_points, mut of_jacobian] = [0.0f64; 2];
    for task in tasks {
        let n = task.w.len();
        let mut theirs = vec![0.0; 3 * n];
        c.points(x, task.part, task.grid(), &mut theirs);
        instance.points_grid(task.patch, &task.columns, &task.rows, &mut task.points).expect("points");
        of_points = of_points.max(deviation(task.points.iter().copied(), theirs.iter().copied()));

        c.jacobian(x, task.part, [&task.columns, &task.rows], &mut task.dense);
        instance.jacobian_grid(task.patch, &task.columns, &task.rows, &mut task.jacobian).expect("a Jacobian");
        let ours = dense(task);
        for param in 0..15 {
            let of = |all: &[f64]| (0..3 * n).map(|i| all[15 * i + param]).collect::<Vec<_>>();
            of_jacobian = of_jacobian.max(deviation(of(&ours).into_iter(), of(&task.dense).into_iter()));
        }
        instance.pullback_grid(task.patch, &task.columns, &task.rows, &task.w, &mut gradients[0]).expect("a pullback");
        c.pullback(x, task.part, task.grid(), &task.w, &mut gradients[1]);
    }
    let [ours, theirs] = gradients;
    // Sums of 18,432 terms of both signs: relative to the gradient's length.
    let of_pullback = deviation(ours.into_iter(), theirs.into_iter());
    println!("differences: M {of_points:.1e}, Jacobian {of_jacobian:.1e}, pullback {of_pullback:.1e}");
    for (what, found) in [("M", of_points), ("Jacobian", of_jacobian), ("pullback", of_pullback)] {
        assert!(found <= TOLERANCE, "{what} differs from the version in C by {found:e}");
    }
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

/// The versions in C that ours is compared with, and what JAX takes, where it is there.
struct Table<'a> {
    peers: &'a [c::Peers],
    jax: Option<[f64; 3]>,
    rows: usize,
}

impl Table<'_> {
    fn head(&self) {
        print!("\n{:10}{:>10}", "us", "gmlc");
        self.peers.iter().for_each(|c| print!("{:>10}{:>10}", c.name, "ratio"));
        println!("{}", self.jax.map_or(String::new(), |_| format!("{:>10}{:>12}", "JAX", "JAX / gmlc")));
    }

    /// Prints the least times of all, which run by turns.
    fn row(
        &mut self,
        name: &str,
        tasks: &mut [Task],
        mut ours: impl FnMut(&mut [Task]),
        mut theirs: impl FnMut(&c::Peers, &mut [Task]),
    ) {
        let mut least = vec![f64::INFINITY; 1 + self.peers.len()];
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(3) {
            for (k, least) in least.iter_mut().enumerate() {
                let start = Instant::now();
                match k.checked_sub(1) {
                    None => ours(tasks),
                    Some(k) => theirs(&self.peers[k], tasks),
                }
                *least = least.min(start.elapsed().as_secs_f64() * 1e6);
            }
        }
        print!("{name:10}{:10.1}", least[0]);
        least[1..].iter().for_each(|theirs| print!("{theirs:10.1}{:10.2}", least[0] / theirs));
        println!(
            "{}",
            self.jax.map_or(String::new(), |t| format!("{:10.1}{:12.1}", t[self.rows], t[self.rows] / least[0]))
        );
        self.rows += 1;
    }
}

fn time(peers: &[c::Peers], program: &Program, x: &[f64], tasks: &mut [Task]) {
    let mut table = Table { peers, jax: jax::times(), rows: 0 };
    table.head();
    // Every run begins with new parameters, so that nothing of the last ones is of use.
    let last = std::cell::Cell::new(x.to_vec());
    let instance = || {
        let mut x = last.take();
        x.iter_mut().for_each(|x| *x = x.next_up());
        let instance = program.instantiate(black_box(&x)).unwrap_or_else(|e| panic!("{}", e.message));
        last.set(x);
        instance
    };
    table.row(
        "M",
        tasks,
        |tasks| {
            let instance = instance();
            for t in tasks {
                instance.points_grid(t.patch, &t.columns, &t.rows, &mut t.points).expect("points");
            }
        },
        |c, tasks| {
            tasks.iter_mut().for_each(|t| c.points(black_box(x), t.part, [&t.columns, &t.rows], &mut t.points));
        },
    );
    table.row(
        "Jacobian",
        tasks,
        |tasks| {
            let instance = instance();
            for t in tasks {
                instance.jacobian_grid(t.patch, &t.columns, &t.rows, &mut t.jacobian).expect("a Jacobian");
            }
        },
        |c, tasks| {
            tasks.iter_mut().for_each(|t| c.jacobian(black_box(x), t.part, [&t.columns, &t.rows], &mut t.dense));
        },
    );
    let mut gradients = [[0.0; 15]; 2];
    let [ours, theirs] = &mut gradients;
    table.row(
        "pullback",
        tasks,
        |tasks| {
            let instance = instance();
            for t in tasks {
                instance.pullback_grid(t.patch, &t.columns, &t.rows, &t.w, ours).expect("a pullback");
            }
        },
        |c, tasks| {
            tasks.iter().for_each(|t| c.pullback(black_box(x), t.part, [&t.columns, &t.rows], &t.w, theirs));
        },
    );
}
