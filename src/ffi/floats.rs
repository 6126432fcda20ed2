//! The processor's floating-point modes: the library's own inside a call, the host's in callbacks and after it.
//!
//! A host may round otherwise, flush subnormal numbers to zero, or trap what overflows. Compiled Rust takes the default for
//! granted, and so do results that must be the same everywhere.

use std::cell::Cell;

/// What a thread has set: MXCSR on x86-64; FPCR and FPSR on 64-bit ARM; nothing elsewhere. Traps, rounding and flushing are in
/// it, and the flags of what has happened.
#[cfg(target_arch = "x86_64")]
mod word {
    use std::arch::asm;

    pub type Word = u32;
    /// To nearest, subnormal numbers kept, nothing trapped, nothing flagged.
    pub const DEFAULT: Word = 0x1f80;

    pub fn get() -> Word {
        let mut word: Word = 0;
        // SAFETY: stores 4 bytes where `word` is. No other state changes. Every x86-64 processor has SSE.
        unsafe { asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack, preserves_flags)) };
        word
    }

    pub fn set(word: Word) {
        // SAFETY: loads 4 bytes from where `word` is: the default, which compiled Rust expects, or what `get` gave, whose
        // reserved bits are therefore zero, as code of the host is about to run.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &word, options(nostack, preserves_flags)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod word {
    use std::arch::asm;

    pub type Word = [u64; 2];
    /// To nearest, subnormal numbers kept, nothing trapped, nothing flagged.
    pub const DEFAULT: Word = [0, 0];

    pub fn get() -> Word {
        let (control, status): (u64, u64);
        // SAFETY: reads two registers that every thread may read.
        unsafe { asm!("mrs {}, fpcr", "mrs {}, fpsr", out(reg) control, out(reg) status, options(nostack)) };
        [control, status]
    }

    pub fn set([control, status]: Word) {
        // SAFETY: writes two registers that every thread may write: the default, which compiled Rust expects, or what `get`
        // gave, as code of the host is about to run.
        unsafe { asm!("msr fpcr, {}", "msr fpsr, {}", in(reg) control, in(reg) status, options(nostack)) };
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod word {
    #[derive(Clone, Copy)]
    pub struct Word;
    pub const DEFAULT: Word = Word;

    pub fn get() -> Word {
        Word
    }

    pub fn set(_: Word) {}
}

use word::Word;

thread_local! {
    /// Of whoever called into the library on this thread, while it is inside.
    static HOST: Cell<Word> = const { Cell::new(word::DEFAULT) };
}

/// While it lives, the thread computes by the default; then it has again what it had, and no flag of what happened inside.
pub(super) struct Inside {
    /// Of an enclosing call, out of which a callback has called.
    outer: Word,
}

impl Inside {
    pub fn enter() -> Self {
        let outer = HOST.replace(word::get());
        word::set(word::DEFAULT);
        Self { outer }
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        word::set(HOST.replace(self.outer));
    }
}

/// Calls back into the host, as it has set its floating-point modes. What the callback sets stays set, as if the host had set
/// it before the call.
pub(super) fn as_the_host<T>(callback: impl FnOnce() -> T) -> T {
    word::set(HOST.get());
    let outcome = callback();
    HOST.set(word::get());
    word::set(word::DEFAULT);
    outcome
}
