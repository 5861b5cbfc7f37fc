//! The version of the interface, and contexts.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use crate::context::PliantContext;
use crate::pointers::{give, needed};
use crate::status::{Fault, PliantError, PliantStatus, reported};

/// The version of this interface: a program passes `PLIANT_ABI` of the header that it was built with to
/// `pliant_context_open`. It grows where a change breaks programs.
pub const PLIANT_ABI: u32 = 1;

/// The version of the interface that this library has.
#[unsafe(no_mangle)]
pub extern "C" fn pliant_abi() -> u32 {
    PLIANT_ABI
}

/// The version of Pliant, such as `0.1.0`. It lives as long as the process.
#[unsafe(no_mangle)]
pub extern "C" fn pliant_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// Opens a context: all that a program opens is in one. `abi` is `PLIANT_ABI`. Contexts know nothing of each
/// other.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_context_open(
    abi: u32,
    context: *mut *mut PliantContext,
    error: *mut PliantError,
) -> PliantStatus {
    let open = || {
        if abi != PLIANT_ABI {
            let message = format!(
                "the program was built for version {abi} of the interface, this library has {PLIANT_ABI}"
            );
            return Err(Fault::new(PliantStatus::Version, message));
        }
        needed(context, "context")?;
        // SAFETY: it is not null, and the caller owes the rest.
        unsafe { give(context, "context", Box::into_raw(Box::new(PliantContext::new()))) }
    };
    // SAFETY: the caller promises valid pointers.
    reported(open(), unsafe { error.cast::<MaybeUninit<PliantError>>().as_mut() })
}

/// Closes a context with all that is open in it. No call on it may be under way, and none may come after;
/// null does nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_context_close(context: *mut PliantContext) {
    if !context.is_null() {
        // SAFETY: it came from `pliant_context_open`, and the caller promises that nobody uses it any more.
        drop(unsafe { Box::from_raw(context) });
    }
}
