//! Every kernel in every kind of registers that this processor has, against a plain loop in f64 over vertices and modes; and
//! each kind gives the same bits every time.

use crate::common::*;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SMatrix};
use pulp::Arch;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::energy::Curvature;
use shellwarp::load::BodyLoad;
use shellwarp::reduced::polynomial::{Coefficients, Engineering, Form, LEADING, PolynomialEnergy};
use shellwarp::reduced::{Factor, ReducedEnergy};
use shellwarp::step::ForceLaw;
use shellwarp::step::modal_force::{self, Acting, Scratch};
use shellwarp::support::{Pose, Rates};
use shellwarp::warp::{self, Amplitudes, Basis, Entry, I16, Placement};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};

/// All kinds of registers here; the scalar one is everywhere.
fn kinds() -> Vec<(&'static str, Arch)> {
    let mut kinds = vec![("scalar", Arch::Scalar)];
    #[cfg(target_arch = "x86_64")]
    {
        kinds.extend(pulp::x86::V3::try_new().map(|simd| ("AVX2", Arch::V3(simd))));
        kinds.extend(pulp::x86::V4::try_new().map(|simd| ("AVX-512", Arch::V4(simd))));
    }
    #[cfg(target_arch = "aarch64")]
    kinds.extend(pulp::aarch64::Neon::try_new().map(|simd| ("NEON", Arch::Neon(simd))));
    kinds
}

/// A shell of random numbers, its motion and what acts on it.
struct Case {
    rest: Vec<Vec3>,
    mass: Vec<f64>,
    /// Φ and Ψ, mode by mode.
    modes: Vec<(Vec<Vec3>, Vec<Vec3>)>,
    q: Vec<f64>,
    q_dot: Vec<f64>,
    external: Vec<Vec3>,
    gravity: Vec3,
    rates: Rates,
    pose: Pose,
}

const LAWS: [ForceLaw; 3] = [ForceLaw::Linear, ForceLaw::Rotated, ForceLaw::VirtualWork];

fn random(rng: &mut StdRng) -> Vec3 {
    Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

impl Case {
    /// Numbers that f32 holds, so that both precisions start from the same. Some vertices turn by several rad.
    fn new(n: usize, modes: usize, seed: u64) -> Self {
        let rng = &mut StdRng::seed_from_u64(seed);
        let single = |v: Vec3| v.map(|x| f64::from(x as f32));
        let field = |rng: &mut StdRng| (0..n).map(|_| single(random(rng))).collect::<Vec<_>>();
        let numbers = |rng: &mut StdRng| (0..modes).map(|_| rng.random_range(-1.5..1.5)).collect();
        Self {
            rest: field(rng),
            mass: vec![1.0 / 4096.0; n], // with a total of 1 kept in mind: scales of the basis are 1
            modes: (0..modes).map(|_| (field(rng), field(rng))).collect(),
            q: numbers(rng),
            q_dot: numbers(rng),
            external: (0..n).map(|_| random(rng) / 4096.0).collect(),
            gravity: random(rng),
            rates: Rates {
                acceleration: random(rng),
                angular_velocity: random(rng),
                angular_acceleration: random(rng),
                ..Rates::default()
            },
            pose: Pose { origin: random(rng), rotation: Rotation3::new(random(rng)).into() },
        }
    }

    /// With Φ and Ψ as a basis holds them: rounded where that has 16 bits.
    fn as_stored<E: Entry>(&self) -> Self {
        let basis = self.basis::<E>(Arch::Scalar);
        let field = |k| (0..self.rest.len()).map(|v| basis.at(k, v)).unzip();
        let [rest, external] = [&self.rest, &self.external].map(Clone::clone);
        let (mass, q, q_dot) = (self.mass.clone(), self.q.clone(), self.q_dot.clone());
        Self { rest, mass, modes: (0..q.len()).map(field).collect(), q, q_dot, external, ..*self }
    }

    fn basis<E: Entry>(&self, arch: Arch) -> Basis<E> {
        let mut basis = Basis::new(&self.rest, &self.mass, self.modes.len(), 1.0).unwrap();
        self.modes.iter().enumerate().for_each(|(k, (phi, psi))| basis.set_mode(k, phi, psi));
        basis.arch = arch;
        basis
    }

    /// (Φq, Ψq) of vertex `v`.
    fn combined(&self, v: usize, q: &[f64]) -> (Vec3, Vec3) {
        let sum =
            |(y, w): (Vec3, Vec3), ((phi, psi), q): (&(Vec<Vec3>, Vec<Vec3>), &f64)| (y + phi[v] * *q, w + psi[v] * *q);
        self.modes.iter().zip(q).fold((Vec3::zeros(), Vec3::zeros()), sum)
    }

    /// Displacement and its derivatives by y = Φq and w = Ψq, under a law, of vertex `v`.
    fn shape(&self, v: usize, law: ForceLaw) -> (Vec3, Matrix3<f64>, Matrix3<f64>) {
        let (y, w) = self.combined(v, &self.q);
        match law {
            ForceLaw::Linear => (y, Matrix3::identity(), Matrix3::zeros()),
            // The paper's velocity and force turn with R; its position is warped by R̃.
            ForceLaw::Rotated => (warp_matrix(&w) * y, *Rotation3::new(w).matrix(), Matrix3::zeros()),
            ForceLaw::VirtualWork => (warp_matrix(&w) * y, warp_matrix(&w), derivative_by_w(&w, &y)),
        }
    }

    fn velocity(&self, v: usize, (by_y, by_w): (&Matrix3<f64>, &Matrix3<f64>)) -> Vec3 {
        let (y_dot, w_dot) = self.combined(v, &self.q_dot);
        by_y * y_dot + by_w * w_dot
    }

    /// Modal force, the sum of its terms' sizes (mode by mode), √(Σ m|a|²) and Σ|F|.
    fn force(&self, law: ForceLaw, load: &BodyLoad, external: bool) -> (Vec<f64>, Vec<f64>, [f64; 2]) {
        let (mut force, mut size) = (vec![0.0; self.q.len()], vec![0.0; self.q.len()]);
        let [mut square, mut total] = [0.0; 2];
        for v in 0..self.rest.len() {
            let (u, by_y, by_w) = self.shape(v, law);
            let mut f = load.at(self.mass[v], self.rest[v] + u, self.velocity(v, (&by_y, &by_w)));
            square += f.norm_squared() / self.mass[v];
            if external {
                f += self.external[v];
                total += self.external[v].norm();
            }
            for (k, (phi, psi)) in self.modes.iter().enumerate() {
                force[k] += phi[v].dot(&(by_y.transpose() * f)) + psi[v].dot(&(by_w.transpose() * f));
                size[k] += f.norm() * (1.0 + by_w.norm());
            }
        }
        (force, size, [square.sqrt(), total])
    }
}

/// A, B, C of s = |w|² by closed forms.
fn closed_forms(s: f64) -> [f64; 3] {
    let t = s.sqrt();
    [t.sin() / t, (1.0 - t.cos()) / s, (t - t.sin()) / (s * t)]
}

fn warp_matrix(w: &Vec3) -> Matrix3<f64> {
    let [a, b, c] = closed_forms(w.norm_squared());
    Matrix3::identity() * a + w.cross_matrix() * b + w * w.transpose() * c
}

/// ∂(R̃(w) y)/∂w by the product rule on R̃ = A I + B [w]× + C wwᵀ, with slopes by closed forms too.
fn derivative_by_w(w: &Vec3, y: &Vec3) -> Matrix3<f64> {
    let s = w.norm_squared();
    let [a, b, c] = closed_forms(s);
    let [da, db, dc] = [0.5 * (c - b), (0.5 * a - b) / s, (b - 3.0 * c) / (2.0 * s)];
    let by_s = y * da + w.cross(y) * db + w * w.dot(y) * dc;
    by_s * (2.0 * w).transpose() - y.cross_matrix() * b + (Matrix3::identity() * w.dot(y) + w * y.transpose()) * c
}

/// Sizes around the block of 16 and, with few modes, past the 64 blocks after which sums are gathered.
fn cases() -> impl Iterator<Item = Case> {
    let small = [1, 2, 7, 8, 9, 15, 16, 17, 31, 33, 50].into_iter().enumerate();
    let small = small.flat_map(|(i, n)| [1 + i % 9, 1 + (i + 4) % 9].map(|modes| (n, modes)));
    let by_modes = (1..=9).map(|modes| (37, modes));
    small.chain(by_modes).chain([(1051, 3)]).enumerate().map(|(i, (n, modes))| Case::new(n, modes, i as u64))
}

/// Relative rounding of sums like these: some 10 operations a term on numbers of order 10, and for w, from which the closed forms
/// subtract, 1/s ≤ 1e4 of it in f64.
fn tolerance<E: Entry>() -> f64 {
    if size_of::<E::Real>() == 4 { 4e-6 } else { 1e-11 }
}

fn loads(case: &Case) -> [(&'static str, BodyLoad, bool); 4] {
    let still = || BodyLoad::new(case.gravity, &case.pose, &Rates::default());
    let spinning = || BodyLoad::new(case.gravity, &case.pose, &case.rates);
    [
        ("gravity", still(), false),
        ("gravity and forces", still(), true),
        ("spin", spinning(), false),
        ("spin and forces", spinning(), true),
    ]
}

fn check_forces<E: Entry>(case: &Case, name: &str, arch: Arch) {
    let case = &case.as_stored::<E>();
    let (n, modes) = (case.rest.len(), case.q.len());
    let basis = case.basis::<E>(arch);
    for law in LAWS {
        for (what, load, external) in &loads(case) {
            let external_forces = external.then_some(&case.external[..]);
            let (q, q_dot) = (&case.q[..], &case.q_dot[..]);
            let acting = Acting { load, external: external_forces, law, q, q_dot, total_mass: 1.0 };
            let run = || {
                let mut force = vec![f64::NAN; modes];
                let pull = modal_force::project(&basis, &acting, &mut Scratch::new(modes), &mut force);
                (force, [pull.body, pull.external])
            };
            let (force, pull) = run();
            assert_eq!(run(), (force.clone(), pull), "{name}: the same bits");
            let (expected, size, [by_mass, external_forces]) = case.force(law, load, *external);
            for k in 0..modes {
                let what = format!("{name}, {} bits, {law:?}, {what}, n {n}, mode {k}", 8 * E::BYTES);
                assert_close(&what, force[k], expected[k], tolerance::<E>(), size[k]);
            }
            // That of a uniform load is told of the whole mass 1, whatever the vertices add up to.
            let body = if load.spin_rate().is_none() { case.gravity.norm() } else { by_mass };
            let what = format!("{name}, {law:?}, {what}, n {n}");
            assert_close(&format!("{what}, acceleration"), pull[0], body, tolerance::<E>(), 0.0);
            assert_close(&format!("{what}, Σ|F|"), pull[1], external_forces, tolerance::<E>(), f64::MIN_POSITIVE);
        }
    }
}

#[test]
fn modal_forces_match_a_plain_loop_in_every_kind_of_register() {
    for case in cases() {
        for (name, arch) in kinds() {
            check_forces::<f32>(&case, name, arch);
            check_forces::<f64>(&case, name, arch);
            check_forces::<I16>(&case, name, arch);
        }
    }
}

/// Displacement u and rotation vector w of every vertex, in order.
fn visit_displacements<E: Entry>(basis: &Basis<E>, warped: bool, q: &[f64], mut visit: impl FnMut(usize, Vec3, Vec3)) {
    let mut turns = vec![];
    warp::visit_turns(basis, q, |v, w| {
        assert_eq!(v, turns.len());
        turns.push(w);
    });
    let law = if warped { ForceLaw::Rotated } else { ForceLaw::Linear };
    modal_force::visit_motion(basis, law, (q, &vec![0.0; q.len()]), |v, u, _| visit(v, u, turns[v]));
}

fn check_motion<E: Entry>(case: &Case, name: &str, arch: Arch) {
    let case = &case.as_stored::<E>();
    let basis = case.basis::<E>(arch);
    for law in LAWS {
        let mut visited = 0;
        visit_displacements(&basis, law.warped(), &case.q, |v, u, w| {
            assert_eq!(v, visited);
            visited += 1;
            let (expected, turn) = (case.shape(v, law).0, case.combined(v, &case.q).1);
            assert!(
                (u - expected).norm() <= tolerance::<E>() * 10.0,
                "{name}, {law:?}, vertex {v}: {u:?} {expected:?}"
            );
            assert!((w - turn).norm() <= tolerance::<E>() * 10.0, "{name}, {law:?}, vertex {v}: {w:?} {turn:?}");
        });
        assert_eq!(visited, case.rest.len());
        modal_force::visit_motion(&basis, law, (&case.q, &case.q_dot), |v, _, rate| {
            let (_, by_y, by_w) = case.shape(v, law);
            let expected = case.velocity(v, (&by_y, &by_w));
            let size = 10.0 + expected.norm();
            assert!((rate - expected).norm() <= tolerance::<E>() * size, "{name}, {law:?}, vertex {v}: {rate:?}");
        });
    }
}

#[test]
fn displacements_and_rates_match_a_plain_loop_in_every_kind_of_register() {
    for case in cases() {
        for (name, arch) in kinds() {
            check_motion::<f32>(&case, name, arch);
            check_motion::<f64>(&case, name, arch);
            check_motion::<I16>(&case, name, arch);
        }
    }
}

/// All rows of one call, in order and without gaps.
fn rows<F: Copy>(visit: impl FnOnce(&mut dyn FnMut(usize, &[[F; 3]]))) -> Vec<[F; 3]> {
    let mut all = vec![];
    visit(&mut |first, rows| {
        assert_eq!(first, all.len());
        all.extend_from_slice(rows);
    });
    all
}

fn check_positions<E: Entry>(case: &Case, name: &str, arch: Arch) {
    let case = &case.as_stored::<E>();
    let basis = case.basis::<E>(arch);
    let rotation = *case.pose.rotation.to_rotation_matrix().matrix();
    let placements = [
        Placement { origin: Vec3::zeros(), rotation: None },
        Placement { origin: case.pose.origin, rotation: Some(rotation) },
    ];
    for (law, placement) in LAWS.iter().flat_map(|law| placements.iter().map(move |placement| (*law, placement))) {
        let amplitudes = Amplitudes { q: &case.q, warped: law.warped() };
        let double = || rows(|write| warp::visit_positions_f64(&basis, amplitudes, (&case.rest, placement), write));
        let single = || rows(|write| warp::visit_positions_f32(&basis, amplitudes, placement, write));
        let (wide, narrow) = (double(), single());
        assert_eq!((double(), single()), (wide.clone(), narrow.clone()), "{name}: the same bits");
        assert_eq!((wide.len(), narrow.len()), (case.rest.len(), case.rest.len()));
        // f64 rows are what displacements and rest positions give, to the bit.
        visit_displacements(&basis, law.warped(), &case.q, |v, u, _| {
            let local = case.rest[v] + u;
            let expected = placement.origin + placement.rotation.map_or(local, |rotation| rotation * local);
            assert_eq!(Vec3::from(wide[v]), expected, "{name}, {law:?}, vertex {v}");
            let largest = [case.rest[v].amax(), u.amax(), placement.origin.amax(), expected.amax()].into_iter();
            // The promise of `State::position_rows_f32`; an ulp is at most 2⁻²³ of its number.
            let ulp = largest.fold(0.0, f64::max) * 2f64.powi(-23);
            for c in 0..3 {
                let error = (f64::from(narrow[v][c]) - expected[c]).abs();
                assert!(error <= 4.0 * ulp, "{name}, {law:?}, vertex {v}: {} ulp", error / ulp);
            }
        });
    }
}

#[test]
fn positions_are_rest_and_displacement_placed_in_every_kind_of_register() {
    for case in cases() {
        for (name, arch) in kinds() {
            check_positions::<f32>(&case, name, arch);
            check_positions::<f64>(&case, name, arch);
            check_positions::<I16>(&case, name, arch);
        }
    }
}

/// All that sweeps give, one number after the other.
fn swept<E: Entry>(case: &Case, arch: Arch, fused: bool) -> Vec<f64> {
    let mut basis = case.basis::<E>(arch);
    basis.fused = fused;
    let (mut out, modes) = (vec![], case.q.len());
    for law in LAWS {
        for (_, load, external) in &loads(case) {
            let external = external.then_some(&case.external[..]);
            let acting = Acting { load, external, law, q: &case.q, q_dot: &case.q_dot, total_mass: 1.0 };
            let mut force = vec![f64::NAN; modes];
            let pull = modal_force::project(&basis, &acting, &mut Scratch::new(modes), &mut force);
            out.extend(force.into_iter().chain([pull.body, pull.external]));
        }
        let amplitudes = Amplitudes { q: &case.q, warped: law.warped() };
        let placement =
            Placement { origin: case.pose.origin, rotation: Some(*case.pose.rotation.to_rotation_matrix().matrix()) };
        let wide = rows(|write| warp::visit_positions_f64(&basis, amplitudes, (&case.rest, &placement), write));
        let narrow = rows(|write| warp::visit_positions_f32(&basis, amplitudes, &placement, write));
        out.extend(wide.into_iter().flatten().chain(narrow.into_iter().flatten().map(f64::from)));
        modal_force::visit_motion(&basis, law, (&case.q, &case.q_dot), |_, u, rate| out.extend(u.iter().chain(&rate)));
    }
    warp::visit_turns(&basis, &case.q, |_, w| out.extend(w.iter()));
    out
}

#[test]
fn without_fused_multiply_add_every_kind_of_register_gives_the_same_bits() {
    for case in cases() {
        for (name, arch) in kinds() {
            assert!(swept::<f32>(&case, arch, false) == swept::<f32>(&case, Arch::Scalar, true), "{name}, f32");
            assert!(swept::<f64>(&case, arch, false) == swept::<f64>(&case, Arch::Scalar, true), "{name}, f64");
            assert!(swept::<I16>(&case, arch, false) == swept::<I16>(&case, Arch::Scalar, true), "{name}, 16 bits");
        }
    }
}

fn check_extent<E: Entry>(case: &Case, name: &str, arch: Arch) {
    let case = &case.as_stored::<E>();
    let basis = case.basis::<E>(arch);
    for warped in [false, true] {
        let (mut displacement, mut rotation, mut beyond) = (0.0f64, 0.0f64, 0);
        visit_displacements(&basis, warped, &case.q, |_, u, w| {
            displacement = displacement.max(u.norm_squared());
            rotation = rotation.max(w.norm_squared());
            beyond += usize::from(w.norm_squared() > 1.0);
        });
        let extent = warp::extent(&basis, Amplitudes { q: &case.q, warped }, 1.0);
        assert_eq!((extent.displacement, extent.rotation, extent.beyond), (displacement, rotation, beyond), "{name}");
    }
}

#[test]
fn the_extent_is_that_of_the_displacements_in_every_kind_of_register() {
    for case in cases() {
        for (name, arch) in kinds() {
            check_extent::<f32>(&case, name, arch);
            check_extent::<f64>(&case, name, arch);
            check_extent::<I16>(&case, name, arch);
        }
    }
}

fn check_rounding<E: Entry>(case: &Case) {
    let basis = case.basis::<E>(Arch::Scalar);
    for (k, (phi, psi)) in case.modes.iter().enumerate() {
        let largest = |field: &[Vec3]| field.iter().map(|x| x.amax()).fold(0.0, f64::max);
        for v in 0..case.rest.len() {
            let (stored, turn) = basis.at(k, v);
            for (error, largest) in [((stored - phi[v]).amax(), largest(phi)), ((turn - psi[v]).amax(), largest(psi))] {
                // The bound is met in full half way between two steps, where the units' own rounding shows.
                assert!(
                    error <= E::ROUNDING * largest * (1.0 + 1e-9),
                    "mode {k}, vertex {v}: {error:e} of {largest:e}"
                );
            }
        }
    }
}

#[test]
fn stored_shapes_are_within_the_rounding_that_is_told() {
    for case in cases() {
        check_rounding::<f32>(&case);
        check_rounding::<f64>(&case);
        check_rounding::<I16>(&case);
    }
}

#[test]
fn the_widest_registers_are_the_default() {
    let case = Case::new(3, 1, 0);
    let (widest, _) = kinds().pop().unwrap();
    let named = match case.basis::<f32>(Arch::new()).arch {
        Arch::Scalar => "scalar",
        #[cfg(target_arch = "x86_64")]
        Arch::V3(_) => "AVX2",
        #[cfg(target_arch = "x86_64")]
        Arch::V4(_) => "AVX-512",
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(_) => "NEON",
        _ => "another",
    };
    assert_eq!(named, widest);
}

/// E, Bᵀ∇E, BᵀHB and the viscosity at `q`, by plain sums over the shell's elements, all of weight 1.
fn plainly(shell: &Shell, fields: &[Vec<Vec3>], q: &[f64]) -> (f64, DVector<f64>, DMatrix<f64>, DMatrix<f64>) {
    let n = q.len();
    let x: Vec<Vec3> = (0..shell.mass.len())
        .map(|v| shell.mesh.positions[v] + (0..n).map(|k| q[k] * fields[k][v]).sum::<Vec3>())
        .collect();
    let mut nodal = vec![Vec3::zeros(); x.len()];
    shell.energy.add_gradient(&x, &mut nodal);
    let gradient = DVector::from_fn(n, |k, _| fields[k].iter().zip(&nodal).map(|(b, g)| b.dot(g)).sum());
    let (mut hessian, mut viscosity) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    shell.energy.visit_hessian(&x, Curvature::Exact, &mut |(vertices, blocks)| {
        for (i, a) in vertices.iter().enumerate() {
            for (j, b) in vertices.iter().enumerate() {
                let block = blocks[i * vertices.len() + j];
                hessian += DMatrix::from_fn(n, n, |k, l| fields[k][*a as usize].dot(&(block * fields[l][*b as usize])));
            }
        }
    });
    shell.energy.visit_rows(&x, &mut |(vertices, row)| {
        let along = |field: &Vec<Vec3>| vertices.iter().zip(row).map(|(v, b)| field[*v as usize].dot(b)).sum::<f64>();
        let line = DVector::from_iterator(n, fields.iter().map(along));
        viscosity += &line * line.transpose();
    });
    (shell.energy.value(&x), gradient, hessian, viscosity)
}

/// On 3 to 17 fields: less and more than the widest register holds. With stress fields that know all, as with none, the energy is the
/// plain one.
#[test]
fn reduced_energies_match_plain_sums_in_every_kind_of_register() {
    let (positions, triangles) = equilateral_sheet(5, 4, 0.3);
    let bent = positions.iter().map(|x| Vec3::new(x.x, x.y, 0.2 * x.x * x.x)).collect();
    let mesh = Mesh::new(bent, &triangles).unwrap();
    let material = Material { k_area: 100.0, k_length: 50.0, k_bend: 2.0, area_density: 1.0 };
    let shell = Shell::new(mesh, material, &Supports { fixed: vec![0], ..Default::default() }).unwrap();
    let rng = &mut StdRng::seed_from_u64(3);
    for n in [3, 8, 17] {
        let fields: Vec<Vec<Vec3>> =
            (0..n).map(|_| shell.mass.iter().map(|_| 0.05 * random(rng)).collect::<Vec<_>>()).collect();
        let q: Vec<f64> = (0..n).map(|_| rng.random_range(-0.5..0.5)).collect();
        let (value, gradient, hessian, viscosity) = plainly(&shell, &fields, &q);
        let weights = vec![1.0; shell.energy.n_elements()];
        for (name, arch) in kinds() {
            let mut energy = ReducedEnergy::new(&shell, &fields, &weights);
            energy.arch = arch;
            for assumed in [false, true] {
                if assumed {
                    let identity = DMatrix::<f64>::identity(energy.n_membrane(), energy.n_membrane());
                    let row = |e: usize| &identity.as_slice()[e * identity.nrows()..][..identity.nrows()];
                    energy.assume(&weights, row, 0.003);
                }
                let mut scratch = energy.scratch();
                let (mut own, mut matrices) = (DVector::zeros(n), [DMatrix::zeros(n, n), DMatrix::zeros(n, n)]);
                energy.gradient(&q, &mut scratch, own.as_mut_slice());
                energy.hessian(&q, Curvature::Exact, &mut scratch, &mut matrices[0]);
                energy.viscosity(&q, &mut scratch, &mut matrices[1]);
                let told = energy.value(&q, &mut scratch);
                // Sums of some hundred numbers, rounded in another order.
                let off =
                    |a: f64, scale: f64| assert!(a <= 1e-13 * scale, "{name}, {n} fields, {assumed}: {a} of {scale}");
                off((told - value).abs(), value);
                off((&own - &gradient).norm(), gradient.norm());
                off((&matrices[0] - &hessian).norm(), hessian.norm());
                off((&matrices[1] - &viscosity).norm(), viscosity.norm());
                let mut again = energy.scratch();
                assert_eq!(
                    energy.value(&q, &mut again).to_bits(),
                    told.to_bits(),
                    "{name}: other bits the second time"
                );
            }
        }
    }
}

/// E, its gradient and its Hessian of coefficients, term by term.
fn term_by_term(of: &Coefficients, q: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
    let third: DMatrix<f64> = of.cubic.iter().zip(q.iter()).map(|(c, q)| c * *q).sum();
    let value = q.dot(&(&of.bending * q)) / 2.0 + q.dot(&(&third * q)) / 6.0;
    let (mut value, mut gradient) = (value, &of.bending * q + &third * q / 2.0);
    let mut hessian = &of.bending + third;
    for form in &of.forms {
        let slope = DVector::from_column_slice(&form.linear) + &form.quadratic * q;
        let s = DVector::from_column_slice(&form.linear).dot(q) + q.dot(&(&form.quadratic * q)) / 2.0;
        // w φ(s)/2 with φ = s²/(1 + s²/S²), and its derivatives.
        let flat = 1.0 + form.bound * s * s;
        let (stress, curvature) = (form.weight * s / flat.powi(2), form.weight * (4.0 - 3.0 * flat) / flat.powi(3));
        value += form.weight * s * s / flat / 2.0;
        gradient += stress * &slope;
        hessian += stress * &form.quadratic + curvature * &slope * slope.transpose();
    }
    (value, gradient, hessian)
}

/// On 1 to 19 fields and up to 17 forms: rows and forms that fill registers and blocks of four rows, and that do not.
#[test]
fn polynomial_energies_match_plain_sums_in_every_kind_of_register() {
    let rng = &mut StdRng::seed_from_u64(5);
    for (n, forms) in [(1, 1), (3, 0), (8, 8), (13, 17), (19, 9)] {
        let mut number = || rng.random_range(-1.0..1.0);
        let mut symmetric = || {
            let square = DMatrix::from_fn(n, n, |_, _| number());
            &square + square.transpose()
        };
        let [bending, stiffness] = [symmetric(), symmetric()];
        let quadratic: Vec<_> = (0..forms).map(|_| symmetric()).collect();
        let seeds: Vec<f64> = (0..n).map(|_| number()).collect();
        // C₃ of (Σ seed q)³ is symmetric.
        let outer = DVector::from_column_slice(&seeds) * DVector::from_column_slice(&seeds).transpose();
        let form = |(k, quadratic)| Form {
            weight: if k % 3 == 2 { -0.7 } else { 1.0 + k as f64 },
            bound: if k % 3 == 2 { 0.4 } else { 0.0 },
            linear: (0..n).map(|_| number()).collect(),
            quadratic,
        };
        let forms: Vec<Form> = quadratic.into_iter().enumerate().map(form).collect();
        let membrane = forms.len().min(2);
        let cubic = seeds.iter().map(|seed| &outer * *seed).collect();
        // Rounded to the bits that they are held in.
        let coefficients = Coefficients { forms, membrane, bending, stiffness, cubic, engineering: None };
        let coefficients = PolynomialEnergy::new(&coefficients).coefficients();
        let q = DVector::from_fn(n, |_, _| number());
        let (value, gradient, hessian) = term_by_term(&coefficients, &q);
        let firm = Coefficients { forms: coefficients.forms[..membrane].to_vec(), ..coefficients.clone() };
        let resisting = |form: &Form| {
            let slope = DVector::from_column_slice(&form.linear) + &form.quadratic * &q;
            form.weight * &slope * slope.transpose()
        };
        let viscosity = firm.forms.iter().map(resisting).fold(firm.stiffness.clone(), |sum, part| sum + part);
        for (name, arch) in kinds() {
            let mut energy = PolynomialEnergy::new(&coefficients);
            energy.arch = arch;
            let (mut scratch, q) = (energy.scratch(), q.as_slice());
            let (mut own, mut matrices) = (DVector::zeros(n), [DMatrix::zeros(n, n), DMatrix::zeros(n, n)]);
            energy.gradient(q, &mut scratch, own.as_mut_slice());
            energy.hessian(q, Curvature::Exact, &mut scratch, &mut matrices[0]);
            energy.viscosity(q, &mut scratch, &mut matrices[1]);
            let scale = 10.0 + hessian.norm() * (1.0 + q.len() as f64); // terms of either sign, rounded in another order
            let off = |what: &str, a: f64| assert!(a <= 1e-14 * scale, "{name}, {n} fields, {what}: {a} of {scale}");
            off("value", (energy.value(q, &mut scratch) - value).abs());
            off("gradient", (&own - &gradient).norm());
            off("viscosity", (&matrices[1] - &viscosity).norm());
            let off = |what: &str, a: f64| assert!(a <= 1e-6 * scale, "{name}, {n} fields, {what}: {a} of {scale}");
            off("Hessian", (&matrices[0] - &hessian).norm()); // sums of 32 bits, as those below
            energy.near_gradient(q, &mut scratch, own.as_mut_slice());
            let mut near = Factor::new(n, arch);
            energy.near_hessian(q, &mut scratch, &mut near);
            let upper = DMatrix::from_fn(n, n, |i, j| if i <= j { near.entry(i, j) } else { 0.0 });
            off("near gradient", (&own - &gradient).norm());
            let off = |what: &str, a: f64| assert!(a <= 4e-3 * scale, "{name}, {n} fields, {what}: {a} of {scale}");
            off("near Hessian", (upper - hessian.upper_triangle()).norm()); // of Q 8 bits behind the point
        }
    }
}

/// E; its gradient, and that of steps; its Hessian, what resists rates, and the Hessian of steps.
type Evaluated = (f64, [DVector<f64>; 2], [DMatrix<f64>; 3]);

/// Energies with engineering strains: derivatives are those of the value, and all alike in every kind of register.
#[test]
fn engineering_strains_are_alike_in_every_kind_of_register() {
    let rng = &mut StdRng::seed_from_u64(6);
    let (n, count, membrane) = (13, 17, 14);
    let mut number = || rng.random_range(-1.0..1.0);
    let mut symmetric = |size: usize, by: f64| {
        let square = DMatrix::from_fn(size, size, |_, _| by * number());
        &square + square.transpose()
    };
    let [bending, stiffness] = [symmetric(n, 1.0), symmetric(n, 1.0)];
    let form = |k: usize| Form {
        weight: if k < 9 { 1.0 } else { 0.2 },
        bound: 0.0,
        linear: (0..n).map(|i| ((5 * k + i) as f64).sin()).collect(),
        quadratic: DMatrix::from_fn(n, n, |i, j| 0.3 * ((k + i + j) as f64).cos()),
    };
    let softening = std::array::from_fn(|_| SMatrix::from_iterator(symmetric(LEADING, 0.2).iter().copied()));
    let coefficients = Coefficients {
        forms: (0..count).map(form).collect(),
        membrane,
        bending,
        stiffness,
        cubic: vec![DMatrix::zeros(n, n); n],
        engineering: Some(Engineering(softening)),
    };
    let plain = PolynomialEnergy::new(&Coefficients { engineering: None, ..coefficients.clone() });
    let q = DVector::from_fn(n, |k, _| 0.5 * (3.0 * k as f64).cos());
    let mut first: Option<Evaluated> = None;
    for (name, arch) in kinds() {
        let mut energy = PolynomialEnergy::new(&coefficients);
        energy.arch = arch;
        let mut scratch = energy.scratch();
        let all = |energy: &PolynomialEnergy, q: &DVector<f64>, scratch: &mut _| {
            let mut gradients = [DVector::zeros(n), DVector::zeros(n)];
            let mut matrices = [(); 3].map(|()| DMatrix::zeros(n, n));
            energy.gradient(q.as_slice(), scratch, gradients[0].as_mut_slice());
            energy.hessian(q.as_slice(), Curvature::Exact, scratch, &mut matrices[0]);
            energy.viscosity(q.as_slice(), scratch, &mut matrices[1]);
            energy.near_gradient(q.as_slice(), scratch, gradients[1].as_mut_slice());
            let mut near = Factor::new(n, arch);
            energy.near_hessian(q.as_slice(), scratch, &mut near);
            matrices[2] = DMatrix::from_fn(n, n, |i, j| near.entry(i.min(j), i.max(j)));
            (energy.value(q.as_slice(), scratch), gradients, matrices)
        };
        let here = all(&energy, &q, &mut scratch);
        let scale = here.2[0].norm() * (1.0 + q.norm());
        let off = |what: &str, a: f64, most: f64| assert!(a <= most * scale, "{name}, {what}: {a} of {scale}");
        off("near gradient", (&here.1[1] - &here.1[0]).norm(), 1e-6);
        off("near Hessian", (&here.2[2] - &here.2[0]).norm(), 4e-3); // of Q 8 bits behind the point
        match &first {
            Some((value, gradients, matrices)) => {
                off("value", (here.0 - value).abs(), 1e-14);
                off("gradient", (&here.1[0] - &gradients[0]).norm(), 1e-14);
                off("Hessian", (&here.2[0] - &matrices[0]).norm(), 1e-6); // sums of 32 bits
                off("viscosity", (&here.2[1] - &matrices[1]).norm(), 1e-14);
            }
            None => {
                let h = 1e-5;
                for k in 0..n {
                    let at = |sign: f64| DVector::from_fn(n, |j, _| q[j] + if j == k { sign * h } else { 0.0 });
                    let [plus, minus] = [1.0, -1.0].map(|sign| all(&energy, &at(sign), &mut energy.scratch()));
                    off("slope", ((plus.0 - minus.0) / (2.0 * h) - here.1[0][k]).abs(), 1e-9); // h² and rounding by h
                    let curvature = (&plus.1[0] - &minus.1[0]) / (2.0 * h);
                    off("curvature", (curvature - here.2[0].column(k)).norm(), 1e-6); // sums of 32 bits
                }
                let apart = plain.value(q.as_slice(), &mut plain.scratch()) - here.0;
                assert!(apart.abs() > 0.01 * here.0.abs(), "{apart} of {}: the strains are no others", here.0);
                first = Some(here);
            }
        }
    }
}
