//! How long work tells its caller how far it is, and is told to stop.

/// Receives progress; the command shows it, tests ignore it. Calls come from one thread at a time.
pub trait Progress: Sync {
    /// `stage` is a short phrase such as `casting rays`; `done` is between 0 and 1, or NaN where unknown; `detail` is
    /// a phrase of figures and may be empty.
    fn report(&self, stage: &str, done: f64, detail: &str);

    /// True once the user wants the work to end; long loops ask from time to time and return what they have.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _stage: &str, _done: f64, _detail: &str) {}
}
