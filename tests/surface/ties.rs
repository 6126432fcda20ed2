//! Ties: vertices held together with others or with triangles, as seams, straps and buttons.

use crate::common::*;
use crate::plates::*;
use nalgebra::UnitQuaternion;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::energy::{Curvature, Energy, Mat3, Stress, TieEnergy};
use shellwarp::material::{Crease, ElasticSheet, Elasticity, Tie, TiedTo, touching};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::shell::Make;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3, reduced};
use std::sync::Arc;

const SHEET: ElasticSheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 1e-2, volume_density: 100.0 };
const CARD: Material = Material { k_area: 5e3, k_length: 5e3, k_bend: 2.7e-3, area_density: 0.3 };

fn at_low_x(positions: &[Vec3]) -> Supports {
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.11).collect();
    Supports { fixed, ..Default::default() }
}

fn made((positions, triangles): &Sheet, make: Make) -> Arc<Shell> {
    let supports = at_low_x(positions);
    Arc::new(Shell::made(Mesh::new(positions.clone(), triangles).unwrap(), make, &supports).unwrap())
}

/// The sheet cut along x = 0.5: the vertices there twice, in pairs.
fn cut((positions, triangles): &Sheet) -> (Sheet, Vec<[u32; 2]>) {
    let mut cut = positions.clone();
    let mut twin = vec![u32::MAX; positions.len()];
    let mut pairs = vec![];
    for (v, x) in positions.iter().enumerate().filter(|(_, x)| (x.x - 0.5).abs() < 1e-9) {
        twin[v] = cut.len() as u32;
        pairs.push([v as u32, twin[v]]);
        cut.push(*x);
    }
    let beyond = |t: &[u32; 3]| t.iter().map(|v| positions[*v as usize].x).sum::<f64>() > 1.5;
    let there = |v: u32| if twin[v as usize] == u32::MAX { v } else { twin[v as usize] };
    let of_both = triangles.iter().map(|t| if beyond(t) { t.map(there) } else { *t }).collect();
    ((cut, of_both), pairs)
}

fn stiff(pairs: &[[u32; 2]]) -> Vec<Tie> {
    pairs.iter().map(|[a, b]| Tie { vertex: *b, to: TiedTo::Vertex(*a), stiffness: 0.0 }).collect()
}

/// The whole sheet with a seam at x = 0.5 that turns freely, and its halves tied there.
fn seamed() -> (Arc<Shell>, Arc<Shell>, usize) {
    let whole = rectangle(Family::Diagonal, 10, 1.0, 0.4);
    let on_seam = |v: u32| (whole.0[v as usize].x - 0.5).abs() < 1e-9;
    let mesh = Mesh::new(whole.0.clone(), &whole.1).unwrap();
    let seam = mesh.edges.iter().filter(|e| e.vertices.iter().all(|v| on_seam(*v)));
    let creases =
        seam.map(|e| Crease { vertices: e.vertices, factor: 0.0, angle: None, yield_angle: f64::INFINITY }).collect();
    let hinged = made(&whole, Make { creases, ..Make::of(SHEET) });
    let (halves, pairs) = cut(&whole);
    let tied = made(&halves, Make { ties: stiff(&pairs), ..Make::of(SHEET) });
    (hinged, tied, whole.0.len())
}

#[test]
fn halves_tied_along_a_seam_have_the_modes_of_the_whole_with_a_hinge() {
    let (hinged, tied, n) = seamed();
    assert_eq!(tied.mesh.n_components, 1, "tied pieces count as one");
    let [whole, halves] = [&hinged, &tied].map(|shell| modes_of(shell, 8));
    assert_eq!((whole.zero_modes, halves.zero_modes), (1, 1), "the flap turns about the seam");
    for k in 1..8 {
        // A tie gives by a thousandth of what the shell does next to it, and so lowers a frequency by less.
        let off = halves.eigenvalues[k] / whole.eigenvalues[k] - 1.0;
        assert!(off < 1e-9 && off > -1e-3, "mode {k}: {off:e}");
        let [a, b] = [&whole.shapes[k], &halves.shapes[k]];
        let side = a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>().signum();
        let turned: Vec<Vec3> = b[..n].iter().map(|x| side * x).collect();
        assert!(error(&turned, a) < 1e-2, "mode {k}: {:e}", error(&turned, a));
    }
}

#[test]
fn halves_tied_along_a_seam_bend_far_as_the_whole_does() {
    let (hinged, tied, n) = seamed();
    let bent = |shell: &Arc<Shell>| {
        // The free end is pulled along and down, so that the flap has a balance.
        let load = |v: usize| shell.mass[v] * Vec3::new(40.0, 0.0, -9.8);
        let load: Vec<Vec3> = (0..shell.mass.len()).map(load).collect();
        let mut solver = Solver::new(shell.clone()).unwrap();
        let none = vec![Vec3::zeros(); load.len()];
        let options = EquilibriumOptions { tolerance: 1e-9, ..Default::default() };
        solver.equilibrium(&none, &load, &options, &mut |_| Ok(())).unwrap().displacement
    };
    let [whole, halves] = [&hinged, &tied].map(bent);
    let furthest = whole.iter().map(|u| u.norm()).fold(0.0, f64::max);
    assert!(furthest > 0.05, "{furthest}");
    assert!(error(&halves[..n], &whole) < 1e-3, "{:e}", error(&halves[..n], &whole));
}

#[test]
fn a_soft_tie_pulls_by_its_stiffness_times_the_gap() {
    // Two sheets side by side, held but for a corner each, which a spring joins: k d of a gap d.
    let (mut positions, mut triangles) = equilateral_sheet(4, 2, 0.1);
    let n = positions.len() as u32;
    positions.extend(positions.clone().iter().map(|x| x + Vec3::new(0.4, 0.0, 0.0)));
    triangles.extend(triangles.clone().iter().map(|t| t.map(|v| v + n)));
    let find = |x: f64| {
        (0..2 * n).filter(|v| (positions[*v as usize] - Vec3::new(x, 0.0, 0.0)).norm() < 1e-9).collect::<Vec<_>>()
    };
    let ends = find(0.4);
    let k = 0.7;
    let ties = vec![Tie { vertex: ends[1], to: TiedTo::Vertex(ends[0]), stiffness: k }];
    let supports = Supports { fixed: (0..2 * n).filter(|v| !ends.contains(v)).collect(), ..Default::default() };
    let mesh = || Mesh::new(positions.clone(), &triangles).unwrap();
    let free = Shell::new(mesh(), CARD, &supports).unwrap();
    let tied = Shell::made(mesh(), Make { ties, ..Make::of(CARD) }, &supports).unwrap();
    let mut x = positions.clone();
    let gap = Vec3::new(0.01, -0.02, 0.03);
    x[ends[1] as usize] += gap;
    let pull = |shell: &Shell| {
        let mut g = vec![Vec3::zeros(); x.len()];
        shell.energy.add_gradient(&x, &mut g);
        ends.iter().map(|v| g[*v as usize]).collect::<Vec<_>>()
    };
    let (with, without) = (pull(&tied), pull(&free));
    for (v, sign) in [(0, -1.0), (1, 1.0)] {
        let force = with[v] - without[v];
        // Beside the sheet's own pull of a few thousand.
        assert!((force - sign * k * gap).norm() < 1e-9 * k, "{force:?}");
    }
    let stored = tied.energy.value(&x) - free.energy.value(&x);
    assert_close("its energy", stored, 0.5 * k * gap.norm_squared(), 1e-9, 0.0);
}

/// A patch over a bumpy sheet, tied at a height.
fn buttoned() -> (Vec<Vec3>, Shell) {
    let (mut positions, mut triangles) = equilateral_sheet(4, 4, 0.1);
    positions.iter_mut().for_each(|x| x.z = 0.3 * x.x * x.x + 0.2 * x.x * x.y);
    let n = positions.len() as u32;
    let (patch, of_patch) = equilateral_sheet(2, 2, 0.07);
    positions.extend(patch.iter().map(|x| x + Vec3::new(0.11, 0.12, 0.08)));
    triangles.extend(of_patch.iter().map(|t| t.map(|v| v + n)));
    let tie = |(vertex, to, stiffness)| Tie { vertex, to, stiffness };
    let ties =
        [(n, TiedTo::Triangle(5), 3.0), (n + 4, TiedTo::Triangle(9), 2.0), (n + 7, TiedTo::Vertex(6), 1.0)].map(tie);
    let mesh = Mesh::new(positions.clone(), &triangles).unwrap();
    let make = Make { ties: ties.to_vec(), ..Make::of(CARD) };
    (positions, Shell::made(mesh, make, &Supports::default()).unwrap())
}

fn gradient(energy: &dyn Energy, x: &[Vec3]) -> Vec<Vec3> {
    let mut g = vec![Vec3::zeros(); x.len()];
    energy.add_gradient(x, &mut g);
    g
}

#[test]
fn ties_have_the_derivatives_of_their_energy_and_turn_with_the_shell() {
    let (rest, tied) = buttoned();
    let ties = TieEnergy::new(&tied.mesh, &tied.bonds, &[]);
    let mut rng = StdRng::seed_from_u64(7);
    let random = |rng: &mut StdRng| -> Vec<Vec3> {
        (0..rest.len()).map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect()
    };
    let inner = |a: &[Vec3], b: &[Vec3]| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(b)).sum() };
    let along = |x: &[Vec3], d: &[Vec3], h: f64| -> Vec<Vec3> { x.iter().zip(d).map(|(x, d)| x + h * d).collect() };
    let only = |x: &[Vec3]| ties.value(x);
    let slope = |x: &[Vec3]| gradient(&ties, x);
    assert!(only(&rest).abs() < 1e-25 && slope(&rest).iter().all(|g| g.norm() < 1e-14), "at rest nothing pulls");
    let turn = UnitQuaternion::from_scaled_axis(Vec3::new(0.9, -0.4, 1.3));
    for trial in 0..10 {
        let x = along(&rest, &random(&mut rng), 4e-3 * f64::from(trial));
        let moved: Vec<Vec3> = x.iter().map(|x| turn * x + Vec3::new(1.0, 2.0, 3.0)).collect();
        // Of gaps of 1e-2 between coordinates of 3.
        assert_close("energy of the turned shape", only(&moved), only(&x), 1e-7, 1e-6);
        let (d, e, h) = (random(&mut rng), random(&mut rng), 1e-6);
        let [ahead, behind] = [h, -h].map(|h| along(&x, &d, h));
        let g = slope(&x);
        let difference = (only(&ahead) - only(&behind)) / (2.0 * h);
        assert_close("slope", inner(&g, &d), difference, 1e-6, 1e-3 * inner(&d, &d).sqrt());
        let curve = (inner(&slope(&ahead), &e) - inner(&slope(&behind), &e)) / (2.0 * h);
        let mut exact = 0.0;
        ties.visit_hessian(&x, Curvature::Exact, &mut |(vertices, blocks): (&[u32], &[Mat3])| {
            for (p, v) in vertices.iter().enumerate() {
                for (q, w) in vertices.iter().enumerate() {
                    exact += d[*v as usize].dot(&(blocks[p * vertices.len() + q] * e[*w as usize]));
                }
            }
        });
        assert_close("curvature", exact, curve, 1e-5, 1.0);
    }
}

#[test]
fn elements_of_ties_add_up_to_their_energy_and_hessian() {
    let (rest, tied) = buttoned();
    let x: Vec<Vec3> = rest.iter().map(|x| Vec3::new(x.x, 1.1 * x.y + 0.1 * x.x, x.z + 0.3 * x.y * x.y)).collect();
    let (mut sum, mut stress, mut force) = (0.0, vec![], vec![Vec3::zeros(); x.len()]);
    tied.energy.visit_strains(&x, &mut |(vertices, row), strain| {
        sum += 0.5 * strain * strain;
        stress.push(strain);
        vertices.iter().zip(row).for_each(|(v, b)| force[*v as usize] += strain * b);
    });
    assert_eq!(stress.len(), tied.energy.n_elements());
    assert_close("energy", sum, tied.energy.value(&x), 1e-12, 0.0);
    assert!(error(&force, &gradient(&*tied.energy, &x)) < 1e-12);
    type Blocks<'a> = &'a mut dyn FnMut((&[u32], &[Mat3]));
    let apply = |visit: &dyn Fn(Blocks)| {
        let mut out = vec![Vec3::zeros(); x.len()];
        visit(&mut |(vertices, blocks)| {
            for (p, v) in vertices.iter().enumerate() {
                let part = |(q, w): (usize, &u32)| blocks[p * vertices.len() + q] * rest[*w as usize].yzx();
                out[*v as usize] += vertices.iter().enumerate().map(part).sum::<Vec3>();
            }
        });
        out
    };
    let exact = apply(&|visit| tied.energy.visit_hessian(&x, Curvature::Exact, visit));
    let mixed = apply(&|visit| tied.energy.visit_mixed_hessian(&x, Stress::whole(&stress), visit));
    assert!(error(&mixed, &exact) < 1e-12);
    let mut parts = apply(&|visit| tied.energy.visit_stress_hessian(&x, &stress, Curvature::Exact, visit));
    tied.energy.visit_rows(&x, &mut |(vertices, row)| {
        let along: f64 = vertices.iter().zip(row).map(|(v, b)| b.dot(&rest[*v as usize].yzx())).sum();
        vertices.iter().zip(row).for_each(|(v, b)| parts[*v as usize] += along * b);
    });
    assert!(error(&parts, &exact) < 1e-12);
    // All elements with weight 1 are the whole; a tie's three count alike.
    let mut weights = vec![1.0; stress.len()];
    let index: Vec<u32> = (0..x.len() as u32).collect();
    assert_close("sampled", tied.energy.sampled(&weights, &index).value(&x), sum, 1e-12, 0.0);
    let last = weights.len() - 1;
    (weights[last], weights[last - 1], weights[last - 2]) = (6.0, 0.0, 0.0);
    tied.energy.even(&mut weights);
    assert_eq!(weights[last - 2..], [2.0; 3]);
}

/// Two strips that overlap by four cells, one a thousandth above the other, of half the stiffness and mass there.
fn lapped(distance: f64) -> (Sheet, f64) {
    let (mut positions, mut triangles) = rectangle(Family::Diagonal, 12, 0.6, 0.2);
    let n = positions.len() as u32;
    let other = rectangle(Family::Diagonal, 12, 0.6, 0.2);
    positions.extend(other.0.iter().map(|x| x + Vec3::new(0.4, 0.0, 1e-3)));
    triangles.extend(other.1.iter().map(|t| t.map(|v| v + n)));
    ((positions, triangles), distance)
}

#[test]
fn what_touches_is_tied_and_carries_bending_where_it_overlaps() {
    let (sheet, distance) = lapped(2e-3);
    let mesh = Mesh::new(sheet.0.clone(), &sheet.1).unwrap();
    let ties = touching(&mesh, distance).unwrap();
    // Five columns of five vertices lie above the other strip.
    assert_eq!(ties.len(), 25, "{ties:?}");
    let make = |tie_distance| Make { tie_distance, ..Make::of(SHEET) };
    let apart = modes_of(&made(&sheet, make(0.0)), 8);
    let joined = made(&sheet, make(distance));
    let tied = modes_of(&joined, 8);
    assert_eq!((apart.zero_modes, tied.zero_modes), (6, 0), "the second strip was loose");
    // A strip of 1.0 with two layers from 0.4 to 0.6, by the beam's energy, is a little stiffer than a plain one; held to 0.1.
    let plain = modes_of(&made(&rectangle(Family::Diagonal, 20, 1.0, 0.2), Make::of(SHEET)), 1);
    let ratio = (tied.eigenvalues[0] / plain.eigenvalues[0]).sqrt();
    println!("lapped over plain: {ratio:.3}");
    assert!(ratio > 0.9 && ratio < 1.6, "{ratio}");
    // Numbered the other way round it is the same seam.
    assert!(touching(&mesh, 5e-4).unwrap().is_empty());
}

#[test]
fn ties_hold_in_every_method_and_save_to_the_same_bits() {
    let (sheet, distance) = lapped(2e-3);
    let material: Elasticity = Material { k_area: 5e3, k_length: 5e3, k_bend: 0.05, area_density: 1.0 }.into();
    let shell = made(&sheet, Make { tie_distance: distance, ..Make::of(material) });
    let reduced = reduced::Options { fields: 8, gravity: 2.0, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    let model = Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap());
    let gap = |state: &State| {
        let mut x = vec![Vec3::zeros(); model.shell.mass.len()];
        state.positions(Space::World, |v, p| x[v] = p);
        let apart = |bond: &shellwarp::material::Bond| {
            let foot: Vec3 = (0..3).map(|i| bond.weights[i] * x[bond.corners[i] as usize]).sum();
            ((x[bond.vertex as usize] - foot).norm() - bond.height.abs()).abs()
        };
        model.shell.bonds.iter().map(apart).fold(0.0, f64::max)
    };
    let low = |state: &State| {
        let mut low = 0.0f64;
        state.positions(Space::World, |_, p| low = low.min(p.z));
        low
    };
    for method in [
        Method::Warp,
        Method::VirtualWorkWarp,
        Method::LinearModalAnalysis,
        Method::ReducedShell,
        Method::ImplicitShell,
    ] {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.0, -1.0)).unwrap();
        (0..20).for_each(|_| state.step(1.0 / 60.0).unwrap());
        println!("{method}: opens by {:.1e} of a sag of {:.1e}", gap(&state), low(&state));
        // The warp turns vertices one by one; others keep the seam.
        assert!(low(&state) < -0.01 && gap(&state) < 0.05 * -low(&state), "{method}: {:e}", gap(&state));
    }
    for method in [Method::RotationStrain, Method::PolynomialShell] {
        let refused = State::new(model.clone(), method, Integrator::ImplicitEuler).err().unwrap();
        assert!(refused.kind == ErrorKind::Unsupported && refused.message.contains("ties"), "{}", refused.message);
    }
    let bytes = model.save().unwrap();
    let loaded = Model::load(&bytes).unwrap();
    assert_eq!(loaded.shell.bonds, model.shell.bonds);
    assert_eq!((loaded.fingerprint, loaded.save().unwrap()), (model.fingerprint, bytes));
}

#[test]
fn wrong_ties_are_named() {
    let (positions, triangles) = equilateral_sheet(3, 2, 0.1);
    let n = positions.len() as u32;
    let refused = |vertex: u32, to: TiedTo, stiffness: f64| {
        let make = Make { ties: vec![Tie { vertex, to, stiffness }], ..Make::of(CARD) };
        let error =
            Shell::made(Mesh::new(positions.clone(), &triangles).unwrap(), make, &Supports::default()).err().unwrap();
        assert!(error.kind == ErrorKind::InvalidArgument && error.message.contains("tie 0"), "{}", error.message);
    };
    refused(n, TiedTo::Vertex(0), 0.0);
    refused(0, TiedTo::Vertex(n), 0.0);
    refused(3, TiedTo::Vertex(3), 0.0);
    refused(0, TiedTo::Triangle(triangles.len() as u32), 0.0);
    refused(triangles[2][1], TiedTo::Triangle(2), 0.0);
    refused(0, TiedTo::Vertex(5), -1.0);
    refused(0, TiedTo::Vertex(5), f64::NAN);
    let mesh = Mesh::new(positions.clone(), &triangles).unwrap();
    assert_eq!(touching(&mesh, f64::INFINITY).err().unwrap().kind, ErrorKind::InvalidArgument);
}
