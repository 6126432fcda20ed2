//! Builds that leave parts out: what is missing is refused by name, what is there works. Runs with any Cargo features:
//! `cargo test --no-default-features --test features`.
#![allow(missing_docs)]
mod common;
use common::equilateral_sheet;
use shellwarp::collider::Solid;
use shellwarp::contact::Obstacle;
use shellwarp::features::Feature;
use shellwarp::load::Wind;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::Pose;
use shellwarp::{ErrorKind, Material, Mesh, Result, Shell, Supports, Vec3};
use std::sync::Arc;

fn precomputed(options: &Options) -> Result<Model> {
    let (positions, triangles) = equilateral_sheet(4, 3, 0.25);
    let supports = Supports { clamped: vec![0], ..Default::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), Material::default(), &supports).unwrap();
    Model::precompute(Arc::new(shell), options, &mut |_, _| Ok(()))
}

/// Fails unless `outcome` is a success just where the build has the feature, and a refusal by its name elsewhere.
fn agrees<T>(feature: Feature, outcome: Result<T>) {
    match outcome {
        Ok(_) => assert!(feature.is_built_in(), "{feature:?} is not in this build, yet it works"),
        Err(error) => {
            assert!(!feature.is_built_in(), "{feature:?}: {}", error.message);
            assert_eq!(error.kind, ErrorKind::Unsupported);
            assert!(error.message.contains(feature.name()), "{}", error.message);
        }
    }
}

#[test]
fn what_a_build_lacks_is_refused_by_name_and_the_rest_works() {
    let with = |precision| precomputed(&Options { modes: 4, precision, ..Options::default() });
    let model = Arc::new(with(Precision::F32).unwrap());
    agrees(Feature::F64Basis, with(Precision::F64));
    agrees(Feature::I16Basis, with(Precision::I16));
    let hanging = Options { modes: 4, sag: Vec3::new(0.0, 0.0, -0.01), ..Options::default() };
    agrees(Feature::NonlinearShell, precomputed(&hanging));
    let trained = reduced::Options { fields: 4, poses: 2, ..Default::default() };
    let with_fields = precomputed(&Options { modes: 4, reduced: trained, ..Options::default() });
    let reduced = with_fields.and_then(|model| State::new(Arc::new(model), Method::ReducedShell, Integrator::Exact));
    agrees(Feature::ReducedShell, reduced.and_then(|mut state| state.step(0.01)));
    agrees(Feature::SavedModels, model.save().and_then(|bytes| Model::load(&bytes)));
    for method in [Method::ImplicitShell, Method::ExplicitShell] {
        let state = State::new(model.clone(), method, Integrator::ImplicitEuler);
        agrees(Feature::NonlinearShell, state.and_then(|mut state| state.step(1e-6)));
    }
    for method in [Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis] {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.0, -1.0)).unwrap();
        state.set_forces(vec![(5, Vec3::x())], false).unwrap();
        let wind = Wind { velocity: Vec3::y(), density: 1.2, normal_drag: 1.0, ..Wind::default() };
        agrees(Feature::Wind, state.set_wind(wind));
        state.set_wind(Wind::default()).unwrap(); // none at all, with any build
        let floor =
            Obstacle::new(Arc::new(Solid::plane()), Pose { origin: Vec3::new(0.0, 0.0, -1.0), ..Pose::identity() });
        agrees(Feature::Contact, state.set_obstacles(vec![floor]));
        state.step(1.0 / 30.0).unwrap();
        let mut moved = 0;
        state.positions(Space::World, |v, x| moved += usize::from(x != model.shell.mesh.positions[v]));
        assert!(moved > 0);
    }
}
