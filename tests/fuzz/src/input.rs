//! Decisions read from bytes: zeros when they run out, so that every input means something.

pub struct Input<'a> {
    rest: &'a [u8],
}

/// Numbers at the edges of what is sensible, and beyond.
const SPECIAL: [f64; 24] = [
    -0.0,
    1e-3,
    -1e-3,
    1e-9,
    10.0,
    -100.0,
    1e4,
    -1e6,
    1e9,
    1e12,
    -1e20,
    1e30,
    1e-30,
    1e-100,
    1e100,
    -1e150,
    1e300,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    5e-324,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

impl<'a> Input<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        let (first, rest) = self.rest.split_first().unwrap_or((&0, &[]));
        self.rest = rest;
        *first
    }

    /// Below `n`, which is at most 256.
    pub fn below(&mut self, n: usize) -> usize {
        usize::from(self.byte()) % n
    }

    pub fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == n - 1
    }

    pub fn array<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.byte())
    }

    /// Mostly a gentle one between −1 and 1, sometimes a special one, seldom any bits at all.
    pub fn number(&mut self) -> f64 {
        match self.byte() {
            b @ 0..224 => (f64::from(b) - 112.0) / 112.0,
            b @ 224..248 => SPECIAL[usize::from(b) - 224],
            _ => f64::from_bits(u64::from_le_bytes(self.array())),
        }
    }

    pub fn numbers<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.number())
    }

    /// Mostly an index of `n`, sometimes one past, seldom any.
    pub fn index(&mut self, n: usize) -> u32 {
        match self.byte() {
            255 => u32::from_le_bytes(self.array()),
            b => (usize::from(b) % (n + usize::from(b > 240))) as u32,
        }
    }

    /// A small enumerant or flag, seldom any.
    pub fn code(&mut self, n: usize) -> u32 {
        match self.byte() {
            255 => u32::from_le_bytes(self.array()),
            b => (usize::from(b) % n) as u32,
        }
    }
}
