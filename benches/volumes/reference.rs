//! The yardstick: the simplest tracker that one would write. All voxels in one array of f32, trilinear interpolation by three nested loops
//! over the eight neighbours, one majorant for the whole box, an exponentially distributed step for every collision. No roulette, no
//! channels, no boundaries.

use std::path::Path;

use glam::{IVec3, Vec3};
use lanternfish::geometry::Ray;
use lanternfish::math::sampler::Stream;

use super::scene::{MADE_UP, tongues};
use super::track::{Tracked, sum};

pub struct Dense {
    size: [i32; 3],
    /// x slowest, z fastest.
    values: Vec<f32>,
    /// Render space to index space.
    scale: Vec3,
    offset: Vec3,
    largest: f32,
    /// Whether nothing lies more than half a voxel beyond the outer samples, as pbrt's grids have it.
    is_clipped: bool,
}

impl Dense {
    /// The voxels of the fire that `scene::fire` renders. `None` where they do not lie along the axes.
    pub fn fire(file: Option<&Path>) -> Option<Self> {
        match file {
            None => {
                const N: usize = MADE_UP;
                let value = |at: IVec3| {
                    let [x, y, z] = at.to_array().map(|c| c as usize);
                    tongues((z * N + y) * N + x)
                };
                let made = Self::new([N as i32; 3], value, Vec3::splat(N as f32), Vec3::splat(-0.5));
                Some(Self { is_clipped: true, ..made })
            }
            Some(path) => Self::of_file(path),
        }
    }

    #[cfg(feature = "openvdb")]
    fn of_file(path: &Path) -> Option<Self> {
        use glam::DAffine3;
        use lanternfish::medium::grid::field::AnyGrid;
        use lanternfish::medium::grid::file;
        let grids = file::read(path).ok()?;
        let mut grid = grids.into_iter().find(|grid| grid.header.name == "density")?;
        let map = file::place(&grid, &DAffine3::IDENTITY)?;
        let Some(AnyGrid::Scalar(voxels)) = file::voxels(&mut grid) else { return None };
        let (low, high) = voxels.bounds()?;
        let (to, corner) = (map.local_from_render().matrix3, low.as_dvec3());
        let scale = glam::DVec3::new(to.x_axis.x, to.y_axis.y, to.z_axis.z);
        let is_straight = map.is_linear() && (to.x_axis + to.y_axis + to.z_axis).abs_diff_eq(scale, 1e-12);
        let offset = map.local_from_render().translation - corner;
        let size = (high - low + 1).to_array();
        is_straight.then(|| Self::new(size, |at| voxels.value(low + at), scale.as_vec3(), offset.as_vec3()))
    }

    #[cfg(not(feature = "openvdb"))]
    fn of_file(_: &Path) -> Option<Self> {
        None
    }

    fn new(size: [i32; 3], value: impl Fn(IVec3) -> f32, scale: Vec3, offset: Vec3) -> Self {
        let mut values = Vec::new();
        for x in 0..size[0] {
            for y in 0..size[1] {
                for z in 0..size[2] {
                    values.push(value(IVec3::new(x, y, z)));
                }
            }
        }
        let largest = values.iter().copied().fold(0.0, f32::max);
        Self { size, values, scale, offset, largest, is_clipped: false }
    }

    fn sample(&self, p: Vec3) -> f32 {
        let index = p * self.scale + self.offset;
        let beyond = (-0.5 - index).max(index + 0.5 - IVec3::from(self.size).as_vec3());
        if self.is_clipped && beyond.max_element() > 0.0 {
            return 0.0;
        }
        let low = index.floor();
        let f = index - low;
        let mut sum = 0.0;
        for dx in 0..2 {
            for dy in 0..2 {
                for dz in 0..2 {
                    let (x, y, z) = (low.x as i32 + dx, low.y as i32 + dy, low.z as i32 + dz);
                    if x < 0 || y < 0 || z < 0 || x >= self.size[0] || y >= self.size[1] || z >= self.size[2] {
                        continue;
                    }
                    let weight = |d: i32, f: f32| if d == 0 { 1.0 - f } else { f };
                    let value = self.values[((x * self.size[1] + y) * self.size[2] + z) as usize];
                    sum += weight(dx, f.x) * weight(dy, f.y) * weight(dz, f.z) * value;
                }
            }
        }
        sum
    }

    /// Delta tracking (until something scatters) or ratio tracking along every ray; `extinction` is that where density is 1.
    pub fn run(&self, rays: &[Ray], seed: u64, extinction: f32, is_flight: bool) -> Tracked {
        let mut stream = Stream::from_seed(seed);
        let majorant = extinction * self.largest;
        let mut steps = 0;
        let through = sum(rays.len(), |i| {
            let ray = &rays[i];
            let (mut t, mut through) = (0.0, 1.0);
            loop {
                t -= (1.0 - stream.next_f32()).ln() / majorant;
                if t >= ray.t_max {
                    return through;
                }
                steps += 1;
                let share = extinction * self.sample(ray.origin + t * ray.direction) / majorant;
                if !is_flight {
                    through *= 1.0 - share;
                } else if stream.next_f32() < share {
                    return 0.0;
                }
            }
        });
        Tracked { steps, through }
    }
}
