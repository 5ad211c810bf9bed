//! Calls of a library that may panic on contents that no writer makes.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// Whether a panic of this thread is awaited, so that it is not reported.
    static IS_AWAITED: Cell<bool> = const { Cell::new(false) };
}

/// Does some work; an error if that panics. What the work has begun to change must not be used any more then.
pub(super) fn contained<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |about| {
            if !IS_AWAITED.get() {
                usual(about);
            }
        }));
    });
    IS_AWAITED.set(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    IS_AWAITED.set(false);
    result.map_err(|_| "they are no compressed points".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_are_errors() {
        assert_eq!(contained(|| 1), Ok(1));
        assert!(contained(|| [1, 2, 3][std::hint::black_box(3)]).is_err());
        assert!(!IS_AWAITED.get());
    }
}
