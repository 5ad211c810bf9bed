//! The cup in JAX, where there is a Python that has it.

use std::path::Path;
use std::process::Command;

/// Names the Python to ask; without it `python3` is asked, which mostly has no JAX.
const PYTHON: &str = "GMLC_JAX_PYTHON";

/// Microseconds that rows of the table take in benches/peers/cup_jax.py, on one core.
pub(crate) fn times() -> Option<[(&'static str, f64); 3]> {
    let python = std::env::var_os(PYTHON);
    let asked = python.is_some();
    let python = python.unwrap_or_else(|| "python3".into());
    let has_jax = Command::new(&python).args(["-c", "import jax"]).output().is_ok_and(|o| o.status.success());
    if !has_jax {
        let said = if asked { "the Python that it names has no JAX" } else { "python3 has no JAX" };
        println!("without JAX: {said} (pip install jax in an environment, and set {PYTHON} to its python)");
        return None;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/cup_jax.py");
    let output = Command::new("taskset").args(["-c", "0"]).arg(&python).arg(&script).output();
    let output = output.or_else(|_| Command::new(&python).arg(&script).output()).ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let time = |name: &str| text.lines().find_map(|l| l.strip_prefix(name)?.trim().parse().ok());
    let times = ["points", "Jacobian", "pullback"].map(|name| (name, time(name)));
    let [(a, Some(points)), (b, Some(jacobian)), (c, Some(pullback))] = times else {
        println!("without JAX: the script failed\n{}", String::from_utf8_lossy(&output.stderr));
        return None;
    };
    println!("{}", text.lines().next().unwrap_or_default());
    Some([(a, points), (b, jacobian), (c, pullback)])
}
