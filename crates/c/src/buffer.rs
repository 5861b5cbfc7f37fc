//! Buffers of the caller: vectors of any stride, in single or double precision.

use std::ffi::c_void;

use crate::pointers::needed;
use crate::status::{Fault, PliantStatus};

/// Numbers are `float`.
pub const PLIANT_F32: u32 = 0;
/// Numbers are `double`.
pub const PLIANT_F64: u32 = 1;

/// Memory of the caller for items of one or more numbers, such as the positions in a vertex buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PliantBuffer {
    /// The first number of the first item. It need not be aligned.
    pub data: *mut c_void,
    /// Items that there is room for.
    pub count: usize,
    /// Bytes from an item to the next one; 0 if they follow each other.
    pub stride: usize,
    /// `PLIANT_F32` or `PLIANT_F64`.
    pub numbers: u32,
}

/// Writes items into a buffer.
pub(crate) struct Writer<const N: usize> {
    data: *mut u8,
    stride: usize,
    items: usize,
    single: bool,
}

impl<const N: usize> Writer<N> {
    /// Writes an item.
    #[inline(always)]
    pub(crate) fn put(&self, item: usize, value: [f64; N]) {
        assert!(item < self.items, "an item beyond those announced");
        // SAFETY: the item is within the memory that the caller promised, as checked when this was made.
        unsafe {
            let to = self.data.add(item * self.stride);
            match self.single {
                true => to.cast::<[f32; N]>().write_unaligned(value.map(|x| x as f32)),
                false => to.cast::<[f64; N]>().write_unaligned(value),
            }
        }
    }
}

impl PliantBuffer {
    /// Makes a writer of `items` items, each of `N` numbers.
    ///
    /// # Safety
    /// `data` is null or has room for `count` items at this stride, as long as items are written.
    pub(crate) unsafe fn writer<const N: usize>(&self, items: usize) -> Result<Writer<N>, Fault> {
        let size = self.check(N, items)?;
        let stride = if self.stride == 0 { size } else { self.stride };
        Ok(Writer { data: self.data.cast(), stride, items, single: self.numbers == PLIANT_F32 })
    }

    /// Writes numbers, `components` for each item.
    ///
    /// # Safety
    /// The conditions are the same as for [`writer`](Self::writer).
    pub(crate) unsafe fn write_all(&self, values: &[f64], components: usize) -> Result<(), Fault> {
        let items = values.len() / components.max(1);
        let size = self.check(components, items)?;
        let stride = if self.stride == 0 { size } else { self.stride };
        let single = self.numbers == PLIANT_F32;
        for (item, values) in values.chunks_exact(components).enumerate() {
            for (c, &value) in values.iter().enumerate() {
                let at = item * stride + c * if single { 4 } else { 8 };
                // SAFETY: the number is within an item, and that within the caller's memory, as checked.
                unsafe {
                    let to = self.data.cast::<u8>().add(at);
                    if single {
                        to.cast::<f32>().write_unaligned(value as f32)
                    } else {
                        to.cast::<f64>().write_unaligned(value)
                    }
                }
            }
        }
        Ok(())
    }

    /// Bytes of an item, if all of them fit.
    fn check(&self, components: usize, items: usize) -> Result<usize, Fault> {
        let number = match self.numbers {
            PLIANT_F32 => 4,
            PLIANT_F64 => 8,
            other => {
                let message =
                    format!("the buffer's `numbers` is {other}: take PLIANT_F32 (0) or PLIANT_F64 (1)");
                return Err(Fault::new(PliantStatus::NotANumber, message));
            }
        };
        let size = components * number;
        if self.stride != 0 && self.stride < size {
            let message = format!("the buffer's stride is {} bytes, an item has {size}", self.stride);
            return Err(Fault::new(PliantStatus::ShortBuffer, message));
        }
        if self.count < items {
            let message = format!("the buffer has room for {} items, {items} are needed", self.count);
            return Err(Fault::new(PliantStatus::ShortBuffer, message));
        }
        if items > 0 {
            needed(self.data, "data")?;
        }
        if items.checked_mul(self.stride.max(size)).is_none_or(|bytes| bytes > isize::MAX as usize) {
            return Err(Fault::new(PliantStatus::ShortBuffer, "the buffer's stride is too long"));
        }
        Ok(size)
    }
}
