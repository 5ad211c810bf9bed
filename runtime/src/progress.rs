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

/// A piece of a larger work, with a name of its own: its progress from 0 to 1 is that of the whole between two values.
pub struct Piece<'a> {
    /// The larger work.
    pub whole: &'a dyn Progress,
    /// The name of the piece; its own stages are details.
    pub name: String,
    /// Where the piece begins and ends in the whole.
    pub range: (f64, f64),
}

impl Progress for Piece<'_> {
    fn report(&self, stage: &str, done: f64, detail: &str) {
        let (from, to) = self.range;
        let detail = if detail.is_empty() { stage.to_owned() } else { format!("{stage}, {detail}") };
        self.whole.report(&self.name, from + done * (to - from), &detail);
    }

    fn cancelled(&self) -> bool {
        self.whole.cancelled()
    }
}

/// Ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _stage: &str, _done: f64, _detail: &str) {}
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A user whose answer is that the work is to end after so many questions.
    pub(crate) struct Until(AtomicUsize);

    impl Until {
        pub(crate) fn asked(questions: usize) -> Self {
            Self(AtomicUsize::new(questions))
        }
    }

    impl Progress for Until {
        fn report(&self, _stage: &str, _done: f64, _detail: &str) {}

        fn cancelled(&self) -> bool {
            self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_err()
        }
    }

    /// Keeps the last report.
    #[derive(Default)]
    struct Last(Mutex<(String, f64, String)>);

    impl Progress for Last {
        fn report(&self, stage: &str, done: f64, detail: &str) {
            *self.0.lock().unwrap() = (stage.to_owned(), done, detail.to_owned());
        }

        fn cancelled(&self) -> bool {
            true
        }
    }

    #[test]
    fn pieces_of_pieces_are_shares_of_the_whole() {
        let last = Last::default();
        let candidate = Piece { whole: &last, name: "bolts=5 (2 of 4)".to_owned(), range: (0.25, 0.5) };
        let stage = Piece { whole: &candidate, name: "stage 2 of 5: fitting".to_owned(), range: (0.2, 0.6) };
        stage.report("polish", 0.5, "sigma 1 mm");
        // A quarter, and of the next quarter 0.2 + 0.5 * 0.4.
        let (name, done, detail) = last.0.lock().unwrap().clone();
        assert_eq!((name.as_str(), detail.as_str()), ("bolts=5 (2 of 4)", "stage 2 of 5: fitting, polish, sigma 1 mm"));
        assert!((done - 0.35).abs() < 1e-12, "{done}");
        assert!(stage.cancelled());
    }
}
