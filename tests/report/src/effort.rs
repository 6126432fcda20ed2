//! How much is measured, and what is said meanwhile.

use std::io::{IsTerminal, Write};
use std::time::Instant;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    Full,
    /// Fewer knobs and scenes, the same arithmetic.
    Quick,
    /// For the tests: a few seconds.
    Smoke,
}

/// A line that is written over on a terminal, and a line per stage elsewhere.
pub struct Progress {
    start: Instant,
    stages: usize,
    stage: usize,
    terminal: bool,
}

impl Progress {
    pub fn new(stages: usize) -> Self {
        Self { start: Instant::now(), stages, stage: 0, terminal: std::io::stderr().is_terminal() }
    }

    fn head(&self) -> String {
        format!("report: [{}/{}] {:4.0} s  ", self.stage, self.stages, self.start.elapsed().as_secs_f64())
    }

    /// Begins a stage.
    pub fn stage(&mut self, name: &str) {
        self.stage += 1;
        eprintln!("{}{}{name}", if self.terminal { "\r\x1b[K" } else { "" }, self.head());
    }

    /// What is being done within it.
    pub fn say(&mut self, what: &str) {
        if self.terminal {
            eprint!("\r\x1b[K{}{what}", self.head());
            let _ = std::io::stderr().flush();
        }
    }

    pub fn done(&self) {
        eprintln!("{}{}done", if self.terminal { "\r\x1b[K" } else { "" }, self.head());
    }
}
