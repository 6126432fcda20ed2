//! Positions from deformation gradients: the field whose gradient on every triangle is nearest to a given one, Σ A |∇u − D|²
//! least, with the supports where they are. The cotangent Laplacian is factorized once (Huang, Tong, Zhou, Bao 2011, section 4).

use crate::error::try_zeroed;
use crate::mesh::NONE;
use crate::sparse::{Factor, Symbolic};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::MatMut;
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use nalgebra::Matrix3;

/// What a triangle needs for gradients.
pub struct Face {
    /// Gradients of the three hat functions.
    pub slopes: [Vec3; 3],
    /// Unit normal.
    pub normal: Vec3,
    /// Rest area.
    pub area: f64,
}

impl Face {
    /// Of corners at rest.
    fn new([a, b, c]: [Vec3; 3]) -> Self {
        let twice = (b - a).cross(&(c - a));
        let normal = twice.normalize();
        // ∇B of a corner: across the opposite side, one over the height.
        let slope = |from: Vec3, to: Vec3| normal.cross(&(to - from)) / twice.norm();
        Self { slopes: [slope(b, c), slope(c, a), slope(a, b)], normal, area: 0.5 * twice.norm() }
    }

    /// G of displacements at the corners: with the normal's linear turn and no strain across the shell.
    pub fn gradient(&self, u: [Vec3; 3]) -> Matrix3<f64> {
        let plane: Matrix3<f64> = u.iter().zip(&self.slopes).map(|(u, slope)| u * slope.transpose()).sum();
        plane - plane.tr_mul(&self.normal) * self.normal.transpose()
    }
}

/// See the module's text.
pub struct Poisson {
    /// Of each triangle.
    pub faces: Vec<Face>,
    symbolic: Symbolic,
    factor: Factor,
    /// Row of each vertex, [`NONE`] for one that is held, unreferenced, or stands for its component's place (n_vertices).
    row: Vec<u32>,
    n_rows: usize,
    /// Components that nothing holds: their place is that of no mean displacement.
    afloat: Vec<bool>,
}

impl Poisson {
    /// Factorizes the Laplacian of the shell's rest shape.
    pub fn new(shell: &Shell) -> Result<Self> {
        let mesh = &shell.mesh;
        let faces: Vec<Face> =
            mesh.triangles.iter().map(|t| Face::new(t.map(|v| mesh.positions[v as usize]))).collect();
        let mut afloat = vec![true; mesh.n_components];
        let component = |v: usize| mesh.component[v] as usize;
        (0..shell.held.len()).filter(|v| shell.held[*v] && mesh.component[*v] != NONE).for_each(|v| {
            afloat[component(v)] = false;
        });
        let mut to_pin = afloat.clone();
        let (mut row, mut n_rows) = (vec![NONE; shell.mass.len()], 0);
        for &v in &shell.free {
            if !std::mem::take(&mut to_pin[component(v as usize)]) {
                row[v as usize] = n_rows;
                n_rows += 1;
            }
        }
        let n_rows = n_rows as usize;
        let lower = laplacian(shell, &faces, &row, n_rows);
        let symbolic = Symbolic::analyse_scalar(lower.symbolic())?;
        let mut factor = symbolic.factor()?;
        if !symbolic.refactorize(&lower, &mut factor)? {
            let message = "the Laplacian of the mesh is not positive definite to rounding: its triangles are too thin";
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        Ok(Self { faces, symbolic, factor, row, n_rows, afloat })
    }

    /// `n` fields b with which u = N b is the displacement whose gradient on each triangle is nearest to weight · N, for any matrix
    /// N: `weights` sets those of a triangle (n), asked for in order.
    pub fn solve(&self, shell: &Shell, n: usize, mut weights: impl FnMut(usize, &mut [f64])) -> Result<Vec<Vec<Vec3>>> {
        let mut right: Vec<f64> = try_zeroed("the rotation-strain fields", self.n_rows * 3 * n)?;
        let mut of_face = vec![0.0; n];
        for (t, face) in self.faces.iter().enumerate() {
            weights(t, &mut of_face);
            for (v, slope) in shell.mesh.triangles[t].iter().zip(&face.slopes) {
                let row = self.row[*v as usize] as usize;
                for (k, weight) in of_face.iter().enumerate().filter(|_| row != NONE as usize) {
                    for c in 0..3 {
                        right[(3 * k + c) * self.n_rows + row] += weight * face.area * slope[c];
                    }
                }
            }
        }
        self.solve_columns(shell, right, n)
    }

    /// The displacement whose triangles have the gradients exp\[ω\]× (I + S) − I, where `linear` (n_vertices) has G: the
    /// reconstruction itself, without samples.
    pub fn reconstruct(&self, shell: &Shell, linear: &[Vec3]) -> Result<Vec<Vec3>> {
        let mut right = vec![0.0; self.n_rows * 3];
        for (t, face) in shell.mesh.triangles.iter().zip(&self.faces) {
            let remainder = super::sample::remainder(&face.gradient(t.map(|v| linear[v as usize])));
            for (v, slope) in t.iter().zip(&face.slopes).filter(|(v, _)| self.row[**v as usize] != NONE) {
                let pull = remainder * slope * face.area;
                (0..3).for_each(|c| right[c * self.n_rows + self.row[*v as usize] as usize] += pull[c]);
            }
        }
        let beyond = self.solve_columns(shell, right, 1)?.swap_remove(0);
        Ok(linear.iter().zip(&beyond).map(|(u, more)| u + more).collect())
    }

    /// `count` vector fields (n_vertices) from their right-hand sides, column by column: x, y and z of each.
    fn solve_columns(&self, shell: &Shell, mut right: Vec<f64>, count: usize) -> Result<Vec<Vec<Vec3>>> {
        let n = self.n_rows;
        if n > 0 {
            self.symbolic
                .solve_in_place(&self.factor, MatMut::from_column_major_slice_mut(&mut right, n, 3 * count))?;
        }
        let field = |k: usize| -> Vec<Vec3> {
            let at = |c: usize, row: u32| if row == NONE { 0.0 } else { right[(3 * k + c) * n + row as usize] };
            self.row.iter().map(|row| Vec3::from_fn(|c, _| at(c, *row))).collect()
        };
        let mut fields: Vec<Vec<Vec3>> = (0..count).map(field).collect();
        fields.iter_mut().for_each(|field| self.center(shell, field));
        Ok(fields)
    }

    /// Moves each component that nothing holds so that its mean displacement, by mass, is zero.
    fn center(&self, shell: &Shell, field: &mut [Vec3]) {
        let mut sums = vec![(Vec3::zeros(), 0.0); self.afloat.len()];
        let moves = |v: usize| Some(shell.mesh.component[v]).filter(|c| *c != NONE && self.afloat[*c as usize]);
        for v in 0..field.len() {
            if let Some(c) = moves(v) {
                sums[c as usize].0 += shell.mass[v] * field[v];
                sums[c as usize].1 += shell.mass[v];
            }
        }
        for v in 0..field.len() {
            if let Some(c) = moves(v) {
                field[v] -= sums[c as usize].0 / sums[c as usize].1;
            }
        }
    }
}

/// Σ A ∇B_i·∇B_j over the triangles, the lower triangle of it.
fn laplacian(shell: &Shell, faces: &[Face], row: &[u32], n: usize) -> SparseColMat<usize, f64> {
    let mut columns: Vec<Vec<(usize, f64)>> = (0..n).map(|j| vec![(j, 0.0)]).collect();
    for (t, face) in shell.mesh.triangles.iter().zip(faces) {
        for (v, b) in t.iter().zip(&face.slopes) {
            for (w, d) in t.iter().zip(&face.slopes) {
                let (j, i) = (row[*v as usize], row[*w as usize]);
                if j != NONE && i != NONE && j <= i {
                    let column = &mut columns[j as usize];
                    let value = face.area * b.dot(d);
                    match column.iter_mut().find(|entry| entry.0 == i as usize) {
                        Some(entry) => entry.1 += value,
                        None => column.push((i as usize, value)),
                    }
                }
            }
        }
    }
    columns.iter_mut().for_each(|column| column.sort_unstable_by_key(|entry| entry.0));
    let mut start = vec![0];
    columns.iter().for_each(|column| start.push(start[start.len() - 1] + column.len()));
    let (rows, values) = columns.into_iter().flatten().unzip();
    SparseColMat::new(SymbolicSparseColMat::new_checked(n, n, start, None, rows), values)
}
