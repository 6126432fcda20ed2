//! What every saved model has to be: the same in its motion, and refused where bytes of it are damaged.

use crate::common::displacements;
use shellwarp::Vec3;
use shellwarp::model::Model;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use std::sync::Arc;

pub fn assert_moves_by_the_same_bits(models: [&Arc<Model>; 2], methods: &[Method]) {
    for method in methods {
        let [one, other] = models.map(|model| {
            let mut state = State::new(model.clone(), *method, Integrator::Exact).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -3.0)).unwrap();
            (0..5).for_each(|_| state.step(0.01).unwrap());
            displacements(&state)
        });
        assert!(one == other, "{method:?}");
    }
}

/// Bytes that are cut or lie are refused, and none harms.
pub fn assert_damage_is_refused(bytes: &[u8]) {
    for k in (0..bytes.len()).step_by(bytes.len() / 300) {
        let mut bad = bytes.to_vec();
        bad[k] ^= 0x10;
        assert!(Model::load(&bad).is_err() && Model::load(&bytes[..k]).is_err());
    }
}
