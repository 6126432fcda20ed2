//! A pose given from outside, by the positions of all vertices.

use super::{Space, State};
use crate::error::try_zeroed;
use crate::{Error, Result, Vec3, wide_norm};

/// A vertex further from rest than this, in model sizes, or as much faster in a second, is no pose.
const FURTHEST: f64 = 1e6;
const FASTEST: f64 = 1e15;

impl State {
    /// Takes the motion nearest to positions and velocities (n_vertices; without velocities: at rest in the frame) in the mass norm,
    /// with the same time, frame, loads, damping and constraints. Returns how far the vertices are from where they were to be: the
    /// root of the mean square, weighted by mass. Changes nothing on failure. Allocates.
    pub fn set_pose(&mut self, space: Space, x: &[Vec3], velocity: Option<&[Vec3]>) -> Result<f64> {
        self.refuse_moving_rest("a pose")?;
        let n = self.model.shell.mass.len();
        check("positions", x, n)?;
        velocity.map_or(Ok(()), |velocity| check("velocities", velocity, n))?;
        let (mut u, mut rate): (Vec<Vec3>, Vec<Vec3>) = (try_zeroed("the pose", n)?, try_zeroed("the rates", n)?);
        let size = self.model.shell.mesh.size;
        for v in 0..n {
            (u[v], rate[v]) = self.motion_in_frame(space, v, &x[v], velocity.map(|velocity| &velocity[v]));
            // A difference that overflows is not within either.
            let [near, slow] = [wide_norm(&u[v]) <= FURTHEST * size, wide_norm(&rate[v]) <= FASTEST * size];
            if !near {
                return Err(refused(
                    "positions",
                    v,
                    &x[v],
                    &format!("beyond {FURTHEST:e} sizes of the mesh, {size:?}"),
                ));
            }
            if !slow {
                let why = format!("beyond {FASTEST:e} sizes of the mesh, {size:?}, a second");
                return Err(refused("velocities", v, &velocity.map_or(rate[v], |velocity| velocity[v]), &why));
            }
        }
        self.motion.project_from(&u, &rate)?;
        self.forget_past();
        self.rest.wake();
        let (shell, mut square) = (&self.model.shell, 0.0);
        let add = |v: usize, now: Vec3| square += shell.mass[v] * (now - shell.mesh.positions[v] - u[v]).norm_squared();
        self.positions(Space::Frame, add);
        Ok((square / shell.total_mass).sqrt())
    }

    /// Displacement and rate of vertex `v` in the frame.
    fn motion_in_frame(&self, space: Space, v: usize, x: &Vec3, velocity: Option<&Vec3>) -> (Vec3, Vec3) {
        let rest = self.model.shell.mesh.positions[v];
        let (pose, rates) = (&self.frame.pose, &self.rates);
        match space {
            Space::Frame => (x - rest, velocity.copied().unwrap_or_default() / self.tempo.root),
            Space::World => {
                let arm = x - pose.origin;
                let carried = rates.velocity + rates.angular_velocity.cross(&arm);
                let rate = velocity.map(|velocity| pose.rotation.inverse() * (velocity / self.tempo.root - carried));
                (pose.rotation.inverse() * arm - rest, rate.unwrap_or_default())
            }
        }
    }
}

fn check(name: &str, given: &[Vec3], n: usize) -> Result<()> {
    if given.len() != n {
        return Err(Error::argument(format!("{} {name} for {n} vertices", given.len())));
    }
    match given.iter().position(|x| !x.iter().all(|c| c.is_finite())) {
        Some(v) => Err(refused(name, v, &given[v], "not finite")),
        None => Ok(()),
    }
}

fn refused(name: &str, v: usize, given: &Vec3, why: &str) -> Error {
    Error::argument(format!("{name}[{v}] is ({:?}, {:?}, {:?}): {why}", given.x, given.y, given.z))
}
