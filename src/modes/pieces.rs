//! The problem in pieces: what no element couples is solved apart.
//!
//! A block-diagonal A has the modes of its blocks. A piece is the free vertices of a block with all that holds them, a shell of its own,
//! and costs what that shell costs, however many others are alike: solved whole, equal shells are one eigenvalue of a multiplicity that
//! no Krylov space holds. Each piece is measured by its own ‖A‖, so that a shell beside one a ten thousandth of its size keeps its digits.

use super::merge::end_of_wanted;
use super::{Progress, ScaledStiffness, Solution, rigid_freedoms};
use crate::mesh::{Edge, Mesh, NONE, UnionFind};
use crate::{Error, ErrorKind, Result, Shell, Vec3};

/// Vertices that elements couple.
pub struct Piece {
    /// Which of the shell's free vertices, ascending.
    pub free: Vec<u32>,
    /// Those that touch them.
    triangles: Vec<u32>,
    /// Those that they are on, or across.
    edges: Vec<u32>,
}

impl Piece {
    /// The pieces of a shell with this stiffness, in order of their lowest vertex.
    pub fn split(shell: &Shell, stiffness: &ScaledStiffness) -> Vec<Self> {
        let n = shell.free.len();
        let mut sets = UnionFind::new(n);
        for j in 0..n {
            // Column 3j begins with the three rows of its own block.
            let below = &stiffness.lower.symbolic().row_idx_of_col_raw(3 * j)[3..];
            below.iter().step_by(3).for_each(|i| sets.join(j as u32, (i / 3) as u32));
        }
        let mut number = vec![NONE; n];
        let mut piece_of = vec![NONE; shell.mass.len()];
        let mut pieces: Vec<Self> = vec![];
        for k in 0..n {
            let root = sets.find(k as u32) as usize;
            if number[root] == NONE {
                number[root] = pieces.len() as u32;
                pieces.push(Self { free: vec![], triangles: vec![], edges: vec![] });
            }
            piece_of[shell.free[k] as usize] = number[root];
            pieces[number[root] as usize].free.push(k as u32);
        }
        if !shell.is_told_by_pieces() {
            return Self::within_components(shell, pieces);
        }
        for (t, corners) in shell.mesh.triangles.iter().enumerate() {
            of_each(&piece_of, corners, |piece| pieces[piece].triangles.push(t as u32));
        }
        for (e, edge) in shell.mesh.edges.iter().enumerate() {
            of_each(&piece_of, &around(edge), |piece| pieces[piece].edges.push(e as u32));
        }
        pieces
    }

    /// Each with all of its component, of an energy whose elements reach beyond an edge and its triangles.
    fn within_components(shell: &Shell, mut pieces: Vec<Self>) -> Vec<Self> {
        let mesh = &shell.mesh;
        let mut whole: Vec<(Vec<u32>, Vec<u32>)> = vec![Default::default(); mesh.n_components];
        let component = |v: u32| mesh.component[v as usize] as usize;
        (0..mesh.triangles.len()).for_each(|t| whole[component(mesh.triangles[t][0])].0.push(t as u32));
        (0..mesh.edges.len()).for_each(|e| whole[component(mesh.edges[e].vertices[0])].1.push(e as u32));
        for piece in &mut pieces {
            let first = shell.free[piece.free[0] as usize];
            (piece.triangles, piece.edges) = whole[component(first)].clone();
        }
        pieces
    }

    /// Number of unknowns.
    pub fn n_unknowns(&self) -> usize {
        3 * self.free.len()
    }

    /// Number of those that move.
    fn n_freedoms(&self, shell: &Shell) -> usize {
        let held = |k: &u32| shell.roller_of(shell.free[*k as usize]).map_or(0, |roller| roller.held as usize);
        self.n_unknowns() - if shell.rollers.is_empty() { 0 } else { self.free.iter().map(held).sum() }
    }

    /// The piece alone, held where it meets what is held.
    fn shell(&self, whole: &Shell) -> Shell {
        let mesh = &whole.mesh;
        let triangles = self.triangles.iter().map(|t| mesh.triangles[*t as usize]);
        let edges = self.edges.iter().map(|e| mesh.edges[*e as usize]);
        let corners = edges.clone().flat_map(|edge| around(&edge)).filter(|v| *v != NONE);
        let mut vertices: Vec<u32> = triangles.clone().flatten().chain(corners).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let index = |v: u32| if v == NONE { NONE } else { vertices.partition_point(|other| *other < v) as u32 };
        let positions: Vec<Vec3> = vertices.iter().map(|v| whole.given()[*v as usize]).collect();
        let edge = |e: Edge| Edge { vertices: e.vertices.map(index), opposite: e.opposite.map(index) };
        let free = self.free.iter().map(|k| index(whole.free[*k as usize])).collect();
        let alone = Mesh {
            triangles: triangles.map(|t| t.map(index)).collect(),
            edges: edges.map(edge).collect(),
            component: vec![0; positions.len()],
            n_components: 1,
            n_reoriented: 0,
            n_unreferenced: 0,
            size: mesh.size,
            reach: mesh.reach,
            positions,
        };
        whole.part((&vertices, &self.triangles), alone, free)
    }

    fn solve(&self, whole: &Shell, wanted: usize, progress: &mut Progress) -> Result<Solution> {
        let shell = self.shell(whole);
        let stiffness = ScaledStiffness::assemble(&shell)?;
        Solution::new(&shell, &stiffness, wanted, progress).map_err(|error| match error.kind {
            ErrorKind::Numerical => {
                let first = whole.free[self.free[0] as usize];
                Error::new(error.kind, format!("the piece of vertex {first}: {error}"))
            }
            _ => error,
        })
    }
}

/// The ends of an edge and what is across it; [`NONE`] beyond a boundary.
fn around(edge: &Edge) -> [u32; 4] {
    [edge.vertices[0], edge.vertices[1], edge.opposite[0], edge.opposite[1]]
}

/// Hands each piece that has one of the `vertices` to `visit`, once.
fn of_each(piece_of: &[u32], vertices: &[u32], mut visit: impl FnMut(usize)) {
    let of = |v: &u32| if *v == NONE { NONE } else { piece_of[*v as usize] };
    for (i, piece) in vertices.iter().map(of).enumerate().filter(|(_, piece)| *piece != NONE) {
        if !vertices[..i].iter().any(|v| of(v) == piece) {
            visit(piece as usize);
        }
    }
}

/// So many of each piece's lowest modes that the `wanted` lowest of all are among them, with all that are equal to the last. Pieces are
/// asked for a few first, and for more only where their next could be among those.
pub fn solve(shell: &Shell, pieces: &[Piece], wanted: usize, progress: &mut Progress) -> Result<Vec<Solution>> {
    let most = |i: usize| wanted.min(pieces[i].n_freedoms(shell));
    let mut asked = first_asked(shell, pieces, wanted);
    let mut todo: Vec<usize> = (0..pieces.len()).collect();
    let mut solved: Vec<Solution> = Vec::with_capacity(pieces.len());
    let mut done = 0.0;
    while !todo.is_empty() {
        // Each round is half of what is left to be told.
        let unit = 0.5 * (1.0 - done) / todo.iter().map(|i| pieces[*i].n_unknowns() as f64).sum::<f64>();
        for &i in &todo {
            let share = done..done + unit * pieces[i].n_unknowns() as f64;
            done = share.end;
            let found = progress.within(share, |progress| pieces[i].solve(shell, asked[i], progress))?;
            match solved.get_mut(i) {
                Some(fewer) => *fewer = found,
                None => solved.push(found), // the first round takes them in order
            }
        }
        let end = end_of_wanted(&solved, wanted);
        todo = (0..pieces.len()).filter(|i| asked[*i] < most(*i) && solved[*i].shift <= end).collect();
        todo.iter().for_each(|i| asked[*i] = (2 * asked[*i] + 2).min(most(*i)));
    }
    Ok(solved)
}

/// The zero modes that are known beforehand and, if these are too few, twice a piece's share of the others: by its size, as alike shells
/// have as many modes below a frequency as they have area.
fn first_asked(shell: &Shell, pieces: &[Piece], wanted: usize) -> Vec<usize> {
    let rigid: Vec<usize> = pieces.iter().map(|piece| rigid_freedoms(&piece.shell(shell)).unwrap_or(0)).collect();
    let elastic = wanted.saturating_sub(rigid.iter().sum());
    let asked = |(piece, rigid): (&Piece, usize)| {
        let share = (2 * elastic * piece.free.len()).div_ceil(shell.free.len()) + 1;
        (rigid + share.min(elastic)).clamp(1, wanted.min(piece.n_freedoms(shell)))
    };
    pieces.iter().zip(rigid).map(asked).collect()
}
