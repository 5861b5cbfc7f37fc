//! Pointers of the caller: texts, arrays and numbers that are read, values and texts that are given.

use std::ffi::{CStr, c_char};
use std::slice;

use crate::status::{Fault, PliantStatus};

fn null(what: &str) -> Fault {
    Fault::new(PliantStatus::Null, format!("`{what}` is null"))
}

/// A text of the caller.
///
/// # Safety
/// It is null or ends with a zero, and lives as long as the text is used.
pub(crate) unsafe fn text<'a>(text: *const c_char, what: &str) -> Result<&'a str, Fault> {
    // SAFETY: as the caller promises.
    unsafe { some_text(text, what)? }.ok_or_else(|| null(what))
}

/// A text of the caller; `None` if it is null.
///
/// # Safety
/// As [`text`].
pub(crate) unsafe fn some_text<'a>(text: *const c_char, what: &str) -> Result<Option<&'a str>, Fault> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: it is not null, and the caller promises the zero at its end.
    let text = unsafe { CStr::from_ptr(text) }.to_str();
    text.map(Some).map_err(|_| Fault::new(PliantStatus::NotText, format!("`{what}` is not UTF-8")))
}

/// An array of the caller.
///
/// # Safety
/// `items` is null or has `count` items, and lives as long as the array is used.
pub(crate) unsafe fn array<'a, T>(items: *const T, count: usize, what: &str) -> Result<&'a [T], Fault> {
    if count == 0 {
        return Ok(&[]);
    }
    if items.is_null() {
        return Err(null(what));
    }
    if count > isize::MAX as usize / size_of::<T>().max(1) || !items.is_aligned() {
        return Err(Fault::new(
            PliantStatus::ShortBuffer,
            format!("`{what}` is not aligned, or {count} items are too many"),
        ));
    }
    // SAFETY: it is not null and aligned, not too long, and the caller promises the items.
    Ok(unsafe { slice::from_raw_parts(items, count) })
}

/// Three finite numbers of the caller.
///
/// # Safety
/// As [`array`], with three items.
pub(crate) unsafe fn numbers<const N: usize>(items: *const f64, what: &str) -> Result<[f64; N], Fault> {
    // SAFETY: as the caller promises.
    let items = unsafe { array(items, N, what)? };
    let mut copied = [0.0; N];
    copied.copy_from_slice(items);
    finite(&copied, what)?;
    Ok(copied)
}

/// Says which of some numbers is not finite.
pub(crate) fn finite(numbers: &[f64], what: &str) -> Result<(), Fault> {
    match numbers.iter().position(|number| !number.is_finite()) {
        None => Ok(()),
        Some(at) => Err(Fault::new(PliantStatus::NotANumber, format!("`{what}` is {} at {at}", numbers[at]))),
    }
}

/// Gives the caller a value.
///
/// # Safety
/// `to` is null or may be written.
pub(crate) unsafe fn give<T>(to: *mut T, what: &str, value: T) -> Result<(), Fault> {
    if to.is_null() {
        return Err(null(what));
    }
    // SAFETY: it is not null, and the caller promises the rest.
    unsafe { to.write_unaligned(value) };
    Ok(())
}

/// Refuses a pointer that must not be null, before anything is done.
pub(crate) fn needed<T>(to: *const T, what: &str) -> Result<(), Fault> {
    if to.is_null() { Err(null(what)) } else { Ok(()) }
}

/// Gives the caller a text with a zero at its end, and the length without the zero. A null buffer without
/// capacity gets the length alone; a short buffer is an error, and gets the length, too.
///
/// # Safety
/// `to` is null or has room for `capacity` bytes; `length` is null or may be written.
pub(crate) unsafe fn give_bytes(
    bytes: &[u8],
    to: *mut u8,
    capacity: usize,
    length: *mut usize,
    zero: bool,
) -> Result<(), Fault> {
    if !length.is_null() {
        // SAFETY: it is not null.
        unsafe { length.write_unaligned(bytes.len()) };
    }
    if to.is_null() && capacity == 0 && !length.is_null() {
        return Ok(());
    }
    needed(to, "buffer")?;
    let room = bytes.len() + usize::from(zero);
    if capacity < room {
        return Err(Fault::new(
            PliantStatus::ShortBuffer,
            format!("the buffer has {capacity} bytes, but {room} are needed"),
        ));
    }
    // SAFETY: there is room for all bytes and the zero, and buffers of the caller and of the library do not
    // overlap.
    unsafe {
        to.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
        if zero {
            to.add(bytes.len()).write(0);
        }
    }
    Ok(())
}
