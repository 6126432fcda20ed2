//! Checked passage of pointers and strided buffers.

use super::status::{Fault, SW_ERROR_BUFFER_SIZE};
use crate::Vec3;
use std::borrow::Cow;
use std::ffi::c_void;
use std::fmt::Display;

/// 32-bit floating point.
pub const SW_FORMAT_F32: u32 = 1;
/// 64-bit floating point.
pub const SW_FORMAT_F64: u32 = 2;

/// Fails on NULL, naming the argument.
pub(super) fn not_null<T>(name: &str, pointer: *const T) -> Result<(), Fault> {
    if pointer.is_null() { Err(Fault::argument(format!("{name} is NULL"))) } else { Ok(()) }
}

/// The object that a pointer of the host names.
pub(super) unsafe fn object<'a, T>(name: &str, handle: *const T) -> Result<&'a T, Fault> {
    not_null(name, handle)?;
    if !handle.is_aligned() {
        return Err(Fault::argument(format!("{name} is not an object of this library")));
    }
    // SAFETY: not NULL; the host passes a live handle, and objects are only ever used through locks.
    Ok(unsafe { &*handle })
}

/// Fails unless every bit of `flags` is in `known`.
pub(super) fn check_flags(name: &str, flags: u32, known: u32) -> Result<(), Fault> {
    match flags & !known {
        0 => Ok(()),
        unknown => Err(Fault::argument(format!("{name} has the unknown bits {unknown:#x}"))),
    }
}

/// An enumerant's meaning, by its number.
pub(super) fn enumerant<T: Copy>(name: impl Display, value: u32, known: &[(u32, T)]) -> Result<T, Fault> {
    let found = known.iter().find(|(number, _)| *number == value);
    found.map(|(_, meaning)| *meaning).ok_or_else(|| Fault::argument(format!("{name} is {value}, which is unknown")))
}

/// Copies `count` packed values. NULL is allowed when `count` is 0.
pub(super) unsafe fn read_array<T: Copy>(name: &str, pointer: *const T, count: u64) -> Result<Vec<T>, Fault> {
    if count == 0 {
        return Ok(vec![]);
    }
    let rows = Rows::checked(name, pointer.cast(), size_of::<T>(), 0, count)?;
    // SAFETY: the host passes `count` values behind the pointer.
    (0..rows.count).map(|i| Ok(unsafe { rows.at(i).cast::<T>().read_unaligned() })).collect()
}

/// As [`read_array`], in place where the host's values are aligned: nothing is then allocated.
pub(super) unsafe fn read_list<'a, T: Copy>(name: &str, pointer: *const T, count: u64) -> Result<Cow<'a, [T]>, Fault> {
    if count > 0 && pointer.is_aligned() {
        let rows = Rows::checked(name, pointer.cast(), size_of::<T>(), 0, count)?;
        // SAFETY: not NULL, aligned and within the address space; the host passes `count` values behind the pointer, which do
        // not change during the call.
        return Ok(Cow::Borrowed(unsafe { std::slice::from_raw_parts(pointer, rows.count) }));
    }
    // SAFETY: passed on unchanged.
    unsafe { read_array(name, pointer, count) }.map(Cow::Owned)
}

/// A few numbers.
pub(super) unsafe fn read_numbers<const N: usize>(name: &str, pointer: *const f64) -> Result<[f64; N], Fault> {
    not_null(name, pointer)?;
    // SAFETY: not NULL; the host passes N numbers behind the pointer.
    Ok(unsafe { pointer.cast::<[f64; N]>().read_unaligned() })
}

/// `count` rows of at least `row` bytes, `stride` bytes apart (0 = packed).
pub(super) struct Rows {
    base: *mut u8,
    stride: usize,
    count: usize,
}

impl Rows {
    pub fn checked(name: &str, base: *const c_void, row: usize, stride: u64, count: u64) -> Result<Self, Fault> {
        not_null(name, base)?;
        let stride = if stride == 0 { row as u64 } else { stride };
        if stride < row as u64 {
            return Err(Fault::argument(format!("the stride of {name} is {stride} bytes, but an element has {row}")));
        }
        let end = count.checked_mul(stride).and_then(|bytes| bytes.checked_add(base as u64));
        if end.is_none_or(|end| end > i64::MAX as u64) {
            return Err(Fault::argument(format!(
                "{name}: {count} elements {stride} bytes apart exceed the address space"
            )));
        }
        Ok(Self { base: base.cast_mut().cast(), stride: stride as usize, count: count as usize })
    }

    /// Start of row `i`.
    pub fn at(&self, i: usize) -> *mut u8 {
        assert!(i < self.count, "row {i} of {}", self.count);
        self.base.wrapping_add(i * self.stride)
    }
}

/// A host's buffer of vectors in either format, unaligned and strided as it may be.
pub(super) struct VectorRows {
    rows: Rows,
    double: bool,
}

impl VectorRows {
    /// `components` numbers in each of `count` rows.
    pub fn checked(
        name: &str,
        base: *const c_void,
        format: u32,
        components: usize,
        stride: u64,
        count: u64,
    ) -> Result<Self, Fault> {
        let double =
            enumerant(format_args!("the format of {name}"), format, &[(SW_FORMAT_F32, false), (SW_FORMAT_F64, true)])?;
        let row = components * if double { 8 } else { 4 };
        Ok(Self { rows: Rows::checked(name, base, row, stride, count)?, double })
    }

    /// Reads the 3-vector `i`.
    pub unsafe fn read(&self, i: usize) -> Vec3 {
        let row = self.rows.at(i);
        // SAFETY: the host's buffer holds this row.
        unsafe {
            if self.double {
                let [x, y, z] = row.cast::<[f64; 3]>().read_unaligned();
                Vec3::new(x, y, z)
            } else {
                let [x, y, z] = row.cast::<[f32; 3]>().read_unaligned();
                Vec3::new(f64::from(x), f64::from(y), f64::from(z))
            }
        }
    }

    /// Reads the number `i`, of rows of one.
    pub unsafe fn read_one(&self, i: usize) -> f64 {
        let row = self.rows.at(i);
        // SAFETY: the host's buffer holds this row.
        unsafe {
            if self.double { row.cast::<f64>().read_unaligned() } else { row.cast::<f32>().read_unaligned().into() }
        }
    }

    /// Whether a list of the host shares bytes with these rows, which would change it while they are written.
    pub fn overlaps<T>(&self, list: &[T]) -> bool {
        let Rows { base, stride, count } = self.rows;
        let (start, list) = (base as usize, list.as_ptr_range());
        start < list.end as usize && (list.start as usize) < start + count * stride
    }

    /// The largest number of the format.
    pub fn largest(&self) -> f64 {
        if self.double { f64::MAX } else { f32::MAX.into() }
    }

    /// The largest coordinate in it; in 32 bits a quarter of that, so that sums on the way stay inside.
    pub fn largest_coordinate(&self) -> f64 {
        if self.double { f64::MAX } else { 0.25 * f64::from(f32::MAX) }
    }

    /// SW_FORMAT_F64.
    pub fn double(&self) -> bool {
        self.double
    }

    /// Writes rows of this format (`T` is f64 if [`VectorRows::double`], or else f32) from row `first` on.
    #[inline(always)]
    pub unsafe fn write_all<T: Copy>(&self, first: usize, values: &[[T; 3]]) {
        let Rows { base, stride, count } = self.rows;
        assert!(first <= count && values.len() <= count - first && size_of::<T>() == if self.double { 8 } else { 4 });
        let start = base.wrapping_add(first * stride);
        // SAFETY: the host's buffer holds these rows, of three such numbers as checked; it is no memory of ours.
        unsafe {
            if stride == size_of::<[T; 3]>() {
                std::ptr::copy_nonoverlapping(values.as_ptr().cast::<u8>(), start, size_of_val(values));
            } else {
                for (i, row) in values.iter().enumerate() {
                    start.wrapping_add(i * stride).cast::<[T; 3]>().write_unaligned(*row);
                }
            }
        }
    }

    /// Writes row `i`.
    pub unsafe fn write<const N: usize>(&self, i: usize, values: [f64; N]) {
        let row = self.rows.at(i);
        // SAFETY: the host's buffer holds this row, of N components as checked.
        unsafe {
            if self.double {
                row.cast::<[f64; N]>().write_unaligned(values);
            } else {
                row.cast::<[f32; N]>().write_unaligned(values.map(|x| x as f32));
            }
        }
    }
}

/// Whether this is the first of two calls, with a NULL buffer of capacity 0. Fails when `needed` elements do not fit.
pub(super) fn asks_for_size<T>(name: &str, buffer: *const T, needed: u64, capacity: u64) -> Result<bool, Fault> {
    if buffer.is_null() && capacity == 0 {
        return Ok(true);
    }
    not_null(name, buffer)?;
    if capacity < needed {
        let message = format!("{name} has room for {capacity} elements, but {needed} are needed");
        return Err(Fault::new(SW_ERROR_BUFFER_SIZE, message));
    }
    Ok(false)
}

/// The host's bytes in place.
pub(super) unsafe fn byte_slice<'a>(name: &str, pointer: *const c_void, size: u64) -> Result<&'a [u8], Fault> {
    let rows = Rows::checked(name, pointer, 1, 0, size)?;
    // SAFETY: not NULL and within the address space; the host's buffer holds `size` bytes and does not change during the call.
    Ok(unsafe { std::slice::from_raw_parts(rows.base, rows.count) })
}

/// The second of two calls, or the first that asks for the size: always tells `needed`, and copies when it fits. With a
/// NULL buffer of capacity 0 only the size is told.
pub(super) unsafe fn copy_out<T: Copy>(name: &str, values: &[T], buffer: *mut T, capacity: u64) -> Result<(), Fault> {
    if asks_for_size(name, buffer, values.len() as u64, capacity)? {
        return Ok(());
    }
    for (i, value) in values.iter().enumerate() {
        // SAFETY: the host's buffer has room for `capacity` elements.
        unsafe { buffer.wrapping_add(i).write_unaligned(*value) };
    }
    Ok(())
}

/// Writes one output.
pub(super) unsafe fn put<T>(out: *mut T, value: T) {
    // SAFETY: the caller has checked for NULL; the host passes a place for one T.
    unsafe { out.write_unaligned(value) };
}
