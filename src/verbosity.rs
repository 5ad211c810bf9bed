//! How much a command says besides its results, warnings and errors: `--quiet` and `--verbose`.

use clap::Args;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::{Duration, Instant};

/// Options of all commands.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(crate) struct Verbosity {
    /// Show no progress and no notes, such as where results were written; warnings and errors stay
    #[arg(short, long, global = true, display_order = 1000)]
    quiet: bool,
    /// Say how long each stage of the work takes
    #[arg(short, long, global = true, display_order = 1001, conflicts_with = "quiet")]
    verbose: bool,
}

const QUIET: u8 = 0;
const USUAL: u8 = 1;
const VERBOSE: u8 = 2;

/// Of the process, which has one command line.
static LEVEL: AtomicU8 = AtomicU8::new(USUAL);

impl Verbosity {
    /// Applies to all that is said from now on.
    pub(crate) fn apply(self) {
        let level = match (self.quiet, self.verbose) {
            (true, _) => QUIET,
            (_, true) => VERBOSE,
            _ => USUAL,
        };
        LEVEL.store(level, Ordering::Relaxed);
    }
}

/// Whether progress and notes are left out.
pub(crate) fn is_quiet() -> bool {
    LEVEL.load(Ordering::Relaxed) == QUIET
}

/// Whether the user wants to know how long stages take.
pub(crate) fn is_verbose() -> bool {
    LEVEL.load(Ordering::Relaxed) == VERBOSE
}

/// Does a stage of the work, and says how long it took if the user wants to know.
pub(crate) fn timed<T>(stage: &str, work: impl FnOnce() -> T) -> T {
    let begun = Instant::now();
    let done = work();
    if is_verbose() {
        eprintln!("{}", took(stage, begun.elapsed()));
    }
    done
}

/// The line on a stage that is over.
pub(crate) fn took(stage: &str, time: Duration) -> String {
    format!("{stage}: {:.3} s", time.as_secs_f64())
}

/// Whether texts on standard error and on a terminal may have colours: not if the user forbids it in the environment
/// (<https://no-color.org>), where an empty value counts as none.
pub(crate) fn allows_colour() -> bool {
    std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
