//! Triangles that bend, as many at once as the processor's registers hold: to the bits of each alone.
//!
//! Where one of them lets go of its angles, is folded over or is one whose edges have the same vertex beyond, each is evaluated alone.

use super::super::fold_over::fold_over;
use super::super::hinge::wrapped_difference;
use super::super::hinge_lanes::{Corners, LANES, Lanes, Slopes};
use super::super::{ElementHessian, MAX_ELEMENT as MOST, Mat3};
use super::lanes::{Bends, Gradients, Room, SLOTS};
use super::triangle::{Bend, CLAMP, Patch};
use crate::Vec3;
use nalgebra::Vector3;
use pulp::Arch;

/// Stands for an edge that is free: one of two triangles.
const FREE: [Vec3; 4] =
    [Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.5, 1.0, 0.0), Vec3::new(0.5, -1.0, 0.0)];

/// Some of the triangles in a shape.
pub struct Few<'a> {
    patches: &'a [Patch],
    x: &'a [Vec3],
    /// Of those that are in registers together.
    together: Option<&'a Bent>,
    arch: Arch,
}

/// What they are in registers.
struct Bent {
    bends: Bends,
    /// φ₁φ₂ f(θ − θ̄) by the factor, at the edges of each.
    turns: [Vector3<f64>; LANES],
}

/// Room for what is made in them.
pub struct Rooms {
    gradients: Gradients,
    blocks: Room,
}

impl Rooms {
    pub fn new() -> Self {
        Self { gradients: Gradients::new(), blocks: Room::new() }
    }
}

/// Hands all patches to `visit`, some at a time.
pub fn each_few(patches: &[Patch], x: &[Vec3], mut visit: impl FnMut(Few)) {
    let (arch, mut bent) = (Arch::new(), Bent::new());
    for patches in patches.chunks(LANES) {
        let together = bent.set(patches, x, arch).then_some(&bent);
        visit(Few { patches, x, together, arch });
    }
}

impl Bent {
    fn new() -> Self {
        let bends = Bends {
            corners: [(); 3].map(|()| Corners::new()),
            slopes: [(); 3].map(|()| Slopes::new()),
            factors: [[1.0; LANES]; 3],
        };
        Self { bends, turns: [Vector3::zeros(); LANES] }
    }

    /// To those of some, at most as many as lanes; false where they have to be evaluated alone.
    fn set(&mut self, patches: &[Patch], x: &[Vec3], arch: Arch) -> bool {
        if patches.iter().any(|patch| patch.slots.is_none()) {
            return false;
        }
        let Self { bends: Bends { corners, slopes, factors }, turns } = self;
        for (k, (corners, slopes)) in corners.iter_mut().zip(slopes.iter_mut()).enumerate() {
            corners.set(patches.iter().map(|patch| match &patch.edges[k] {
                Some(edge) => patch.corners(edge, x),
                None => FREE,
            }));
            corners.find_slopes(arch, slopes);
        }
        for (lane, patch) in patches.iter().enumerate() {
            for (k, edge) in patch.edges.iter().enumerate() {
                let Some(edge) = edge else {
                    turns[lane][k] = 0.0;
                    continue;
                };
                let [sine, cosine] = slopes[k].angle.map(|angle| angle[lane]);
                let [turn, rate, _] = fold_over(wrapped_difference(libm::atan2(sine, cosine), edge.rest_angle));
                let stays = (0..2).all(|side| slopes[k].squared[side][lane] / edge.small[side] >= 1.0);
                if !stays || rate != 1.0 {
                    return false;
                }
                turns[lane][k] = edge.factor * turn;
                factors[k][lane] = edge.factor;
            }
        }
        true
    }

    /// ∂(φ₁φ₂ f) of an edge of one by its corners, by the factor.
    #[inline(always)]
    fn slope(&self, lane: usize, k: usize) -> [Vec3; 4] {
        let ([a, b, c, d], factor) = (self.bends.slopes[k].gradient(lane), self.bends.factors[k][lane]);
        [factor * a, factor * b, factor * c, factor * d]
    }
}

impl Few<'_> {
    /// ε of the elements of each.
    pub fn strains(&self, mut visit: impl FnMut([f64; 3])) {
        for (lane, patch) in self.patches.iter().enumerate() {
            visit(match self.together {
                Some(bent) => patch.strains(&bent.turns[lane]),
                None => patch.strains(&Patch::turns(&patch.bends(self.x))),
            });
        }
    }

    /// Of each its edges' turns, φ₁φ₂ f by the factor, and their slopes.
    pub fn slopes(&self, mut visit: impl FnMut(&Patch, &Vector3<f64>, [[Vec3; 4]; 3])) {
        for (lane, patch) in self.patches.iter().enumerate() {
            if let Some(bent) = self.together {
                visit(patch, &bent.turns[lane], [0, 1, 2].map(|k| bent.slope(lane, k)));
                continue;
            }
            let bends = patch.bends(self.x);
            let slope = |k: usize| {
                let edge = patch.edges[k].as_ref();
                edge.map_or([Vec3::zeros(); 4], |edge| Patch::slope(edge, &bends[k]))
            };
            visit(patch, &Patch::turns(&bends), [0, 1, 2].map(slope));
        }
    }

    /// Of each its elements' strains and their gradients.
    pub fn gradients(&self, rooms: &mut Rooms, mut visit: impl FnMut(&Patch, [f64; 3], &[[Vec3; MOST]; 3])) {
        let Some(bent) = self.together else {
            for patch in self.patches {
                let bends = patch.bends(self.x);
                visit(patch, patch.strains(&Patch::turns(&bends)), &patch.gradients(&bends));
            }
            return;
        };
        self.find_gradients(bent, &mut rooms.gradients);
        let mut own = [[Vec3::zeros(); MOST]; 3];
        for (lane, patch) in self.patches.iter().enumerate() {
            for (slot, place) in patch.places() {
                for (i, own) in own.iter_mut().enumerate().take(patch.kept) {
                    own[place] = rooms.gradients.read(lane, i, slot);
                }
            }
            visit(patch, patch.strains(&bent.turns[lane]), &own);
        }
    }

    /// Hands Σ ∇ε∇εᵀ + σ ∂²ε over the elements of each to `visit`, with σ of those by what their strains are; without σ the first part.
    pub fn hessians(
        &self,
        rooms: &mut Rooms,
        mut stress: Option<impl FnMut(&Patch, &dyn Fn() -> [f64; 3]) -> [f64; 3]>,
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let Some(bent) = self.together else {
            for patch in self.patches {
                let bends = patch.bends(self.x);
                let strains = || patch.strains(&Patch::turns(&bends));
                let stress = stress.as_mut().map(|stress| stress(patch, &strains));
                patch.visit_hessian(&bends, stress, visit);
            }
            return;
        };
        self.find_gradients(bent, &mut rooms.gradients);
        let moments = stress
            .map(|mut stress| self.moments(bent, |lane, patch| stress(patch, &|| patch.strains(&bent.turns[lane]))));
        bent.bends.blocks(self.arch, moments.as_ref(), Some(&rooms.gradients), &mut rooms.blocks);
        self.hand_out(&rooms.blocks, visit);
    }

    /// Hands Σ σ ∂²ε over the elements of each to `visit`.
    pub fn curvatures(
        &self,
        rooms: &mut Rooms,
        mut stress: impl FnMut(&Patch) -> [f64; 3],
        visit: &mut dyn FnMut(ElementHessian),
    ) {
        let Some(bent) = self.together else {
            return self
                .patches
                .iter()
                .for_each(|patch| patch.visit_curvature(&patch.bends(self.x), stress(patch), visit));
        };
        let moments = self.moments(bent, |_, patch| stress(patch));
        bent.bends.blocks(self.arch, Some(&moments), None, &mut rooms.blocks);
        self.hand_out(&rooms.blocks, visit);
    }

    /// A number of each edge of each, by edge.
    fn by_edge(&self, mut of: impl FnMut(usize, &Patch) -> Vector3<f64>) -> [Lanes; 3] {
        let mut lanes = [[0.0; LANES]; 3];
        for (lane, patch) in self.patches.iter().enumerate() {
            let numbers = of(lane, patch);
            for k in (0..3).filter(|k| patch.edges[*k].is_some()) {
                lanes[k][lane] = numbers[k];
            }
        }
        lanes
    }

    /// What stresses of each do at its edges, by the factor.
    fn moments(&self, bent: &Bent, mut stress: impl FnMut(usize, &Patch) -> [f64; 3]) -> [Lanes; 3] {
        self.by_edge(|lane, patch| {
            let moments = patch.moments(stress(lane, patch));
            Vector3::from_fn(|k, _| moments[k] * bent.bends.factors[k][lane])
        })
    }

    /// ∇ε of the elements.
    fn find_gradients(&self, bent: &Bent, out: &mut Gradients) {
        let row = |i: usize| self.by_edge(|_, patch| if i < patch.kept { patch.rows[i] } else { Vector3::zeros() });
        bent.bends.gradients(self.arch, &[row(0), row(1), row(2)], out);
    }

    /// The blocks of each.
    fn hand_out(&self, blocks: &Room, visit: &mut dyn FnMut(ElementHessian)) {
        let mut own = [Mat3::zeros(); MOST * MOST];
        for (lane, patch) in self.patches.iter().enumerate() {
            for (i, row) in patch.places() {
                for (j, column) in patch.places() {
                    own[row * patch.size + column] = blocks.read(lane, [i, j]);
                }
            }
            visit((patch.vertices(), &own[..patch.size * patch.size]));
        }
    }
}

impl Patch {
    /// Slots that are vertices, and their places among them.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        let slots = self.slots.unwrap_or([CLAMP; SLOTS]);
        (0..SLOTS).map(move |slot| (slot, slots[slot] as usize)).filter(|(_, place)| *place != CLAMP as usize)
    }

    /// φ₁φ₂ f at the edges, by the factor.
    fn turns(bends: &[Bend; 3]) -> Vector3<f64> {
        Vector3::from_fn(|k, _| bends[k].share * bends[k].turn[0])
    }
}

#[cfg(test)]
mod tests {
    use super::super::BendingEnergy;
    use super::*;
    use crate::Mesh;
    use crate::energy::{Curvature, Energy, Stress};
    use nalgebra::Matrix3;

    /// A bent sheet of 6 by 5 quads, clamped at a side, and so with triangles that have no edge, one or two that are free.
    fn sheet() -> (BendingEnergy, Vec<Vec3>) {
        let at = |i: usize, j: usize| Vec3::new(i as f64, j as f64 + 0.1 * libm::sin((3 * i + j) as f64), 0.0);
        let rest = (0..7).flat_map(|i| (0..6).map(move |j| at(i, j))).collect::<Vec<_>>();
        let corners = (0..6u32).flat_map(|i| (0..5u32).map(move |j| 6 * i + j));
        let triangles: Vec<[u32; 3]> = corners.flat_map(|v| [[v, v + 6, v + 7], [v, v + 7, v + 1]]).collect();
        let clamped: Vec<bool> = (0..42).map(|v| v < 6).collect();
        let mesh = Mesh::new(rest.clone(), &triangles).unwrap();
        let law = Matrix3::new(1.0, 0.3, 0.0, 0.0, 0.9, 0.1, 0.0, 0.0, 0.6);
        let bent = |(k, x): (usize, &Vec3)| x + 0.3 * Vec3::from_fn(|c, _| libm::cos((k * k + 7 * c) as f64));
        let x = rest.iter().enumerate().map(bent).collect();
        (BendingEnergy::new(&mesh, &law, &clamped), x)
    }

    /// All that is made of the triangles, with each alone or not.
    fn all(energy: &BendingEnergy, x: &[Vec3]) -> Vec<f64> {
        let (mut out, mut gradient) = (vec![energy.value(x)], vec![Vec3::zeros(); x.len()]);
        energy.add_gradient(x, &mut gradient);
        out.extend(gradient.iter().flat_map(|g| g.iter().copied().collect::<Vec<_>>()));
        energy.visit_strains(x, &mut |(vertices, row), strain| {
            out.push(strain);
            out.extend(vertices.iter().map(|v| f64::from(*v)));
            out.extend(row.iter().flat_map(|b| b.iter().copied().collect::<Vec<_>>()));
        });
        let stress: Vec<f64> = (0..energy.n_elements()).map(|e| libm::sin(e as f64)).collect();
        let mut add = |(vertices, blocks): ElementHessian| {
            out.extend(vertices.iter().map(|v| f64::from(*v)));
            out.extend(blocks.iter().flat_map(|block| block.iter().copied().collect::<Vec<_>>()));
        };
        energy.visit_hessian(x, Curvature::Exact, &mut add);
        energy.visit_hessian(x, Curvature::Semidefinite, &mut add);
        energy.visit_mixed_hessian(x, Stress { of: &stress, share: 0.7 }, &mut add);
        energy.visit_stress_hessian(x, &stress, Curvature::Exact, &mut add);
        out
    }

    #[test]
    fn triangles_together_have_the_bits_of_each_alone() {
        let (energy, x) = sheet();
        let weights: Vec<f64> =
            (0..energy.n_elements()).map(|e| if e % 5 < 3 { 1.0 + e as f64 } else { 0.0 }).collect();
        let index: Vec<u32> = (0..x.len() as u32).collect();
        let some = energy.patches.len().div_ceil(LANES);
        let mut together = 0;
        each_few(&energy.patches, &x, |few| together += usize::from(few.together.is_some()));
        assert!(together + 1 >= some, "{together} of {some}");
        for sampled in [false, true] {
            let own = |mut energy: BendingEnergy| {
                energy.patches.iter_mut().for_each(|patch| patch.slots = None);
                energy
            };
            let of = || if sampled { energy.sample(&weights, &index) } else { sheet().0 };
            let (together, alone) = (all(&of(), &x), all(&own(of()), &x));
            assert!(together.len() > 10_000 || sampled && together.len() > 5000, "{}", together.len());
            assert_eq!(together, alone); // but for the sign of zeros
        }
    }
}
