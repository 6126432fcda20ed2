//! What a state does in a step, by its method's plan, and as a table.

use super::State;
use crate::Result;
use crate::methods::plan::{Around, Part, PartKind};

impl State {
    /// The parts of a step of `h` seconds from the present state, all of them, in the order of [`PartKind`]. Fails as a step of such
    /// a length does.
    pub fn plan(&self, h: f64) -> Result<Vec<Part>> {
        self.check_step(h)?;
        let h = h * self.tempo.root;
        let mut frame = self.frame;
        let rates = frame.advance(h);
        let load = self.body_load(&frame.pose, &rates);
        let (model, scratch) = (&self.model, &self.scratch);
        let room = [scratch.force.len(), scratch.x.len() + scratch.v.len()];
        let state_bytes = Self::bytes_for(model.modal.n_modes());
        let mut parts = self.motion.plan(&Around { model, loads: &self.loads, load, h, room, state_bytes });
        parts.push(self.plan_contact());
        if self.rest.skips(h) {
            for part in &mut parts {
                part.operations = 0.0;
                if part.active && !matches!(part.kind, PartKind::Shape | PartKind::Displacements | PartKind::Rotations)
                {
                    part.active = false;
                    part.reason = "the state rests".into();
                }
            }
        }
        Ok(parts)
    }

    /// [`State::plan`] as a table.
    pub fn plan_text(&self, h: f64) -> Result<String> {
        let parts = self.plan(h)?;
        let mut text = format!("{:<32}{:>6}{:>12}{:>14}  why\n", "part", "", "bytes", "operations");
        for Part { kind, active, bytes, operations, reason } in &parts {
            let used = if *active { "on" } else { "–" };
            text += &format!("{:<32}{used:>6}{bytes:>12}{operations:>14.0}  {reason}\n", kind.name());
        }
        let bytes: usize = parts.iter().map(|part| part.bytes).sum();
        let operations: f64 = parts.iter().map(|part| part.operations).sum();
        text += &format!("{:<38}{bytes:>12}{operations:>14.0}\n", "in all");
        Ok(text)
    }
}
