//! Forces, tangents and strains of a large shell on several threads.
//!
//! Each part has a range of vertices, and all elements that touch it. It alone sums what is at its vertices, element by element in the order
//! that one thread has for the whole shell: so the bits are the same for any parts. Elements between parts are computed in each.

use super::potential::Potential;
use crate::energy::{Curvature, Energy, RestRow, Stress};
use crate::mesh::NONE;
use crate::sparse::{BlockMatrix, Columns};
use crate::threads::{share_items, sharers};
use crate::{Shell, Vec3};

/// Nanoseconds of an element's part of a tangent, and of a force or strain.
const TANGENT: u64 = 300;
const FORCE: u64 = 60;

/// Vertices of a part, at least.
const LEAST: usize = 400;

/// Parts at most.
const MOST: usize = 32;

/// Elements of all parts, at most, for each of the shell's.
const REPEATED: f64 = 2.0;

/// Vertices in a range with what touches them.
struct Part {
    /// The range, and that of its free vertices in their numbers.
    first: u32,
    end: u32,
    free: [usize; 2],
    /// The vertices of its elements, ascending.
    vertices: Vec<u32>,
    /// Its elements, by the shell's numbers, and their energy.
    elements: Vec<u32>,
    energy: Box<dyn Energy>,
    /// Scratch by vertex and by element.
    x: Vec<Vec3>,
    other: Vec<Vec3>,
    stress: Vec<f64>,
}

/// A shell in parts.
#[derive(Default)]
pub struct Parts {
    parts: Vec<Part>,
    /// For so many threads, and whether it can be taken apart.
    threads: usize,
}

/// Of the elastic energy, by its strains or by stresses in their place.
#[derive(Clone, Copy)]
pub enum ElasticHessian<'a> {
    /// As [`Energy::visit_hessian`].
    Own(Curvature),
    /// As [`Energy::visit_mixed_hessian`].
    Mixed(Stress<'a>),
}

impl Parts {
    /// Bytes held, but for the energies.
    pub fn bytes(&self) -> usize {
        let of = |part: &Part| {
            4 * (part.vertices.len() + part.elements.len())
                + 8 * part.stress.capacity()
                + size_of::<Vec3>() * (part.x.capacity() + part.other.capacity())
        };
        self.parts.iter().map(of).sum()
    }

    /// Makes parts for the threads that would share this work, if they are others than there are; whether there are any.
    fn prepare(&mut self, shell: &Shell, nanoseconds: u64) -> bool {
        let threads = sharers(nanoseconds).min(shell.free.len() / LEAST).min(MOST);
        if threads < 2 {
            return false;
        }
        if self.threads != threads {
            self.threads = threads;
            self.parts = cut(shell, threads).unwrap_or_default();
        }
        !self.parts.is_empty()
    }

    /// The elastic Hessian at `x`, as [`Potential::assemble`] or with stresses as [`Potential::assemble_mixed`];
    /// false, and nothing done, where one thread is to do it.
    pub fn add_hessian(
        &mut self,
        potential: &Potential,
        x: &[Vec3],
        hessian: ElasticHessian,
        matrix: &mut BlockMatrix,
    ) -> bool {
        let (shell, constraints) = (potential.shell, potential.constraints);
        let nanoseconds = TANGENT * shell.energy.n_elements() as u64;
        if !self.prepare(shell, nanoseconds) {
            return false;
        }
        let columns = matrix.columns(self.parts.iter().map(|part| part.free));
        let mut items: Vec<(&mut Part, Columns)> = self.parts.iter_mut().zip(columns).collect();
        share_items(&mut items, nanoseconds, |(part, columns)| {
            part.place(x);
            columns.clear();
            let Part { vertices, energy, elements, x, stress: own, .. } = &mut **part;
            let mut add = |(local, blocks): (&[u32], &[_])| {
                let mut element = [0; crate::energy::MAX_ELEMENT];
                let element = &mut element[..local.len()];
                element.iter_mut().zip(local).for_each(|(v, k)| *v = vertices[*k as usize]);
                constraints.add_blocks((element, blocks), columns);
            };
            match hessian {
                ElasticHessian::Own(curvature) => energy.visit_hessian(x, curvature, &mut add),
                ElasticHessian::Mixed(stress) => {
                    own.clear();
                    own.extend(elements.iter().map(|e| stress.of[*e as usize]));
                    energy.visit_mixed_hessian(x, Stress { of: own, ..stress }, &mut add);
                }
            }
        });
        true
    }

    /// The gradient of the elastic energy with these `stress`es in the place of strains; false, and nothing done, where one thread is to do it.
    pub fn mixed_gradient(&mut self, shell: &Shell, x: &[Vec3], stress: &[f64], gradient: &mut [Vec3]) -> bool {
        self.sum(shell, x, &mut [gradient], &|Part { energy, elements, x, other, .. }| {
            let mut each = elements.iter().map(|e| stress[*e as usize]);
            energy.visit_rows(x, &mut |(vertices, row)| {
                let stress = each.next().unwrap_or(0.0);
                vertices.iter().zip(row).for_each(|(&v, b)| other[v as usize] += stress * b);
            });
        })
    }

    /// The elastic energy's gradient; false, and nothing done, where one thread is to do it.
    pub fn gradient(&mut self, shell: &Shell, x: &[Vec3], gradient: &mut [Vec3]) -> bool {
        self.sum(shell, x, &mut [gradient], &|Part { energy, x, other, .. }| energy.add_gradient(x, other))
    }

    /// Both of these, and the strains for [`Parts::read_strains`]; false, and nothing done, where one thread is to do it.
    pub fn both_gradients(&mut self, shell: &Shell, x: &[Vec3], stress: &[f64], mut both: [&mut [Vec3]; 2]) -> bool {
        self.sum(shell, x, &mut both, &|Part { energy, elements, x, other, stress: strains, .. }| {
            let mut each = elements.iter().map(|e| stress[*e as usize]);
            strains.clear();
            let (own, mixed) = other.split_at_mut(x.len());
            energy.visit_strains(x, &mut |(vertices, row), strain| {
                strains.push(strain);
                add_both((vertices, row), [strain, each.next().unwrap_or(0.0)], [own, mixed]);
            });
        })
    }

    /// What `add` adds to each of some fields at each part's vertices: these are one behind the other in `other`.
    fn sum(&mut self, shell: &Shell, x: &[Vec3], fields: &mut [&mut [Vec3]], add: &(dyn Fn(&mut Part) + Sync)) -> bool {
        let nanoseconds = FORCE * shell.energy.n_elements() as u64;
        if !self.prepare(shell, nanoseconds) {
            return false;
        }
        let mut items = vec![];
        let mut rest: Vec<&mut [Vec3]> = fields.iter_mut().map(|field| &mut **field).collect();
        for part in &mut self.parts {
            let own = rest.iter_mut().map(|rest| {
                let (own, others) = std::mem::take(rest).split_at_mut((part.end - part.first) as usize);
                *rest = others;
                own
            });
            let own: Vec<&mut [Vec3]> = own.collect();
            items.push((part, own));
        }
        share_items(&mut items, nanoseconds, |(part, fields)| {
            part.place(x);
            let n = part.x.len();
            part.other.clear();
            part.other.resize(fields.len() * n, Vec3::zeros());
            add(part);
            for (field, sums) in fields.iter_mut().zip(part.other.chunks_exact(n)) {
                field.fill(Vec3::zeros());
                let own = |v: &u32| (part.first..part.end).contains(v);
                for (v, sum) in part.vertices.iter().zip(sums).filter(|(v, _)| own(v)) {
                    field[(v - part.first) as usize] = *sum;
                }
            }
        });
        true
    }

    /// Finds the strains at `x` and, where there is one, what they gain to first order on the way to `next`, for [`Self::read_strains`]; false,
    /// and nothing done, where one thread is to do it.
    pub fn find_strains(&mut self, shell: &Shell, x: &[Vec3], next: Option<&[Vec3]>) -> bool {
        let nanoseconds = FORCE * shell.energy.n_elements() as u64;
        if !self.prepare(shell, nanoseconds) {
            return false;
        }
        share_items(&mut self.parts, nanoseconds, |part| {
            part.place(x);
            let Part { vertices, energy, x, other, stress, .. } = part;
            stress.clear();
            let Some(next) = next else {
                return energy.visit_strains(x, &mut |_, strain| stress.push(strain));
            };
            other.clear();
            other.extend(vertices.iter().map(|v| next[*v as usize]));
            energy.visit_strains(x, &mut |(vertices, row), strain| {
                let change = |(v, b): (&u32, &Vec3)| b.dot(&(other[*v as usize] - x[*v as usize]));
                stress.push(strain + vertices.iter().zip(row).map(change).sum::<f64>());
            });
        });
        true
    }

    /// Those of the first elements.
    pub fn read_strains(&self, strains: &mut [f64]) {
        let n = strains.len();
        for part in &self.parts {
            let first = part.elements.iter().zip(&part.stress).take_while(|(e, _)| (**e as usize) < n);
            first.for_each(|(e, own)| strains[*e as usize] = *own);
        }
    }
}

impl Part {
    /// Takes its vertices' places.
    fn place(&mut self, x: &[Vec3]) {
        self.x.clear();
        self.x.extend(self.vertices.iter().map(|v| x[*v as usize]));
    }
}

/// Adds the row of an element, times each of two numbers, to one field each.
pub fn add_both((vertices, row): RestRow, [a, b]: [f64; 2], [own, mixed]: [&mut [Vec3]; 2]) {
    for (v, gradient) in vertices.iter().zip(row) {
        own[*v as usize] += a * gradient;
        mixed[*v as usize] += b * gradient;
    }
}

/// So many parts, or none where elements reach too far, where they are more than their vertices tell, or where states change them.
fn cut(shell: &Shell, count: usize) -> Option<Vec<Part>> {
    let energy = &*shell.energy;
    if energy.yielding().is_some() || !shell.bonds.is_empty() || !shell.mirrors.is_empty() {
        return None;
    }
    let n = shell.mass.len() as u32;
    let ends: Vec<u32> = (0..=count).map(|k| if k == count { n } else { edge(shell, k, count) }).collect();
    let part_of = |v: u32| ends.partition_point(|end| *end <= v) - 1;
    let n_elements = energy.n_elements();
    let mut elements: Vec<Vec<u32>> = vec![vec![]; count];
    let mut touched: Vec<Vec<u32>> = vec![vec![]; count];
    let mut e = 0;
    energy.visit_rest_rows(&mut |(vertices, _)| {
        let mut seen = [usize::MAX; crate::energy::MAX_ELEMENT];
        for (k, v) in vertices.iter().enumerate() {
            let part = part_of(*v);
            if !seen.contains(&part) {
                seen[k] = part;
                elements[part].push(e);
                touched[part].extend_from_slice(vertices);
            }
        }
        e += 1;
    });
    if e as usize != n_elements || elements.iter().map(Vec::len).sum::<usize>() as f64 > REPEATED * n_elements as f64 {
        return None;
    }
    let mut index = vec![NONE; n as usize];
    let mut weights = vec![0.0; n_elements];
    let part = |k: usize| {
        let (elements, mut vertices) = (std::mem::take(&mut elements[k]), std::mem::take(&mut touched[k]));
        vertices.sort_unstable();
        vertices.dedup();
        vertices.iter().enumerate().for_each(|(place, v)| index[*v as usize] = place as u32);
        elements.iter().for_each(|e| weights[*e as usize] = 1.0);
        let energy = energy.sampled(&weights, &index);
        vertices.iter().for_each(|v| index[*v as usize] = NONE);
        elements.iter().for_each(|e| weights[*e as usize] = 0.0);
        let (first, end) = (ends[k], ends[k + 1]);
        let free = [first, end].map(|v| shell.free.partition_point(|free| *free < v));
        let whole = energy.n_elements() == elements.len();
        whole.then_some(Part { first, end, free, vertices, elements, energy, x: vec![], other: vec![], stress: vec![] })
    };
    (0..count).map(part).collect()
}

/// Where the k-th part begins: after as many free vertices as its share.
fn edge(shell: &Shell, k: usize, count: usize) -> u32 {
    if k == 0 { 0 } else { shell.free[k * shell.free.len() / count] }
}
