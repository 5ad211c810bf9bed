//! Damaged results of fits through all commands that take one.

use crate::case::{Base, Case};
use crate::damage::Random;
use crate::mutate::{choose, damaged};

const COMMANDS: [&[&str]; 9] = [
    &["check", "ball.gml", "--params", "bad.json"],
    &["check", "ball.gml", "--params", "bad.json", "--format", "json"],
    &["mesh", "ball.gml", "--params", "bad.json", "-o", "new.ply"],
    &["scan", "ball.gml", "--params", "bad.json", "-o", "new.ply", "--truth", "truth.json"],
    &["fit", "ball.gml", "scan.ply", "--params", "bad.json", "-o", "new.json"],
    &["variance", "ball.gml", "scan.ply", "--params", "bad.json", "--device", "cpu", "--resolution", "32", "-o", "out"],
    &["inspect", "ball.gml", "scan.ply", "--params", "bad.json", "--device", "cpu", "--resolution", "32", "-o", "out"],
    &["compare", "bad.json", "ball.gml", "-o", "new.json"],
    &["compare", "fit.json", "bad.json", "--align", "--script", "ball.gml"],
];

/// A random case.
pub(crate) fn case(base: &Base, random: &mut Random) -> Case {
    let fit = &base.files["fit.json"];
    // Half of all commands only read: they take a hundredth of the time.
    let args = if random.below(2) == 0 { COMMANDS[random.below(2)] } else { choose(random, &COMMANDS) };
    Case::of(args).with("bad.json", damaged(fit, random))
}
