//! Runs of the nonlinear shell, kept in out/report/cache under a hash of all that they depend on, the library's bytes included.

use crate::scenes::{Drive, FRAME, Played, Scene, Setting};
use anyhow::Result;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

pub struct Cache {
    folder: PathBuf,
    library: u64,
}

fn hash_numbers(hasher: &mut DefaultHasher, numbers: impl IntoIterator<Item = f64>) {
    numbers.into_iter().for_each(|x| x.to_bits().hash(hasher));
}

impl Cache {
    /// `fresh` forgets what is there.
    pub fn open(folder: PathBuf, library: &Path, fresh: bool) -> Result<Self> {
        if fresh && folder.exists() {
            std::fs::remove_dir_all(&folder)?;
        }
        std::fs::create_dir_all(&folder)?;
        let mut hasher = DefaultHasher::new();
        std::fs::read(library)?.hash(&mut hasher);
        Ok(Self { folder, library: hasher.finish() })
    }

    fn path(&self, scene: &Scene, setting: &Setting) -> PathBuf {
        let mut hasher = DefaultHasher::new();
        (self.library, scene.key, setting.method.key, setting.coarse, scene.frames).hash(&mut hasher);
        let mesh = scene.mesh_of(setting);
        let material = scene.material_of(setting);
        (&mesh.triangles, (scene.fixed)(mesh)).hash(&mut hasher);
        hash_numbers(&mut hasher, mesh.positions.iter().flatten().copied());
        hash_numbers(&mut hasher, [material.area, material.length, material.bend, material.density]);
        hash_numbers(&mut hasher, scene.gravity.into_iter().chain([scene.damping, setting.steps]));
        for frame in 0..scene.frames {
            let time = frame as f64 * FRAME;
            match scene.drive {
                Drive::Released => {}
                Drive::Shaken(pose) => {
                    let pose = pose(time);
                    hash_numbers(&mut hasher, pose.origin.into_iter().flatten().chain(pose.yaw));
                }
                Drive::Led { vertex, height } => hash_numbers(&mut hasher, [f64::from(vertex), height(time)]),
            }
        }
        self.folder.join(format!("{}_{}_{:016x}.bin", scene.key, setting.method.key, hasher.finish()))
    }

    /// The run from the cache, or from `play`, which is then kept.
    pub fn played(&self, scene: &Scene, setting: &Setting, play: impl FnOnce() -> Result<Played>) -> Result<Played> {
        let path = self.path(scene, setting);
        if let Some(played) = read(&path) {
            return Ok(played);
        }
        let played = play()?;
        write(&path, &played)?;
        Ok(played)
    }
}

fn write(path: &Path, played: &Played) -> Result<()> {
    let part = path.with_extension("part");
    let mut file = std::io::BufWriter::new(std::fs::File::create(&part)?);
    let mut put = |x: f64| file.write_all(&x.to_le_bytes());
    put(played.frames.len() as f64)?;
    for k in 0..played.frames.len() {
        put(played.frames[k].len() as f64)?;
        for x in played.frames[k].iter().flatten().chain(&played.energy[k]).chain([&played.seconds[k]]) {
            put(*x)?;
        }
    }
    file.flush()?;
    std::fs::rename(part, path)?;
    Ok(())
}

/// `None` when there is none or it is cut short.
fn read(path: &Path) -> Option<Played> {
    let mut bytes = vec![];
    std::fs::File::open(path).ok()?.read_to_end(&mut bytes).ok()?;
    let mut numbers = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes")));
    let mut played = Played::default();
    for _ in 0..numbers.next()? as usize {
        let n = numbers.next()? as usize;
        let mut frame = Vec::with_capacity(n);
        for _ in 0..n {
            frame.push([numbers.next()?, numbers.next()?, numbers.next()?]);
        }
        played.frames.push(frame);
        played.energy.push([numbers.next()?, numbers.next()?]);
        played.seconds.push(numbers.next()?);
    }
    Some(played)
}
