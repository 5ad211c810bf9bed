//! The peers in C, compiled and loaded.

use gml_compiler::program::Order;
use libloading::Library;
use std::path::{Path, PathBuf};

type GridFunction =
    unsafe extern "C" fn(x: *const f64, part: i32, u: *const f64, nu: i32, v: *const f64, nv: i32, out: *mut f64);
type DerivativesFunction =
    unsafe extern "C" fn(x: *const f64, part: i32, order: i32, u: *const f64, v: *const f64, n: i32, out: *mut f64);
type JacobianFunction =
    unsafe extern "C" fn(x: *const f64, part: i32, u: *const f64, v: *const f64, n: i32, out: *mut f64);
type PullbackFunction = unsafe extern "C" fn(
    x: *const f64,
    part: i32,
    u: *const f64,
    v: *const f64,
    n: i32,
    w: *const f64,
    gradient: *mut f64,
);

/// The functions of benches/peers/cup.c and waves.c.
pub(crate) struct Peers {
    grid: GridFunction,
    derivatives: DerivativesFunction,
    jacobian: JacobianFunction,
    pullback: PullbackFunction,
    waves: GridFunction,
    /// Keeps the code of the functions.
    _library: Library,
    /// The version.
    pub(crate) name: &'static str,
    /// How it was compiled.
    pub(crate) command: String,
}

/// Names of the versions in C, and the machines that they are compiled for: this one; and one whose vectors have 128
/// bits and that does not multiply and add at once, as Cranelift's code does not.
pub(crate) const VARIANTS: &[(&str, &str)] =
    if cfg!(target_arch = "x86_64") { &[("C", "native"), ("C, 128", "x86-64-v2")] } else { &[("C", "native")] };

const PARAMETERS: usize = 15;

/// Parameters that each part depends on.
const ACTIVE: [usize; 3] = [9, 9, 15];

/// Columns for which the C version has room.
const MAX_COLUMNS: usize = 4096;

impl Peers {
    /// Compiles it with the system's C compiler.
    pub(crate) fn new((name, machine): (&'static str, &str)) -> Result<Peers, Box<dyn std::error::Error>> {
        let peers = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers");
        let sources = ["cup.c", "waves.c"].map(|name| peers.join(name));
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
        let made = folder.join(format!("by_hand_{machine}.so"));
        let (command, compiled) = compile(&sources, machine, &made, &folder)?;
        if !compiled {
            return Err(format!("{command} failed").into());
        }
        // SAFETY: the library has no initialisers, and its functions have the types that the files declare.
        unsafe {
            let library = Library::new(&made)?;
            let grid = *library.get::<GridFunction>(b"cup_grid\0")?;
            let derivatives = *library.get::<DerivativesFunction>(b"cup_derivatives\0")?;
            let jacobian = *library.get::<JacobianFunction>(b"cup_jacobian\0")?;
            let pullback = *library.get::<PullbackFunction>(b"cup_pullback\0")?;
            let waves = *library.get::<GridFunction>(b"wave_points\0")?;
            Ok(Peers { grid, derivatives, jacobian, pullback, waves, _library: library, name, command })
        }
    }

    /// Points of a part on a grid: `out[rows][columns][3]`.
    pub(crate) fn grid(&self, x: &[f64], part: usize, [u, v]: [&[f64]; 2], out: &mut [f64]) {
        assert!(x.len() == PARAMETERS && u.len() <= MAX_COLUMNS && out.len() == 3 * u.len() * v.len());
        let (nu, nv) = (u.len() as i32, v.len() as i32);
        // SAFETY: the slices have the lengths that the function reads and writes.
        unsafe { (self.grid)(x.as_ptr(), part as i32, u.as_ptr(), nu, v.as_ptr(), nv, out.as_mut_ptr()) }
    }

    /// The results of an order for a part at scattered points, in the layout of gmlc.
    pub(crate) fn evaluate(&self, x: &[f64], part: usize, [u, v]: [&[f64]; 2], order: Order<'_>, out: &mut [f64]) {
        let n = u.len();
        let (derivatives, length) = match order {
            Order::Points => (0, 3 * n),
            Order::Partials => (1, 9 * n),
            Order::SecondPartials => (2, 18 * n),
            Order::Jacobian => (0, 3 * ACTIVE[part] * n),
            Order::Pullback(w) => {
                assert_eq!(w.len(), n);
                (0, PARAMETERS)
            }
            Order::Decisions => panic!("the peer has none"),
        };
        assert!(x.len() == PARAMETERS && v.len() == n && out.len() == length);
        let (x, part, n, out) = (x.as_ptr(), part as i32, n as i32, out.as_mut_ptr());
        let (u, v) = (u.as_ptr(), v.as_ptr());
        // SAFETY: the slices have the lengths that the functions read and write.
        unsafe {
            match order {
                Order::Jacobian => (self.jacobian)(x, part, u, v, n, out),
                Order::Pullback(w) => (self.pullback)(x, part, u, v, n, w.as_flattened().as_ptr(), out),
                _ => (self.derivatives)(x, part, derivatives, u, v, n, out),
            }
        }
    }

    /// Points of a surface of waves.c, by its index.
    pub(crate) fn wave(&self, x: &[f64], kind: usize, [u, v]: [&[f64]; 2], out: &mut [f64]) {
        assert_eq!((x.len(), out.len()), (4, 3 * u.len() * v.len()));
        let (nu, nv) = (u.len() as i32, v.len() as i32);
        // SAFETY: the slices have the lengths that the function reads and writes.
        unsafe { (self.waves)(x.as_ptr(), kind as i32, u.as_ptr(), nu, v.as_ptr(), nv, out.as_mut_ptr()) }
    }
}

/// Compiles C files to a shared library; the command, and whether it went well.
fn compile(sources: &[PathBuf], machine: &str, made: &Path, folder: &Path) -> std::io::Result<(String, bool)> {
    let target = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let mut build = cc::Build::new();
    build.target(&target).host(&target).opt_level(3).out_dir(folder).cargo_metadata(false).warnings(false).pic(true);
    build.flag(format!("-march={machine}")).flag("-shared").debug(false);
    let mut command = build.get_compiler().to_command();
    command.args(sources).arg("-o").arg(made).arg("-lm");
    let text = std::iter::once(command.get_program()).chain(command.get_args());
    let text: Vec<_> = text.map(|a| a.to_string_lossy().into_owned()).collect();
    Ok((text.join(" "), command.status()?.success()))
}
