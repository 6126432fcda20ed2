//! Structs that can grow: each side has its own size of them, and the host's decides what is read and written.
//!
//! A later version of a struct has the same fields and more at its end. What a shorter struct of the host lacks is read as
//! zeros and not written; what a longer one has beyond this library's is written as zeros, and must be zeros to be read.

use super::pointer::{asks_for_size, not_null};
use super::status::{Fault, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED};
use std::ffi::c_void;
use std::fmt::Display;
use std::ptr::copy_nonoverlapping;

/// A public struct.
///
/// # Safety
/// The type is repr(C), and zeros are a value of it, as is any bit pattern: numbers and nullable pointers.
pub unsafe trait Grows: Copy {
    /// Its C name.
    const NAME: &'static str;
    /// Bytes of its first version: no host's is shorter.
    const FIRST: usize;
    /// Zeros and NULL everywhere.
    fn zeroed() -> Self {
        // SAFETY: the trait's contract.
        unsafe { std::mem::zeroed() }
    }
}

/// One that begins with `struct_size`, which the host sets to its own size of it.
pub trait Described: Grows {
    /// As its init function leaves it.
    fn initial() -> Self;
}

/// Where a field ends that starts at `offset`.
pub(super) const fn end_of<T, F>(offset: usize, _field: fn(&T) -> &F) -> usize {
    offset + size_of::<F>()
}

/// `grows!(SwX, last)`: SwX, whose first version ends with the field `last`. It stays when others are appended.
macro_rules! grows {
    ($type:ident, $last:ident) => {
        // SAFETY: repr(C), and only numbers and nullable pointers inside.
        unsafe impl $crate::ffi::structs::Grows for $type {
            const NAME: &'static str = stringify!($type);
            const FIRST: usize =
                $crate::ffi::structs::end_of(std::mem::offset_of!($type, $last), |value: &$type| &value.$last);
        }
    };
}
pub(super) use grows;

/// The same for a struct that begins with `struct_size`.
macro_rules! described {
    ($type:ident, $last:ident) => {
        $crate::ffi::structs::grows!($type, $last);
        const _: () = assert!(std::mem::offset_of!($type, struct_size) == 0);
        impl $crate::ffi::structs::Described for $type {
            fn initial() -> Self {
                Self { struct_size: size_of::<Self>() as u32, ..$crate::ffi::structs::Grows::zeroed() }
            }
        }
    };
}
pub(super) use described;

/// No struct gets as long: a larger size is one that nobody has set.
const LONGEST: usize = 4096;

/// A struct as this library has it; with the feature abi-growth, which tests/growth alone has, as a later one would.
#[repr(C)]
#[derive(Clone, Copy)]
struct Known<T> {
    value: T,
    #[cfg(feature = "abi-growth")]
    appended: u64,
}

impl<T: Grows> Known<T> {
    const SIZE: usize = size_of::<Self>();

    fn zeroed() -> Self {
        Self {
            value: T::zeroed(),
            #[cfg(feature = "abi-growth")]
            appended: 0,
        }
    }

    /// What is written to a host.
    fn of(value: T) -> Self {
        Self {
            value,
            #[cfg(feature = "abi-growth")]
            appended: APPENDED,
        }
    }

    /// What was read of a host.
    fn into_result(self) -> Result<T, Fault> {
        #[cfg(feature = "abi-growth")]
        if self.appended != 0 {
            return Err(Fault::argument(format!("{}::appended is {}", T::NAME, self.appended)));
        }
        Ok(self.value)
    }
}

/// What the appended field of an output says.
#[cfg(feature = "abi-growth")]
const APPENDED: u64 = 0x6465_646e_6570_7061;

/// Initialises a struct that begins with struct_size: zeros into its `size` bytes, and `size` into struct_size. It must be the host's
/// sizeof: sw_mesh_desc_init and its like at the end of this header call this with it, and languages that cannot call those call
/// this. NULL, or a size below 4, does nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_struct_init(out: *mut c_void, size: u32) {
    if out.is_null() || (size as usize) < size_of::<u32>() {
        return;
    }
    // SAFETY: the host's struct has `size` bytes.
    unsafe {
        out.cast::<u8>().write_bytes(0, size as usize);
        out.cast::<u32>().write_unaligned(size);
    }
}

/// Whether a host's struct can have this size.
fn check_size<T: Grows>(what: impl Display, size: u32) -> Result<usize, Fault> {
    let (name, first, align, bytes) = (T::NAME, T::FIRST, align_of::<T>(), size as usize);
    let wrong = if bytes < first {
        format!("{name} has {first} bytes or more")
    } else if bytes > LONGEST {
        format!("no {name} has more than {LONGEST} bytes")
    } else if bytes % align != 0 {
        format!("{name} has a multiple of {align} bytes")
    } else {
        return Ok(bytes);
    };
    Err(Fault::new(SW_ERROR_INVALID_DESC, format!("{what} is {size}, but {wrong}: it must be the host's sizeof")))
}

/// The struct_size of the host's struct.
unsafe fn size_of_host<T: Described>(name: &str, pointer: *const T) -> Result<usize, Fault> {
    not_null(name, pointer)?;
    // SAFETY: not NULL; the host passes a struct that begins with a u32.
    let size = unsafe { pointer.cast::<u32>().read_unaligned() };
    check_size::<T>(format_args!("{name}->struct_size"), size)
}

/// Copies a descriptor of the host's size. `name` is the argument's.
pub(super) unsafe fn read_descriptor<T: Described>(name: &str, pointer: *const T) -> Result<T, Fault> {
    let mut known = Known::<T>::zeroed();
    let here = Known::<T>::SIZE;
    // SAFETY: the host's struct has as many bytes as it says, and any bits are a value.
    unsafe {
        let size = size_of_host(name, pointer)?;
        let bytes = std::slice::from_raw_parts(pointer.cast::<u8>(), size);
        if let Some(beyond) = bytes.iter().skip(here).position(|byte| *byte != 0) {
            let message = format!(
                "{name} has a field that this library does not know: byte {} of {} is not 0; the host has {size} bytes of \
                 it, this library {here}",
                here + beyond,
                T::NAME
            );
            return Err(Fault::new(SW_ERROR_UNSUPPORTED, message));
        }
        copy_nonoverlapping(bytes.as_ptr(), (&raw mut known).cast(), size.min(here));
    }
    known.into_result()
}

/// As [`read_descriptor`], with NULL standing for an initialised descriptor.
pub(super) unsafe fn read_descriptor_or_default<T: Described>(name: &str, pointer: *const T) -> Result<T, Fault> {
    if pointer.is_null() {
        return Ok(T::initial());
    }
    // SAFETY: passed on unchanged.
    unsafe { read_descriptor(name, pointer) }
}

/// Writes `value` into the `size` bytes of the host's struct, and zeros into what it has beyond.
unsafe fn write_struct<T: Grows>(out: *mut u8, size: usize, value: T) {
    let known = Known::of(value);
    let written = size.min(Known::<T>::SIZE);
    // SAFETY: the host's struct has `size` bytes.
    unsafe {
        copy_nonoverlapping((&raw const known).cast::<u8>(), out, written);
        out.wrapping_add(written).write_bytes(0, size - written);
    }
}

/// A host's struct to be filled.
pub(super) struct Output<T> {
    place: *mut T,
    size: usize,
}

impl<T: Described> Output<T> {
    /// After a look at its size. `name` is the argument's.
    pub unsafe fn checked(name: &str, place: *mut T) -> Result<Self, Fault> {
        // SAFETY: passed on unchanged.
        Ok(Self { place, size: unsafe { size_of_host(name, place.cast_const())? } })
    }

    /// Fills it; struct_size stays the host's.
    pub unsafe fn write(self, value: T) {
        // SAFETY: the host's struct has as many bytes as it says.
        unsafe {
            write_struct(self.place.cast(), self.size, value);
            self.place.cast::<u32>().write_unaligned(self.size as u32);
        }
    }
}

/// A host's array of structs to be filled, each of the host's size.
pub(super) struct Outputs<T> {
    place: *mut T,
    size: usize,
}

impl<T: Grows> Outputs<T> {
    /// After a look at the size of an element. `name` is the argument's.
    pub fn checked(name: &str, place: *mut T, element_size: u32) -> Result<Self, Fault> {
        Ok(Self { place, size: check_size::<T>(format_args!("the element size of {name}"), element_size)? })
    }

    /// Fills the first elements.
    pub unsafe fn write(&self, values: impl IntoIterator<Item = T>) {
        for (i, value) in values.into_iter().enumerate() {
            // SAFETY: the host's array has as many elements of this size.
            unsafe { write_struct(self.place.cast::<u8>().wrapping_add(i * self.size), self.size, value) };
        }
    }

    /// The second of two calls, or the first that asks for their number: see [`asks_for_size`].
    pub unsafe fn copy_out(&self, name: &str, values: &[T], capacity: u32) -> Result<(), Fault> {
        if !asks_for_size(name, self.place, values.len() as u64, capacity.into())? {
            // SAFETY: the host's array has room for them.
            unsafe { self.write(values.iter().copied()) };
        }
        Ok(())
    }
}
