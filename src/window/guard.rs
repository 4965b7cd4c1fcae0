//! Threads that outlive a panic: a defect costs what was under way, never the flight.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::{Error, Result};

/// Does something; a panic on the way becomes an error that tells what was being done. Whatever the panic
/// left half done must not be used again.
pub(super) fn guarded<T>(doing: &str, what: impl FnOnce() -> T) -> Result<T> {
    catch_unwind(AssertUnwindSafe(what)).map_err(|panic| {
        let reason = reason(&*panic);
        Error::Failed(format!("a defect of the program showed itself, {doing}: {reason}"))
    })
}

/// What a panic says.
fn reason(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no reason is known")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_one_sentence() {
        let place = 7;
        let told = |done: Result<u32>| done.expect_err("a panic").to_string();
        let formatted = told(guarded("counting", || panic!("stumbled at {place}")));
        assert!(formatted.ends_with("counting: stumbled at 7"), "{formatted}");
        assert!(told(guarded("counting", || panic!("stumbled"))).ends_with("stumbled"));
        let other = told(guarded("counting", || std::panic::panic_any(place)));
        assert!(other.ends_with("no reason is known"), "{other}");
        assert!(matches!(guarded("counting", || place), Ok(7)));
    }
}
