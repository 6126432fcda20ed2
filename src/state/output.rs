//! What a state shows: positions, normals, rotations, and measures.

use super::{Space, State};
use crate::binding::{Binding, Pose as BoundPose};
use crate::error::try_zeroed;
use crate::methods::all_finite;
use crate::support::Pose;
use crate::warp::Placement;
use crate::{Error, ErrorKind, Result, Vec3};
use nalgebra::UnitQuaternion;

/// Measures of the present state.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// Seconds stepped since creation or reset.
    pub time: f64,
    /// ½ q̇ᵀq̇, or ½ u̇ᵀMu̇.
    pub kinetic_energy: f64,
    /// ½ qᵀΛq, or E(x).
    pub elastic_energy: f64,
    /// Work done on the shell by constraints since creation or reset.
    pub constraint_work: f64,
    /// Largest |w|, rad.
    pub max_rotation: f64,
    /// Largest |u| in the frame.
    pub max_displacement: f64,
    /// Of all vertices, the share that is turned beyond [`super::ROTATION_RANGE`], or half a turn by rotation–strain reconstruction.
    pub fraction_turned_too_far: f64,
    /// Steps of a reduced shell since creation or reset whose search ended short of its tolerance.
    pub unconverged_steps: u64,
    /// What the last step of a reduced or full shell got wrong: a root mean square displacement by mass.
    pub step_error: f64,
}

/// What is shown of a shell, by points that are bound to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// Newton steps of the full shell first: [`State::positions_corrected`].
    pub corrections: usize,
    /// Out of the solids: [`State::positions_outside`]. Not both.
    pub outside: bool,
}

/// From the frame outward to a space. See [`State::to_space`].
#[derive(Clone, Copy)]
pub struct Outward {
    placement: Placement,
    velocity: Vec3,
    angular_velocity: Vec3,
}

impl Outward {
    /// Where a position of the frame is.
    pub fn position(&self, x: Vec3) -> Vec3 {
        self.placement.place(x)
    }

    /// Where a direction of the frame points.
    pub fn direction(&self, d: Vec3) -> Vec3 {
        self.placement.rotation.map_or(d, |rotation| rotation * d)
    }

    /// The velocity of what is at `x` in the frame and moves there by `rate`.
    pub fn velocity(&self, x: Vec3, rate: Vec3) -> Vec3 {
        let arm = self.position(x) - self.placement.origin;
        self.velocity + self.angular_velocity.cross(&arm) + self.direction(rate)
    }

    /// A bound of velocities at points and by rates whose coordinates have these.
    pub fn speed(&self, reach: f64, rate: f64) -> f64 {
        let turning = 6.0 * self.angular_velocity.amax() * reach;
        self.velocity.amax() + turning + 2.0 * rate
    }

    /// The largest coordinate of the space's origin.
    pub fn origin(&self) -> f64 {
        self.placement.origin.amax()
    }
}

/// Of the range of a format's numbers: there is no need to look at each vertex within it.
const NEAR: f64 = 1e-8;

impl Report {
    /// Fails with the first measure that is no number.
    pub fn all_finite(self) -> Result<Self> {
        let measures = [
            ("kinetic_energy", self.kinetic_energy),
            ("elastic_energy", self.elastic_energy),
            ("constraint_work", self.constraint_work),
            ("max_rotation", self.max_rotation),
            ("max_displacement", self.max_displacement),
            ("step_error", self.step_error),
        ];
        match measures.iter().find(|(_, value)| !value.is_finite()) {
            None => Ok(self),
            Some((name, value)) => {
                let message = format!("{name} is {value}: the state is beyond the range of numbers");
                Err(Error::new(ErrorKind::Numerical, message))
            }
        }
    }
}

impl State {
    fn rotation_to(&self, space: Space) -> UnitQuaternion<f64> {
        match space {
            Space::World => self.frame.pose.rotation,
            Space::Frame => UnitQuaternion::identity(),
        }
    }

    fn placement(&self, space: Space) -> Placement {
        let Pose { origin, rotation } = match space {
            Space::World => self.frame.pose,
            Space::Frame => Pose::identity(),
        };
        let turned = rotation != UnitQuaternion::identity();
        Placement { origin, rotation: turned.then(|| *rotation.to_rotation_matrix().matrix()) }
    }

    /// Fails with the first vertex that has a coordinate beyond `largest`, in the frame or in `space`. Visits vertices only where the frame, the
    /// mesh or the displacement is far out.
    pub fn check_range(&self, space: Space, largest: f64) -> Result<()> {
        let mesh = &self.model.shell.mesh;
        let far = self.placement(space).origin.amax() + mesh.reach + self.motion.largest_displacement();
        if far <= NEAR * largest && self.moving_rest.is_none() {
            return Ok(());
        }
        let mut stray = None;
        for space in [Space::Frame, space] {
            self.positions(space, |v, x| {
                if stray.is_none() && !x.iter().all(|c| c.abs() <= largest) {
                    stray = Some((v, x));
                }
            });
        }
        let Some((v, x)) = stray else { return Ok(()) };
        let place = format!("vertex {v} is at [{:e}, {:e}, {:e}]", x.x, x.y, x.z);
        let message = format!("{place}, further out than the {largest:e} of this format");
        Err(Error::new(ErrorKind::Numerical, message))
    }

    /// Hands the deformed position of every vertex to `write`, in order.
    pub fn positions(&self, space: Space, mut write: impl FnMut(usize, Vec3)) {
        self.position_rows(space, |first, rows| {
            rows.iter().enumerate().for_each(|(i, row)| write(first + i, Vec3::from(*row)));
        });
    }

    /// Hands the deformed positions of all vertices to `write`, in order: the first vertex of some, and their rows x y z.
    pub fn position_rows(&self, space: Space, mut write: impl FnMut(usize, &[[f64; 3]])) {
        if let Some(place) = self.on_moving_rest(space) {
            return self.motion.positions(&self.placement(Space::Frame), &mut |first, rows| {
                let placed = |(i, row): (usize, &[f64; 3])| (first + i, place(first + i, Vec3::from(*row)).into());
                rows.iter().enumerate().map(placed).for_each(|(v, row)| write(v, &[row]));
            });
        }
        let placement = self.placement(space);
        match &self.supports {
            None => self.motion.positions(&placement, &mut write),
            Some(_) => self.motion.positions(&placement, &mut |first, rows: &[[f64; 3]]| {
                self.write_with_supports((first, rows), |x| placement.place(x).into(), &mut write);
            }),
        }
    }

    /// As [`State::position_rows`], rounded to f32. A modal method on an f32 basis computes them in f32, rest positions, frame
    /// and displacement alike: within four units in the last place of the largest coordinate among these.
    pub fn position_rows_f32(&self, space: Space, mut write: impl FnMut(usize, &[[f32; 3]])) {
        if self.moving_rest.is_some() {
            return self.position_rows(space, |first, rows| {
                rows.iter().enumerate().for_each(|(i, row)| write(first + i, &[row.map(|c| c as f32)]));
            });
        }
        let placement = self.placement(space);
        match &self.supports {
            None => self.motion.positions_f32(&placement, &mut write),
            Some(_) => self.motion.positions_f32(&placement, &mut |first, rows: &[[f32; 3]]| {
                self.write_with_supports((first, rows), |x| placement.place(x).map(|c| c as f32).into(), &mut write);
            }),
        }
    }

    /// Hands the positions of `vertices` alone to `write`, to the bits of [`State::position_rows`]: the place in the list, and
    /// the row. Costs as much as the blocks of 16 vertices that they lie in. Fails on a vertex that does not exist.
    pub fn positions_of(&self, space: Space, vertices: &[u32], mut write: impl FnMut(usize, [f64; 3])) -> Result<()> {
        self.check_vertices(vertices)?;
        if let Some(place) = self.on_moving_rest(space) {
            self.motion.positions_of(&self.placement(Space::Frame), vertices, &mut |i, row| {
                write(i, place(vertices[i] as usize, Vec3::from(row)).into());
            });
            return Ok(());
        }
        let placement = self.placement(space);
        self.motion.positions_of(&placement, vertices, &mut |i, row| {
            write(i, self.support_at(vertices[i] as usize).map_or(row, |x| placement.place(x).into()));
        });
        Ok(())
    }

    /// As [`State::positions_of`], to the bits of [`State::position_rows_f32`].
    pub fn positions_of_f32(
        &self,
        space: Space,
        vertices: &[u32],
        mut write: impl FnMut(usize, [f32; 3]),
    ) -> Result<()> {
        self.check_vertices(vertices)?;
        if self.moving_rest.is_some() {
            return self.positions_of(space, vertices, |i, row| write(i, row.map(|c| c as f32)));
        }
        let placement = self.placement(space);
        self.motion.positions_of_f32(&placement, vertices, &mut |i, row| {
            let exact = |x| placement.place(x).map(|c| c as f32).into();
            write(i, self.support_at(vertices[i] as usize).map_or(row, exact));
        });
        Ok(())
    }

    /// Hands rows on in order, with supports that moved where they are.
    fn write_with_supports<T>(
        &self,
        (first, rows): (usize, &[[T; 3]]),
        row: impl Fn(Vec3) -> [T; 3],
        write: &mut impl FnMut(usize, &[[T; 3]]),
    ) {
        let held = self.supports.as_ref().map_or(&[][..], |supports| &supports.held[..]);
        let below = |end: usize| held.partition_point(|v| (*v as usize) < end);
        let mut done = 0;
        for v in held[below(first)..below(first + rows.len())].iter().map(|v| *v as usize) {
            if v > first + done {
                write(first + done, &rows[done..v - first]);
            }
            self.support_at(v).into_iter().for_each(|x| write(v, &[row(x)]));
            done = v - first + 1;
        }
        if done < rows.len() {
            write(first + done, &rows[done..]);
        }
    }

    fn check_vertices(&self, vertices: &[u32]) -> Result<()> {
        let n = self.model.shell.mass.len();
        match vertices.iter().position(|v| *v as usize >= n) {
            Some(i) => Err(Error::argument(format!("vertices[{i}] is vertex {} of {n}", vertices[i]))),
            None => Ok(()),
        }
    }

    /// Hands the area-weighted unit normal of the deformed shell at every vertex to `write`; zero at unreferenced ones.
    pub fn normals(&self, space: Space, mut write: impl FnMut(usize, Vec3)) -> Result<()> {
        let mut x = try_zeroed("the deformed positions", self.model.shell.mass.len())?;
        self.positions(Space::Frame, |v, position| x[v] = position);
        let rotation = self.rotation_to(space);
        let normals = self.model.shell.mesh.normals(&x);
        all_finite("normal", &normals, |n| n.iter().all(|c| c.is_finite()))?;
        normals.into_iter().enumerate().for_each(|(v, n)| write(v, rotation * n));
        Ok(())
    }

    /// The shell as the points of `binding` see it, in the frame, as it is `shown`; with velocities where these are wanted: those of the motion on what is shown.
    /// Fails on a binding to another mesh. Allocates.
    pub fn bound<'a>(&self, binding: &'a Binding, shown: Shown, velocities: bool) -> Result<BoundPose<'a>> {
        let n = self.model.shell.mass.len();
        if !binding.fits(&self.model.shell) {
            return Err(Error::argument("the points are bound to another mesh than the state's"));
        }
        let x = match shown {
            Shown { outside: true, .. } => self.positions_outside(Space::Frame)?.0,
            Shown { corrections, .. } => self.positions_corrected(Space::Frame, corrections)?,
        };
        if !velocities {
            return binding.pose(x, None);
        }
        let mut rates = try_zeroed("the velocities", n)?;
        self.motion.visit_visible_motion(&mut |v, u, rate| {
            rates[v] = self.rate_on_moving_rest(v, u, rate).unwrap_or(rate);
        });
        if let Some(supports) = &self.supports {
            supports.held.iter().zip(&supports.rates).for_each(|(v, rate)| rates[*v as usize] = *rate);
        }
        rates.iter_mut().for_each(|rate| *rate *= self.tempo.root);
        binding.pose(x, Some(&mut rates))
    }

    /// How positions, directions and velocities in the frame become those of a space.
    pub fn to_space(&self, space: Space) -> Outward {
        let moving = space == Space::World;
        Outward {
            placement: self.placement(space),
            velocity: if moving { self.tempo.root * self.rates.velocity } else { Vec3::zeros() },
            angular_velocity: if moving { self.tempo.root * self.rates.angular_velocity } else { Vec3::zeros() },
        }
    }

    /// Hands the rotation of every vertex's frame to `write`, in world space turned with the support frame: exp \[w\]× with
    /// the modal rotation w, or for a nonlinear shell the mean rotation of the vertex's triangles.
    pub fn rotations(&self, space: Space, mut write: impl FnMut(usize, UnitQuaternion<f64>)) -> Result<()> {
        if self.moving_rest.is_some() {
            let back =
                if space == Space::World { UnitQuaternion::identity() } else { self.frame.pose.rotation.inverse() };
            return self.motion.rotations(UnitQuaternion::identity(), &mut |v, r| {
                write(v, back * self.rest_turn(v).unwrap_or_default() * r);
            });
        }
        self.motion.rotations(self.rotation_to(space), &mut write)
    }

    /// Energies, and how far the shell is bent.
    pub fn report(&self) -> Report {
        let extent = self.motion.extent();
        let (elastic_energy, kinetic_energy) = self.motion.energies();
        Report {
            time: self.time,
            kinetic_energy: self.tempo.factor * kinetic_energy,
            elastic_energy: self.tempo.factor * elastic_energy,
            constraint_work: self.tempo.factor * self.motion.constraints().work,
            max_rotation: extent.rotation.sqrt(),
            max_displacement: extent.displacement.sqrt(),
            fraction_turned_too_far: extent.beyond as f64 / self.model.shell.mass.len() as f64,
            unconverged_steps: self.motion.unconverged_steps(),
            step_error: self.motion.step_error(),
        }
    }

    /// Whether no vertex is turned further than the method's rotations are good for; always for the nonlinear shell. No measure of the
    /// error: see [`State::certify`].
    pub fn turn_in_range(&self, report: &Report) -> bool {
        self.motion.rotation_range().is_none_or(|range| report.max_rotation <= range)
    }
}
