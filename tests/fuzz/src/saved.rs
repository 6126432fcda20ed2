//! Saved bytes → model or state. Half of the inputs are the bytes themselves; the others are patches on good saves, with the
//! checksum made right again, so that the checks behind it are reached.

use super::host::*;
use super::input::Input;
use shellwarp::ffi::method::*;
use shellwarp::ffi::state::*;
use shellwarp::ffi::status::*;
use std::sync::OnceLock;
use xxhash_rust::xxh3::xxh3_64;

/// Good models in both precisions, and a state of each method on the first.
struct Good {
    models: [Vec<u8>; 2],
    states: [Vec<u8>; 3],
}

const METHODS: [u32; 3] = [SW_METHOD_WARP, SW_METHOD_SHELL_IMPLICIT, SW_METHOD_WARP_VIRTUAL_WORK];

fn good() -> &'static Good {
    static GOOD: OnceLock<Good> = OnceLock::new();
    GOOD.get_or_init(|| {
        let sheet = Triangles::sheet(1, 1);
        let models = [1, 2].map(|precision| sheet.model(&[0, 1], 3, precision));
        let states = METHODS.map(|method| {
            let state = models[0].state(method, 2);
            let gravity = [0.0, 0.1, -1.0];
            unsafe {
                ok(sw_state_set_gravity(state.handle, gravity.as_ptr()));
                ok(sw_state_step(state.handle, 0.1));
            }
            state.save()
        });
        Good { models: models.map(|model| model.save()), states }
    })
}

/// Up to seven words of 1, 4 or 8 bytes replaced, now and then the length changed, and sealed again.
fn forged(good: &[u8], input: &mut Input) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..1 + input.below(7) {
        let at = usize::from(u16::from_le_bytes(input.array()));
        let patch: Vec<u8> = match input.below(6) {
            0 => vec![input.byte()],
            1 => u32::from(input.byte()).to_le_bytes().to_vec(),
            2 => input.array::<4>().to_vec(),
            3 => input.number().to_le_bytes().to_vec(),
            4 => (input.number() as f32).to_le_bytes().to_vec(),
            _ => input.array::<8>().to_vec(),
        };
        // Near the front everything counts; further on numbers are aligned.
        let at = if at % 2 == 0 { at / 2 % 200 } else { at / 8 * 4 };
        let at = at % bytes.len().saturating_sub(patch.len()).max(1);
        bytes[at..at + patch.len()].copy_from_slice(&patch);
    }
    if input.one_in(16) {
        bytes.resize(8.max((bytes.len() + input.below(64)).saturating_sub(32)), input.byte());
    }
    sealed(bytes)
}

/// With the checksum that belongs to them.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let body = bytes.len() - 8;
    let sum = xxh3_64(&bytes[..body]).to_le_bytes();
    bytes[body..].copy_from_slice(&sum);
    bytes
}

fn use_state(state: &State, input: &mut Input) {
    state.check_outputs();
    if !input.one_in(4) {
        return;
    }
    let gravity = [0.3, 0.0, -1.0];
    unsafe {
        ok(sw_state_set_gravity(state.handle, gravity.as_ptr()));
        ok_or(sw_state_step(state.handle, 0.05), &[SW_ERROR_NUMERICAL]);
        let h = input.number();
        ok_or(sw_state_step(state.handle, h), &[SW_ERROR_NUMERICAL, SW_ERROR_INVALID_ARGUMENT]);
    }
    state.check_outputs();
}

/// Those of an older library: they are not saved any more. The place is that of the table in src/model/file.rs.
fn without_seconds(bytes: &[u8]) -> Vec<u8> {
    let front = if bytes[4..8] == 1u32.to_le_bytes() { 40 } else { 48 };
    let mut out = bytes.to_vec();
    out[front + 24 + 56..][..48].fill(0);
    sealed(out)
}

fn try_model(bytes: &[u8], input: &mut Input) {
    let Some(model) = Model::load(bytes) else { return };
    assert!(model.save() == without_seconds(bytes), "a loaded model saves as it was");
    let method = [SW_METHOD_WARP, SW_METHOD_LMA, SW_METHOD_WARP_VIRTUAL_WORK][input.below(3)];
    use_state(&model.state(method, 1 + input.below(2) as u32), input);
}

fn try_state(bytes: &[u8], method: usize, input: &mut Input) {
    thread_local! {
        static STATES: Vec<State> = {
            let model = Model::load(&good().models[0]).unwrap();
            METHODS.map(|method| model.state(method, 2)).into()
        };
    }
    STATES.with(|states| {
        let state = &states[method];
        let before = state.seen();
        if state.load(bytes) {
            assert!(state.save() == bytes, "a loaded state saves as it was");
            use_state(state, input);
        } else {
            assert!(state.seen() == before, "a refused load changed the state");
        }
        ok(unsafe { sw_state_reset(state.handle) });
    });
}

pub fn run(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    let method = input.below(METHODS.len());
    match input.below(8) {
        0 => try_model(&bytes[bytes.len().min(2)..], &mut input),
        1 => try_state(&bytes[bytes.len().min(2)..], method, &mut input),
        2 | 3 => {
            let forged = forged(&good().states[method], &mut input);
            try_state(&forged, method, &mut input);
        }
        k => {
            let forged = forged(&good().models[k % 2], &mut input);
            try_model(&forged, &mut input);
        }
    }
}
