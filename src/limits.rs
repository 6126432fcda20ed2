//! Sizes that several rooms share.

/// No more modes than this: the dense work grows with its cube, and no warp needs so many.
pub const MAX_MODES: usize = 1024;
